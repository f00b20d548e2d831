//! What a reader must know before he believes the numbers of an experiment.

use crate::experiment::experiment::Experiment;
use crate::experiment::measure::shape::TrueShape;
use crate::experiment::measure::{CENTRED_R, Measure, R};
use crate::experiment::statistics::summary;
use crate::experiment::store::Run;
use crate::experiment::trial::row::{TrialRow, of_planner};
use crate::experiment::truth::Truth;
use crate::experiment::truth::scan_truth::LeftOut;
use crate::task::Zone;
use std::fmt;

/// Something that makes the numbers of an experiment mean less than they seem to; its `Display`
/// says so and what to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// The measures look at a small part of the zone only.
    FewPlaces {
        /// Test places with a surface.
        with: usize,
        /// All test places.
        of: usize,
    },
    /// Nobody knows the surface.
    NoTruth,
    /// The truth is a scan, which has errors of its own.
    FromScan(LeftOut),
    /// The finger can touch a small part of the surface only.
    FewReachable {
        /// Test places where it can.
        reachable: usize,
        /// Test places with a surface.
        of: usize,
    },
    /// Heights are measured from far away.
    FarDatum {
        /// The datum.
        datum_y_m: f64,
        /// The y of the lowest and highest surface.
        surface_y_m: [f64; 2],
        /// Distance between them.
        away_m: f64,
        /// Widest side of the zone.
        zone_m: f64,
    },
    /// Some of a whole object cannot be touched.
    OutOfReach {
        /// Share of its area that can be.
        reachable: f64,
    },
    /// A planner's touches mostly met nothing.
    FewContacts {
        /// Whose.
        planner: String,
        /// Touches that met something.
        contacts: usize,
        /// All touches.
        of: usize,
    },
    /// Eq. 5 cannot tell these beliefs apart.
    BlindR {
        /// Planners whose R is high and whose centred R is low.
        planners: Vec<String>,
        /// Their smallest mean R.
        r: f64,
        /// Their smallest mean centred R.
        centred_r: f64,
    },
}

/// Share of places or touches below which they are few; chosen.
const FEW: f64 = 0.25;

/// An R above the first with a centred R below the second says nothing; chosen.
const HIGH_R: f64 = 0.999;
const LOW_CENTRED_R: f64 = 0.9;

/// What `truth` says of an experiment in `zone` before it is run.
pub fn of_truth(zone: Option<&Zone>, truth: &Truth) -> Vec<Notice> {
    let Some(zone) = zone else { return Vec::new() };
    let count = truth.count();
    if count == 0 {
        return vec![Notice::NoTruth];
    }
    let few = |part: usize, of: usize| (part as f64) < FEW * of as f64;
    let places = few(count, truth.places.len())
        .then_some(Notice::FewPlaces { with: count, of: truth.places.len() });
    let reachable = truth.reachable_count();
    let reached = few(reachable, count).then_some(Notice::FewReachable { reachable, of: count });
    places.into_iter().chain(reached).chain(far_datum(zone, truth)).collect()
}

/// What the true surface of a whole object says.
pub fn of_shape(shape: &TrueShape) -> Option<Notice> {
    let reachable = shape.reachable_share()?;
    (reachable < ALMOST_ALL).then_some(Notice::OutOfReach { reachable })
}

/// Share of a surface that counts as all of it; chosen.
const ALMOST_ALL: f64 = 0.99;

/// The same and what its rows say.
pub fn of_run(run: &Run) -> Vec<Notice> {
    let Run { experiment, truth, rows, .. } = run;
    let mut notices = of_truth(experiment.scene.zone.as_ref(), truth);
    notices.extend(experiment.planners.iter().filter_map(|planner| few_contacts(rows, planner)));
    notices.extend(blind_r(experiment, rows));
    notices
}

fn far_datum(zone: &Zone, truth: &Truth) -> Option<Notice> {
    let [low_m, high_m] = truth.span_m()?;
    let away_m = low_m.max(-high_m);
    let zone_m = zone.widest_m();
    let datum_y_m = zone.datum_y_m();
    let surface_y_m = [datum_y_m + low_m, datum_y_m + high_m];
    (away_m > zone_m).then_some(Notice::FarDatum { datum_y_m, surface_y_m, away_m, zone_m })
}

