//! Debug.
use palpate::experiment::Experiment;
use palpate::explore::belief::Belief;
use palpate::explore::planner;
use palpate::math::seed;
use palpate::sim::Environment;
use palpate::sim::environment::ObjectShape;
use palpate::sim::probe::exact_probe;
use std::sync::Arc;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let experiment = Experiment::load(path.as_ref(), &[]).unwrap();
    let environment = Arc::new(Environment::build(experiment.scene.clone()).unwrap());
    let ObjectShape::Mesh { bvh, .. } = environment.shape() else { panic!() };
    let task = environment.task();
    let view = environment.look(&mut seed::stream(1, 0, "view 0")).unwrap();
    let mut belief =
        Belief::new(task, (&experiment.scene.finger, false), &experiment.gp, &experiment.space);
    let seen = belief.observe_view(&view).unwrap().clone();
    let report = |name: &str, seen: &palpate::explore::view::SeenSurface| {
        let (mut s, mut n, mut a) = (0.0, 0, 0.0);
        for e in seen.elements() {
            let hit = bvh.closest_point(&e.p_w);
            let off = (e.p_w - hit.point).dot(&e.normal_w);
            s += off;
            a += hit.distance_m;
            n += 1;
        }
        println!(
            "{name}: {n} elements, mean signed {:.2} mm, mean distance {:.2}",
            1e3 * s / n as f64,
            1e3 * a / n as f64
        );
    };
    report("stated", &seen);
    let mut planner =
        (planner::by_name("active").unwrap().make)(&Default::default(), seed::stream(1, 0, "p"));
    let mut probe = exact_probe(Arc::clone(&environment));
    for k in 0..12 {
        let fit = belief.refit().unwrap().hyperparameters.clone();
        let e = &belief.rigid_errors()[0];
        println!(
            "{k}: s {:.4} l {:.4} noise {:.5} {:?} {} shift {:?} ± {:?} turn {:?}",
            fit.signal_sd,
            fit.length_scales[0],
            fit.noise_sd,
            fit.slope_noise_sd,
            e,
            e.shift_m.map(|x| (1e4 * x).round() / 10.0),
            e.shift_sd_m.map(|x| (1e4 * x).round() / 10.0),
            e.turn_deg.map(|x| (1e1 * x).round() / 10.0)
        );
        report("  corrected", &belief.implicit_surface().unwrap().seen()[0]);
        let plan = planner.plan(&belief).unwrap();
        let approach = task.approach(&plan.target).unwrap();
        let touch = probe.touch(&approach).unwrap();
        belief.observe(&plan.target, &approach, (&touch, probe.swept_volume().as_ref()));
    }
}
