//! Errors of registered views, and how often a wrong view is named: `make bench BENCH=camera`.
//!
//! Touches random places of the suite's zones, which a D405 beside them has seen, and prints the
//! share of the six components of its pose within 1.96 stated deviations, and the share of views in
//! doubt after eight touches: of right ones, and of mirrored ones, of other objects, and 20 mm off.

use palpate::explore::belief::HeightField;
use palpate::explore::evidence::{Evidence, Outcome};
use palpate::explore::view::{SeenSurface, View};
use palpate::math::normal::BAND_95;
use palpate::math::seed::stream;
use palpate::sim::probe::exact_probe;
use palpate::sim::{Environment, Scene};
use palpate::task::Target;
use rand::RngExt;
use std::path::Path;
use std::sync::Arc;

/// Position, mm, and rotation, deg, by which the camera is off.
const ERRORS: [[f64; 2]; 2] = [[3.0, 0.7], [10.0, 0.7]];

/// Numbers of touches.
const COUNTS: [usize; 2] = [8, 20];

/// Views of each object.
const VIEWS: u64 = 3;

/// Shift of a cloud, m.
const OFF_M: f64 = 0.02;

/// Share of some cases.
#[derive(Clone, Copy, Default)]
struct Share {
    part: usize,
    all: usize,
}

impl Share {
    fn add(&mut self, is_in: bool) {
        self.part += usize::from(is_in);
        self.all += 1;
    }

    fn of(self) -> f64 {
        self.part as f64 / self.all.max(1) as f64
    }
}

fn main() {
    println!(
        "| objects | camera | within, 8 | within, 20 | right | mirrored | other | nearer | farther | beside |"
    );
    println!("{}", "|---".repeat(10) + "|");
    for half in ["choosing", "reporting"] {
        for [mm, deg] in ERRORS {
            let environments = environments(half, mm, deg);
            let (within, named) = measure(&environments);
            let cells = within.iter().chain(&named).map(|share| format!("{:.3}", share.of()));
            println!(
                "| {half} | {mm} mm, {deg}\u{b0} | {} |",
                cells.collect::<Vec<_>>().join(" | ")
            );
        }
    }
}

/// Returns the scenes of an experiment with a camera that is off.
fn environments(half: &str, mm: f64, deg: f64) -> Vec<Arc<Environment>> {
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let m = 1e-3 * mm;
    let camera = format!(
        "camera={{ model = \"d405\", position_m = [0.15, -0.4, 0.6], noise = {{}}, holes = {{}}, \
         flying_pixels = {{}}, quantisation = {{}}, pose_error = {{ position_sd_m = [{m}, {m}, {m}], \
         rotation_sd_deg = [{deg}, {deg}, {deg}] }} }}"
    );
    let text = std::fs::read_to_string(home.join(format!("experiments/suite/{half}.toml")));
    let text = text.unwrap_or_default();
    let names =
        text.lines().filter_map(|line| line.trim().strip_prefix("\"../../")?.split('"').next());
    let scenes =
        names.filter_map(|name| Scene::load(&home.join(name), std::slice::from_ref(&camera)).ok());
    scenes.filter_map(|scene| Environment::build(scene).ok().map(Arc::new)).collect()
}

/// Returns the share of components within their band after each count, and that of views in doubt.
fn measure(environments: &[Arc<Environment>]) -> ([Share; 2], [Share; 6]) {
    let (mut within, mut named) = <([Share; 2], [Share; 6])>::default();
    for (object, here) in environments.iter().enumerate() {
        for draw in 0..VIEWS {
            let number = VIEWS * object as u64 + draw;
            let (Some(camera), Ok(view)) =
                (&here.scene().camera, here.look(0, &mut stream(number, 0, "view")))
            else {
                continue;
            };
            let touches = touches(here, number);
            let Some(truth) = camera.true_error(&mut stream(number, 0, "view")) else { continue };
            for (count, within) in COUNTS.into_iter().zip(&mut within) {
                let Some(found) = field(here, &view, &touches[..count]) else { continue };
                let found = found.rigid_errors().remove(0);
                truth.deviations(&found).iter().for_each(|z| within.add(z.abs() <= BAND_95));
            }
            let other = &environments[(object + 1 + draw as usize) % environments.len()];
            let Ok(other) = other.look(0, &mut stream(number, 1, "view")) else { continue };
            let moved = |by_m: [f64; 3]| moved(&view, |p| std::array::from_fn(|i| p[i] + by_m[i]));
            let views = [
                view.clone(),
                self::moved(&view, |[x, y, z]| [-x, y, z]),
                View { x_wc: view.x_wc, pivot_w: view.pivot_w, ..other },
                moved([0.0, 0.0, -OFF_M]),
                moved([0.0, 0.0, OFF_M]),
                moved([OFF_M, 0.0, 0.0]),
            ];
            for (view, named) in views.iter().zip(&mut named) {
                if let Some(field) = field(here, view, &touches[..COUNTS[0]]) {
                    let error = field.rigid_errors().remove(0);
                    named.add(error.doubt.is_some() || error.prior_sds > 4.5);
                }
            }
        }
    }
    (within, named)
}

/// Returns the belief, whose view is registered to the touches; `None` if the view shows nothing.
fn field(
    environment: &Environment,
    view: &View,
    touches: &[(Target, Outcome)],
) -> Option<HeightField> {
    let region = environment.task().region();
    let seen = SeenSurface::of_region(view, region);
    let mut field = HeightField::new(region.zone()?.clone(), Default::default());
    field.add(&Evidence::from((!seen.is_empty()).then_some(seen)?));
    touches.iter().for_each(|(target, outcome)| field.observe(target, outcome));
    field.register();
    Some(field)
}

/// Touches random places.
fn touches(environment: &Arc<Environment>, number: u64) -> Vec<(Target, Outcome)> {
    let mut random = stream(number, 0, "touches");
    let mut probe = exact_probe(Arc::clone(environment));
    let Some(zone) = environment.task().zone() else { return Vec::new() };
    let mut touch = || {
        let target: Target = zone.at(&[(); 2].map(|()| random.random_range(0.05..0.95))).into();
        let approach = environment.task().approach(&target)?;
        let outcome = probe.touch(&approach).ok()?;
        Some((target, outcome))
    };
    std::iter::repeat_with(&mut touch).flatten().take(COUNTS[1]).collect()
}

fn moved(view: &View, by: impl Fn([f64; 3]) -> [f64; 3]) -> View {
    let points_c = view.points_c.iter().map(|p| by([p.x, p.y, p.z]).into()).collect();
    View { points_c, ..view.clone() }
}
