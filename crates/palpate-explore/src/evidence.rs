//! Evidence: what an action has shown of the surface, in the world frame `W`.
//!
//! A tap, a gel pad, a stroke and a camera differ in the numbers of their evidence, not in its
//! type. A belief takes each kind with [`Belief::observe`](crate::belief::Belief::observe); a
//! trial's row stores it as it is.

pub use crate::contact::Contact;
use crate::robot::Finger;
use crate::robot::sensor::{Doubt, SensedContact};
use crate::task::{Approach, Zone};
use crate::view::SeenSurface;
use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Result of an action with all that it has shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outcome {
    /// End of the action.
    pub end: End,
    /// Evidence, the point of contact first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub evidence: Vec<Evidence>,
    /// Time of simulator or robot at the action's end, s since its start; omitted without motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Reason why a contact is less certain than usual, or was not located.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doubt: Option<Doubt>,
    /// Quantities that a custom action has measured.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measured: BTreeMap<String, f64>,
    /// Pose of the fingertip in `W`, by forward kinematics, at the reading of the contact, and what
    /// its sensor located; `None` for a probe without a finger, or without a contact.
    #[serde(skip)]
    pub sensed: Option<(Isometry3<f64>, SensedContact)>,
}

/// End of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The finger made contact with the surface.
    Contact,
    /// The finger travelled the whole approach without contact.
    Miss,
    /// Force or pressure exceeded its limit, or the contact could not be located.
    Overload,
    /// The camera looked.
    Looked,
}

impl End {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Contact => "contact",
            Self::Miss => "miss",
            Self::Overload => "overload",
            Self::Looked => "looked",
        }
    }
}

impl Outcome {
    /// Creates the outcome of an action without a time and a doubt.
    pub fn new(end: End, evidence: Vec<Evidence>) -> Self {
        Self { end, evidence, time_s: None, doubt: None, measured: BTreeMap::new(), sensed: None }
    }

    /// Returns the points of the surface, the point of contact first; none without contact.
    pub fn points(&self) -> &[Contact] {
        self.surface_points().map_or(&[], |points| &points.points)
    }

    /// Returns the points of the surface with their source.
    pub fn surface_points(&self) -> Option<&SurfacePoints> {
        self.evidence.iter().find_map(|evidence| match evidence {
            Evidence::Points(points) => Some(points),
            Evidence::Free(_) | Evidence::Seen(_) => None,
        })
    }

    /// Returns the point of contact, if there is one.
    pub fn contact(&self) -> Option<&Contact> {
        self.points().first()
    }

    /// Returns the space that the finger found free, if it is known.
    pub fn free(&self) -> Option<&FreeVolume> {
        self.evidence.iter().find_map(|evidence| match evidence {
            Evidence::Free(free) => Some(free),
            Evidence::Points(_) | Evidence::Seen(_) => None,
        })
    }

    /// Returns the surface that a camera has seen, if it looked.
    pub fn seen(&self) -> Option<&SeenSurface> {
        self.evidence.iter().find_map(|evidence| match evidence {
            Evidence::Seen(seen) => Some(&**seen),
            Evidence::Points(_) | Evidence::Free(_) => None,
        })
    }
}

impl From<Contact> for Outcome {
    /// Creates the outcome of a touch of which only the point of contact is known.
    fn from(contact: Contact) -> Self {
        Self::new(End::Contact, vec![Evidence::Points(contact.into())])
    }
}

impl From<End> for Outcome {
    /// Creates the outcome of an action that has shown nothing.
    fn from(end: End) -> Self {
        Self::new(end, Vec::new())
    }
}

/// Evidence of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// Points of the surface.
    Points(SurfacePoints),
    /// Space without an object.
    Free(FreeVolume),
    /// Surface that a camera has seen.
    Seen(Box<SeenSurface>),
}

impl From<SeenSurface> for Evidence {
    fn from(seen: SeenSurface) -> Self {
        Self::Seen(Box::new(seen))
    }
}

/// Points of the surface that one action has shown; the point of contact is the first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfacePoints {
    /// The points.
    pub points: Vec<Contact>,
    /// Source of an error that the points have in common; if omitted, each point has an error of
    /// its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<ErrorSource>,
}

/// Source of an error that points have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ErrorSource {
    /// One stroke: the bias of its sensor, of the size that each point states, stays the same while
    /// it slides.
    Stroke,
    /// One grasp, posture of an arm, or session: the robot's pose is off by one vector, whose size
    /// is learned. Not together with strokes and views.
    Posture,
}

