//! Beliefs of touched zones, with views or without.

use palpate::config::Loader;
use palpate::explore::belief::HeightField;
use palpate::explore::evidence::{Evidence, Outcome};
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::view::{SeenSurface, View};
use palpate::gp::posterior::Scratch;
use palpate::math::seed::stream;
use palpate::sim::Environment;
use palpate::sim::probe::exact_probe;
use palpate::task::Target;
use rand::RngExt;
use std::path::Path;
use std::sync::Arc;

/// Settings of a belief with views.
pub fn settings() -> GpSettings {
    Loader::read(Path::new("experiments/beliefs/camera.toml")).unwrap().finish().unwrap()
}

/// Touches random places of the zone.
pub fn touches(environment: &Arc<Environment>, count: usize) -> Vec<(Target, Outcome)> {
    let zone = environment.task().zone().unwrap();
    let mut probe = exact_probe(Arc::clone(environment));
    let mut random = stream(3, 0, "places");
    let mut touch = || {
        let target: Target = zone.at(&[(); 2].map(|()| random.random_range(0.05..0.95))).into();
        let outcome = probe.touch(&environment.task().approach(&target).unwrap()).unwrap();
        (target, outcome)
    };
    (0..count).map(|_| touch()).collect()
}

/// Returns the belief after touches, and a view if given.
pub fn belief(
    environment: &Environment,
    view: Option<&View>,
    touches: &[(Target, Outcome)],
) -> HeightField {
    let region = environment.task().region();
    let mut field = HeightField::new(region.zone().unwrap().clone(), settings());
    if let Some(view) = view {
        field.add(&Evidence::from(SeenSurface::of_region(view, region)));
    }
    touches.iter().for_each(|(target, outcome)| field.observe(target, outcome));
    field.refit().unwrap();
    field
}

/// Error of a belief's heights on a grid, m.
pub fn rmse_m(environment: &Environment, field: &HeightField) -> f64 {
    let (scratch, mut squares, mut count) = (&mut Scratch::default(), 0.0, 0.0);
    for place in field.zone().grid(21) {
        if let Some(height_m) = environment.true_height_m(&place) {
            squares += (field.surface().unwrap().mean(&place, scratch) - height_m).powi(2);
            count += 1.0;
        }
    }
    (squares / count).sqrt()
}
