//! Planner `integrated_variance`: maximises the reduction of the variance over the whole surface
//! (active learning, Cohn 1996; also called integrated variance reduction).

use super::candidates::Candidates;
use super::plan::{Plan, PlannerEntry};
use super::search::Search;
use super::sobol;
use crate::belief::{Belief, HeightField, SurfaceBelief};
use crate::whole_object::ImplicitSurface;
use palpate_gp::reduction::VarianceReduction;
use rand::RngExt;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "integrated_variance",
    about: "largest reduction of the variance over the whole surface (Cohn 1996)",
    zone_only: None,
    needs_library: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        // Seed of the places at which the variance over a zone is computed; drawn with the first
        // plan.
        let mut seed = None;
        Box::new(move |belief: &Belief| {
            Ok(match belief.surface() {
                SurfaceBelief::HeightField(field) => {
                    let seed = *seed.get_or_insert_with(|| search.rng.random());
                    in_zone(&mut search, seed, field)
                }
                SurfaceBelief::ImplicitSurface(surface) => around(&mut search, surface),
            })
        })
    },
};

fn in_zone(search: &mut Search, seed: u32, field: &HeightField) -> Plan {
    let Some(posterior) = field.planning_posterior() else { return search.anywhere(field.zone()) };
    let places = sobol::places(field.zone(), search.settings.integrated_variance.places, seed);
    let reduction = VarianceReduction::new(posterior, places.iter().map(Vec::as_slice));
    let score = search.with_gradients(field.zone(), |places| {
        reduction.at(&places.iter().map(Vec::as_slice).collect::<Vec<_>>())
    });
    search.plan(field, score)
}

fn around(search: &mut Search, surface: &ImplicitSurface) -> Plan {
    Candidates::plan(surface, &mut search.rng, |candidates| {
        let all = &candidates.all;
        let places = all.iter().map(|candidate| candidate.p_w.coords.as_slice());
        let places: Vec<&[f64]> = places.collect();
        let posterior = candidates.surface().posterior();
        let common = candidates.surface().pose_errors().iter().cloned();
        VarianceReduction::new(posterior, places.iter().copied()).with_common(common).at(&places)
    })
}