impl SurfacePoints {
    /// Creates the evidence of points that a sensor has located with the fingertip at `x_wt`.
    pub fn sensed(x_wt: &Isometry3<f64>, sensed: &SensedContact) -> Self {
        let all = std::iter::once(sensed).chain(&sensed.patch);
        all.map(|point| Contact::sensed(x_wt, point)).collect::<Vec<_>>().into()
    }

    /// Returns the first point, and those of the others that are `apart_m` from the one before.
    pub fn thinned(&self, apart_m: f64) -> Self {
        let mut last_w: Option<Point3<f64>> = None;
        let is_next = |point: &&Contact| {
            let is_apart = last_w.is_none_or(|last_w| (point.p_wc - last_w).norm() >= apart_m);
            last_w = if is_apart { Some(point.p_wc) } else { last_w };
            is_apart
        };
        let points = self.points.iter().filter(is_next).cloned().collect();
        Self { points, ..*self }
    }

    /// Returns the length of the line through all points, m.
    pub fn length_m(&self) -> f64 {
        let steps = self.points.iter().zip(self.points.iter().skip(1));
        steps.map(|(from, to)| (to.p_wc - from.p_wc).norm()).sum()
    }
}

impl From<Contact> for SurfacePoints {
    fn from(contact: Contact) -> Self {
        vec![contact].into()
    }
}

impl From<Vec<Contact>> for SurfacePoints {
    fn from(points: Vec<Contact>) -> Self {
        Self { points, source: None }
    }
}

/// Space that a touch has found free: the hull of a finger that moved straight without contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FreeVolume {
    /// The finger's hull.
    pub finger: Finger,
    /// Centre of the fingertip's hemisphere in `W` at the end of its motion.
    #[schemars(with = "[f64; 3]")]
    pub p_wt: Point3<f64>,
    /// Attitude of the fingertip in `W`, a unit quaternion (x, y, z, w).
    #[schemars(with = "[f64; 4]")]
    pub r_wt: UnitQuaternion<f64>,
    /// Direction of the motion in `W`.
    #[schemars(with = "[f64; 3]")]
    pub ahead_w: UnitVector3<f64>,
    /// Length of the motion in the region, m.
    pub way_m: f64,
    /// Length of the approach through the region, m.
    pub approach_m: f64,
    /// End of the touch.
    pub end: End,
}

impl FreeVolume {
    /// Creates the volume that `finger` has swept on `approach` up to `p_wt`, where the touch
    /// ended.
    pub fn new(finger: Finger, approach: &Approach, p_wt: Point3<f64>, end: End) -> Self {
        let ahead_w = approach.direction_w();
        Self {
            finger,
            p_wt,
            r_wt: approach.r_wt(),
            ahead_w,
            way_m: (p_wt - approach.p_near_w).dot(&ahead_w),
            approach_m: (approach.p_far_w - approach.p_near_w).dot(&ahead_w),
            end,
        }
    }

    /// Returns the depth of a point of `W` within the volume and up to `beside_m` beside it, m;
    /// negative outside.
    pub(crate) fn depth_m(&self, zone: &Zone, p_w: &Point3<f64>, beside_m: f64) -> f64 {
        let place = zone.place(p_w);
        let moved = |axis: usize, by_m: f64| {
            let mut moved = place.clone();
            moved[axis] += by_m;
            moved
        };
        let beside =
            (0..place.len()).flat_map(|axis| [-beside_m, beside_m].map(|by| moved(axis, by)));
        let around: Vec<Vec<f64>> = std::iter::once(place.clone()).chain(beside).collect();
        let bounds_m = self.upper_bounds_m(zone, around.iter().map(Vec::as_slice));
        let highest_m = bounds_m.map(|bound_m| bound_m.unwrap_or(f64::INFINITY));
        zone.height_m(p_w) - highest_m.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the upper bound of the surface's height above the datum at each of `places` of
    /// `zone`, along whose axis the finger moved; `None` where the hull did not pass.
    pub fn upper_bounds_m<'a>(
        &'a self,
        zone: &'a Zone,
        places: impl Iterator<Item = &'a [f64]> + 'a,
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        let p_zt = zone.x_wz().inverse_transform_point(&self.p_wt);
        let front = self.finger.front();
        places.map(move |place| {
            let p_z = zone.local(place, 0.0);
            let front_m = front.y_m(p_z.x - p_zt.x, p_z.z - p_zt.z)?;
            Some(p_zt.y + front_m - zone.datum_y_m())
        })
    }
}