fn few_contacts(rows: &[TrialRow], planner: &str) -> Option<Notice> {
    let touches = || of_planner(rows, planner).flat_map(|row| &row.touches);
    let contacts = touches().filter(|touch| touch.contact.is_some()).count();
    let of = touches().count();
    let is_few = (contacts as f64) < FEW * of as f64;
    is_few.then(|| Notice::FewContacts { planner: planner.into(), contacts, of })
}

fn blind_r(experiment: &Experiment, rows: &[TrialRow]) -> Option<Notice> {
    let last = |planner: &String| {
        let curve = summary::curve(experiment, rows, planner);
        let mean = |measure: &Measure| Some(curve.last()?.of(measure)?.mean);
        Some((planner.clone(), mean(&R)?, mean(&CENTRED_R)?))
    };
    let is_blind =
        |(_, r, centred_r): &(String, f64, f64)| *r > HIGH_R && *centred_r < LOW_CENTRED_R;
    let blind: Vec<_> = experiment.planners.iter().filter_map(last).filter(is_blind).collect();
    let smallest = |of: fn(&(String, f64, f64)) -> f64| blind.iter().map(of).reduce(f64::min);
    Some(Notice::BlindR {
        r: smallest(|(_, r, _)| *r)?,
        centred_r: smallest(|(_, _, centred_r)| *centred_r)?,
        planners: blind.iter().map(|(planner, ..)| planner.clone()).collect(),
    })
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::FewPlaces { with, of } => write!(
                f,
                "only {with} of {of} test places have a surface, and the measures look at no \
                 others: the object fills a small part of the zone (scene.zone, object.unit, \
                 object.position_m)"
            ),
            Self::NoTruth => write!(
                f,
                "nobody knows this surface: only the measures that need no truth are told \
                 (verification_touches, repeat_touches)"
            ),
            Self::OutOfReach { reachable } => write!(
                f,
                "the finger can touch {:.0} % of the object's surface by straight ways from all \
                 sides; the rest is believed from what is around it",
                100.0 * reachable
            ),
            Self::FromScan(LeftOut { contacts, rmse_m }) => {
                write!(f, "the truth is a scan of {contacts} contacts")?;
                match rmse_m {
                    Some(rmse_m) => write!(
                        f,
                        ": where one is left out, the others are {:.2} mm (RMS) off it, and no \
                         error below that means anything",
                        1e3 * rmse_m
                    ),
                    None => write!(f, ", too few to say how far it is off"),
                }
            }
            Self::FewReachable { reachable, of } => write!(
                f,
                "the finger can touch only {reachable} of {of} test places with a surface: it is \
                 too thick or too steep for this object (finger.radius_m, finger.pitch_deg)"
            ),
            Self::FarDatum { datum_y_m, surface_y_m: [low, high], away_m, zone_m } => write!(
                f,
                "zone.datum_y_m = {datum_y_m} lies {:.1} mm from the surface (y {low:.4} to \
                 {high:.4} m), and the zone is {:.1} mm wide: R (Eq. 5) is near 1 for any belief, \
                 and a zero-mean belief falls back to the datum; left out, it is {:.4}",
                1e3 * away_m,
                1e3 * zone_m,
                0.5 * (low + high)
            ),
            Self::FewContacts { planner, contacts, of } => write!(
                f,
                "{planner}: only {contacts} of {of} touches met the object or could be read"
            ),
            Self::BlindR { planners, r, centred_r } => write!(
                f,
                "R (Eq. 5) of {} is {:.4} at least while centred R is as low as {centred_r:.2}: here \
                 R cannot tell a belief from a constant height; judge by centred R and RMSE",
                planners.join(", "),
                // Rounded down: what is not 1 is not told as 1.
                (r * 1e4).floor() * 1e-4
            ),
        }
    }
}
