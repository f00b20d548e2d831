//! Cost of a view of 640 × 480 pixels: taken in, thinned and fitted; and a belief's update after a
//! touch with a view, over that without one.

use palpate::explore::belief::HeightField;
use palpate::explore::evidence::Evidence;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner::{self, Offer};
use palpate::explore::view::SeenSurface;
use palpate::math::seed::stream;
use palpate::sim::probe::exact_probe;
use palpate::sim::{Environment, Scene};
use palpate_input::config::Loader;
use rand::RngExt;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Touches of the belief that is updated.
const TOUCHES: usize = 20;

/// Repetitions, of which the fastest counts.
const ROUNDS: usize = 15;

fn main() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let beliefs = |name: &str| {
        let settings = Loader::read(&home.join(format!("experiments/beliefs/{name}.toml")));
        settings.ok().and_then(|loader| loader.finish::<GpSettings>().ok()).unwrap_or_default()
    };
    let camera = "camera={ model = \"d405\", position_m = [0.15, -0.4, 0.6], pixels = [640, 480], \
                  noise = {}, pose_error = {}, holes = {}, flying_pixels = {}, quantisation = {} }";
    for name in ["container", "bird"] {
        let path = home.join(format!("scenes/{name}.toml"));
        let scene = Scene::load(&path, &[camera.into()]);
        let Some(environment) = scene.ok().and_then(|scene| Environment::build(scene).ok()) else {
            continue;
        };
        measure(name, Arc::new(environment), [beliefs("objects"), beliefs("camera")]);
    }
}

fn measure(name: &str, environment: Arc<Environment>, settings: [GpSettings; 2]) {
    let mut random = stream(1, 0, "view");
    let (Some(zone), Ok(view)) = (environment.task().zone(), environment.look(0, &mut random))
    else {
        return;
    };
    let [alone, seen] = settings;
    let shown = || Evidence::from(SeenSurface::of_region(&view, environment.task().region()));
    let taken_s = fastest(|| {
        let mut field = HeightField::new(zone.clone(), seen.clone());
        field.add(&shown());
        field.refit().is_ok()
    });
    println!(
        "{name}: {} points taken in, thinned, fitted: {:.0} ms",
        view.points_c.len(),
        1e3 * taken_s
    );
    let mut fields = [alone, seen].map(|settings| HeightField::new(zone.clone(), settings));
    fields[1].add(&shown());
    let mut probe = exact_probe(Arc::clone(&environment));
    for _ in 0..TOUCHES {
        let target = zone.at(&[(); 2].map(|()| random.random_range(0.05..0.95))).into();
        let Some(approach) = environment.task().approach(&target) else { return };
        let Ok(outcome) = probe.touch(&approach) else { return };
        for field in &mut fields {
            field.observe(&target, &outcome);
            // Each update starts at the fit before it.
            if field.refit().is_err() {
                return;
            }
        }
    }
    let Some(active) = planner::by_name("active") else { return };
    let updates_s = fields.map(|field| {
        let fit_s = fastest(|| field.clone().refit().is_ok());
        let belief = field.into();
        let plan_s = fastest(|| {
            (active.make)(&Default::default(), stream(1, 0, "active"))
                .plan(&belief, &Offer::default())
                .is_ok()
        });
        [fit_s, plan_s]
    });
    for (i, what) in ["fit", "choice"].into_iter().enumerate() {
        let [alone_s, seen_s] = updates_s.map(|parts_s| parts_s[i]);
        println!(
            "{name}, {what} after {TOUCHES} touches: {:.1} ms, with the view {:.1} ms, {:.1} times",
            1e3 * alone_s,
            1e3 * seen_s,
            seen_s / alone_s,
        );
    }
}

/// Returns the shortest time of a call.
fn fastest(mut call: impl FnMut() -> bool) -> f64 {
    let each = (0..ROUNDS).map(|_| {
        let begin = Instant::now();
        black_box(call());
        begin.elapsed().as_secs_f64()
    });
    each.fold(f64::INFINITY, f64::min)
}
