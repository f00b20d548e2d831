use palpate::experiment::Experiment;
use palpate::explore::belief::HeightField;
use palpate::gp::posterior::Scratch;
use palpate::math::seed;
use palpate::sim::Environment;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let experiment = Experiment::load(path.as_ref(), &[]).unwrap();
    let environment = Environment::build(experiment.scene.clone()).unwrap();
    let zone = environment.task().zone().unwrap().clone();
    let mut random = seed::stream(1, 0, "view 0");
    let t = std::time::Instant::now();
    let view = environment.look(&mut random).unwrap();
    println!("look {:?}: {} points", t.elapsed(), view.points_c.len());
    let mut field = HeightField::new(zone.clone(), experiment.gp.clone());
    let t = std::time::Instant::now();
    field.observe_view(&view);
    println!("thin {:?}", t.elapsed());
    let seen = field.seen()[0].clone();
    let (mut sum, mut n, mut z2) = (0.0, 0, 0.0);
    for e in seen.elements() {
        let place = zone.place(&e.p_w);
        if let Some(h) = environment.true_height_m(&place) {
            let off = zone.height_m(&e.p_w) - h;
            let up = zone.x_wz().inverse_transform_vector(&e.normal_w).y;
            if zone.contains(&place) && up >= 0.25 && (off * up / e.sd).abs() > 4.0 {
                println!(
                    "  outlier {place:?} off {:.2} mm up {up:.2} sd {:.3}",
                    1e3 * off,
                    1e3 * e.sd
                );
            }
            let up = zone.x_wz().inverse_transform_vector(&e.normal_w).y;
            if !zone.contains(&place) || up < 0.25 {
                continue;
            }
            let off = zone.height_m(&e.p_w) - h;
            sum += off;
            n += 1;
            z2 += (off * up / e.sd).powi(2);
            if n % 20 == 0 {
                println!(
                    "  place {place:?} off {:.2} mm, up {up:.2}, sd {:.3}",
                    1e3 * off,
                    1e3 * e.sd
                );
            }
        }
    }
    println!(
        "{} elements, {n} used, mean off {:.2} mm, z rms {:.2}",
        seen.len(),
        1e3 * sum / n as f64,
        (z2 / n as f64).sqrt()
    );
    for round in 0..3 {
        let t = std::time::Instant::now();
        let fit = field.refit().unwrap().0.clone();
        println!("refit {round} {:?} {fit:?}", t.elapsed());
        println!("  {:?}", field.rigid_errors());
        let surface = field.surface().unwrap();
        let s = &mut Scratch::default();
        let (mut sq, mut n, mut mean) = (0.0, 0, 0.0);
        for place in zone.grid(21) {
            if let Some(h) = environment.true_height_m(&place) {
                let off = surface.mean(&place, s) - h;
                sq += off * off;
                n += 1;
                mean += off;
            }
        }
        println!(
            "  rmse {:.2} mm, mean {:.2}",
            1e3 * (sq / n as f64).sqrt(),
            1e3 * mean / n as f64
        );
    }
}
