//! Places of the believed surface among which planners choose.

use super::unseen::unseen;
use super::way::free_aim;
use crate::explore::around::ImplicitSurface;
use crate::explore::around::surface::{Surface, steepness};
use crate::explore::planner::plan::{Plan, Stall};
use crate::explore::planner::sample::any_side;
use crate::task::Aim;
use nalgebra::{Point3, UnitVector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Cells along the surface's box on which candidates are sought, and most of them; chosen.
const CELLS: u32 = 28;
const MOST: usize = 400;

/// A place of the believed surface.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// In `W`.
    pub p_w: Point3<f64>,
    /// Unit outward normal there.
    pub normal_w: UnitVector3<f64>,
    /// How far the surface may lie from there, σ / |∇f|.
    pub offset_m: f64,
}

/// Places all over the believed surface.
pub struct Candidates<'a> {
    belief: &'a ImplicitSurface,
    surface: &'a Surface,
    /// In no order.
    pub all: Vec<Candidate>,
}

impl<'a> Candidates<'a> {
    /// Of what `belief` holds for the surface, thinned evenly; none before the first fit, or where
    /// no surface is believed.
    pub fn of(belief: &'a ImplicitSurface, rng: &mut ChaCha8Rng) -> Option<Self> {
        let surface = belief.surface()?;
        let mesh = surface.mesh(CELLS)?;
        let vertices = mesh.vertices();
        let step = vertices.len().div_ceil(MOST).max(1);
        let first = rng.random_range(0..step.min(vertices.len()));
        let points_w: Vec<Point3<f64>> =
            vertices.iter().skip(first).step_by(step).copied().collect();
        let mut field = surface.field();
        let sds_m = surface.sds_m(&points_w);
        let all = points_w.into_iter().zip(sds_m).filter_map(|(p_w, sd_m)| {
            let gradient = field.at(&p_w).gradient;
            let normal_w = UnitVector3::try_new(gradient, 1e-9)?;
            Some(Candidate { p_w, normal_w, offset_m: sd_m / steepness(&gradient) })
        });
        Some(Self { belief, surface, all: all.collect() })
    }

    /// To go where the scores that `score` gives the candidates are highest and the way is free, or
    /// now and then where nothing is known; anywhere where no surface is believed.
    pub fn choose(
        belief: &ImplicitSurface,
        rng: &mut ChaCha8Rng,
        score: impl FnOnce(&Candidates) -> Vec<f64>,
    ) -> Plan {
        if let Some(aim) = unseen(belief, rng) {
            return decided(&aim, None);
        }
        let aside = any_side(belief.scope(), rng);
        match Candidates::of(belief, rng) {
            Some(candidates) => candidates.best(score(&candidates).into_iter(), &aside),
            None => decided(&aside, None),
        }
    }

    /// The surface they are of.
    pub fn surface(&self) -> &Surface {
        self.surface
    }

    /// To go where the score, one of each in their order, is highest and the way is free;
    /// `anywhere` if none is.
    pub fn best(&self, scores: impl Iterator<Item = f64>, anywhere: &Aim) -> Plan {
        let mut order: Vec<(f64, &Candidate)> = scores.zip(&self.all).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut field = self.surface.field();
        let free = order.into_iter().find_map(|(_, candidate)| {
            let place = (&candidate.p_w, &candidate.normal_w);
            let aim = free_aim(self.belief, &mut field, place)?;
            Some(decided(&aim, Some(candidate.offset_m)))
        });
        free.unwrap_or_else(|| blocked(anywhere))
    }
}

/// A plan to go where a planner's own rule wants.
pub fn decided(aim: &Aim, sd_m: Option<f64>) -> Plan {
    Plan { sd_m, ..Plan::at(*aim) }
}

/// A plan to go anywhere, since no way to what the rule wants is free.
fn blocked(aim: &Aim) -> Plan {
    Plan { stall: Some(Stall::Blocked), ..Plan::at(*aim) }
}
