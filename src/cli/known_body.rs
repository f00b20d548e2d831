//! Options for a ball or a plate of known shape.

use anyhow::Context;
use nalgebra::{UnitVector3, Vector3};
use palpate_explore::registration::CalibrationBody;

#[derive(clap::Args)]
pub(super) struct KnownBodyArgs {
    /// Ball of this radius, m, in place of the scene's object.
    #[arg(long, value_name = "RADIUS_M", value_parser = radius, requires = "at", conflicts_with = "plate")]
    ball: Option<f64>,
    /// Plate in its place; its normal towards the finger.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, requires = "at", allow_hyphen_values = true)]
    plate: Option<[f64; 3]>,
    /// Centre of the ball, a point of the plate, or with --cloud the mesh's origin, m.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true)]
    pub(super) at: Option<[f64; 3]>,
}

/// Allowed radii of a ball, m; a finger can touch it all around.
const RADII_M: std::ops::RangeInclusive<f64> = 2e-3..=0.2;

fn radius(text: &str) -> Result<f64, String> {
    let radius_m = text.parse().ok().filter(|radius_m| RADII_M.contains(radius_m));
    radius_m.ok_or(format!("allowed is {} to {} m", RADII_M.start(), RADII_M.end()))
}

pub(super) fn numbers(text: &str) -> Result<[f64; 3], String> {
    array(text).ok_or("allowed are three numbers, as in 0,-0.65,0.5".into())
}

/// Reads numbers between commas, at most 1000 each.
pub(super) fn array<const N: usize>(text: &str) -> Option<[f64; N]> {
    let parsed: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let found = parsed.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
    found.filter(|numbers| numbers.iter().all(|number| number.abs() <= 1e3))
}

impl KnownBodyArgs {
    /// Returns the ball or plate of the options, if one is given.
    pub(super) fn body(&self) -> anyhow::Result<Option<CalibrationBody>> {
        let Some(at) = self.at else { return Ok(None) };
        if let Some(radius_m) = self.ball {
            return Ok(Some(CalibrationBody::Ball { centre_w: at.into(), radius_m }));
        }
        let normal =
            Vector3::from(self.plate.context("--at needs --ball RADIUS_M or --plate X,Y,Z")?);
        let normal_w = UnitVector3::try_new(normal, 1e-9)
            .context("--plate: the zero vector has no direction")?;
        Ok(Some(CalibrationBody::Plate { point_w: at.into(), normal_w }))
    }
}
