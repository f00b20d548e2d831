//! Warnings about likely configuration mistakes in a scene that can be built; each says how to
//! change it.

use super::scene::{Scene, Unit};
use clap::ValueEnum;
use nalgebra::{Point3, UnitVector3, Vector2};
use palpate_explore::robot::arm::Chain;
use palpate_explore::robot::finger::frame::FRAME_S;
use palpate_explore::robot::finger::shape::BIOTAC_RADIUS_M;
use palpate_explore::robot::sensor::Signal;
use palpate_explore::task::{DIRECTIONS, Task, Zone};
use palpate_geometry::holes::{Hole, description};
use palpate_geometry::low_discrepancy::directions;
use palpate_geometry::mesh::Mesh;

/// Notice that a soft finger without tables gets those of a BioTac.
pub(super) const DEFAULT_FINGER: &str = "the scene has no [effects]: its finger gets the default \
    [effects.skin], [effects.fluid] and [effects.electrodes]";

/// Notice that the file of an arm lacks something.
pub(super) fn arm_lacks(file: &str, lacks: &[String]) -> String {
    format!(
        "{file} lacks the following, with what is assumed: {}; give them in an arm model (.toml)",
        lacks.join("; ")
    )
}

/// Notice that the radius of a soft finger differs from the BioTac's.
pub(super) fn scaled_finger(radius_m: f64) -> String {
    format!(
        "finger.radius_m = {radius_m}: this is a BioTac scaled from {BIOTAC_RADIUS_M} m that detects \
         contact at the same force; RMSE on the container after 20 touches was 0.39 mm at 0.005, 0.30 at \
         0.007, 0.46 at 0.008 and 0.79 at 0.010, so gp.noise_sd_m of the shipped experiments may be too \
         small (docs/finger.md)"
    )
}

/// Returns a notice if contacts of `detection_n` are lost in the noise of the force/torque sensor
/// that locates them on the finger at the end of `chain`.
pub(super) fn vague_contacts(scene: &Scene, chain: &Chain) -> Option<String> {
    let effect =
        scene.effects.wrench.as_ref().filter(|_| scene.sensor.signal() == Some(Signal::Wrench))?;
    let touch = &scene.touch;
    let readings = touch.frames as f64 * FRAME_S / scene.period_s();
    let lever_m = chain.tool.translation.vector.norm();
    let least_n = effect.accuracy().least_located_n(&scene.finger, lever_m, readings);
    let frames = (touch.frames as f64 * (least_n / touch.detection_n).powi(2)).ceil();
    let or = if frames <= 100.0 { format!(" or touch.frames = {frames}") } else { String::new() };
    (touch.detection_n < least_n).then(|| {
        format!(
            "touch.detection_n = {}: the force/torque sensor tells contact, but not its place on the tip, \
             which takes {least_n:.1} N{or}",
            touch.detection_n
        )
    })
}

/// Notice that a share of a region, 0 to 1, lies over holes of the mesh.
pub(super) fn holes<'a>(
    region: &str,
    share: f64,
    holes: impl IntoIterator<Item = &'a Hole>,
) -> String {
    format!(
        "{:.1} % of the {region} has no surface: the mesh has {}; a simulated finger meets a flat patch \
         there, and errors are not computed there; if the object itself has these holes, set \
         object.fill_holes = false",
        100.0 * share,
        description(holes)
    )
}

/// Notice of the holes in the mesh of a whole object.
pub(super) fn holes_of_object(mesh: &Mesh, holes: &[Hole]) -> Option<String> {
    let area_m2: f64 = holes.iter().map(|hole| hole.area_m2).sum();
    (!holes.is_empty()).then(|| self::holes("object", area_m2 / mesh.area_m2(), holes))
}

/// Sides of an object, seen from the middle of the robot's foot or from the home of a stage.
const SIDES: [&str; 6] = ["behind", "the robot's side", "the left", "the right", "above", "below"];

/// Returns a notice of the directions from which a robot with its foot at `foot_w` cannot reach the
/// middle of a whole object; `None` if it reaches it from everywhere.
pub(super) fn unreachable_directions(task: &Task, foot_w: &Point3<f64>) -> Option<String> {
    let away_w = (task.ball()?.centre_w - foot_w).xy().try_normalize(1e-6);
    let away_w = away_w.unwrap_or_else(Vector2::x);
    // Seen from the foot, the left is a quarter of a turn counter-clockwise.
    let side = |outward_w: &UnitVector3<f64>| {
        let flat = outward_w.xy();
        let along = [flat.dot(&away_w), away_w.perp(&flat), outward_w.z];
        let parts = along.into_iter().flat_map(|part| [part, -part]).enumerate();
        parts.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(side, _)| side)
    };
    let mut counts = [[0; 2]; SIDES.len()];
    directions(DIRECTIONS).for_each(|outward_w| counts[side(&outward_w)][1] += 1);
    let unreached = task.unreached(DIRECTIONS);
    unreached.iter().for_each(|outward_w| counts[side(outward_w)][0] += 1);
    let sides = SIDES.into_iter().zip(counts).filter(|(_, [missed, _])| *missed > 0);
    let sides: Vec<String> = sides
        .map(|(side, [missed, of])| match missed == of {
            true => format!("all {of} from {side}"),
            false => format!("{missed} of {of} from {side}"),
        })
        .collect();
    (!sides.is_empty()).then(|| {
        format!(
            "the finger cannot reach the object from {} of {DIRECTIONS} directions: {}",
            unreached.len(),
            sides.join(", ")
        )
    })
}

// Ratio of the sizes of object and zone above which there is a notice.
// heuristic: below the ratio of a metre to an inch.
const MISMATCH_RATIO: f64 = 20.0;

// Largest ratio of sizes at which an object fits its zone.
// heuristic: far below `MISMATCH_RATIO`.
const FIT_RATIO_MAX: f64 = 5.0;

/// Returns a notice if the object, which spans `low` to `high` in the frame of `zone`, is far
/// larger or smaller than the zone (a sign of a wrong unit); otherwise `None`.
pub(super) fn size_mismatch(
    zone: &Zone,
    unit: Unit,
    [low, high]: &[Point3<f64>; 2],
) -> Option<String> {
    let object_m = (high.x - low.x).max(high.z - low.z);
    let zone_m = zone.widest_m();
    let off = |size_m: f64| (size_m / zone_m).ln().abs();
    if off(object_m) < MISMATCH_RATIO.ln() {
        return None;
    }
    let off_in = |other: &Unit| off(object_m / unit.metres_per_unit() * other.metres_per_unit());
    let fitting = Unit::value_variants().iter().copied();
    let fitting = fitting.min_by(|a, b| off_in(a).total_cmp(&off_in(b)));
    let remedy = match fitting.filter(|fitting| off_in(fitting) < FIT_RATIO_MAX.ln()) {
        Some(fitting) => {
            let would_m = object_m / unit.metres_per_unit() * fitting.metres_per_unit();
            format!("; with object.unit = \"{fitting}\" it would measure {would_m:.4} m")
        }
        None => "; correct object.unit or object.scale".into(),
    };
    let (factor, how) = match object_m > zone_m {
        true => (object_m / zone_m, "larger"),
        false => (zone_m / object_m, "smaller"),
    };
    Some(format!(
        "the object is {factor:.0} times {how} than the zone ({object_m:.4} m, the zone \
         {zone_m:.4} m); object.unit is \"{unit}\"{remedy}"
    ))
}
