//! Target of a touch.

use nalgebra::{Point3, UnitVector3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Target of the next touch, as selected by a planner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(into = "StoredTarget", try_from = "StoredTarget")]
#[schemars(with = "StoredTarget")]
pub enum Target {
    /// The place (x) or (x, z) of a zone, m.
    Place(Vec<f64>),
    /// The place (x, z) of a zone, m, touched with another pitch of the finger.
    Tilted {
        /// The place.
        place: [f64; 2],
        /// Pitch of the finger, one of the further pitches of its settings, deg.
        pitch_deg: f64,
    },
    /// The place (x, z) of a zone, m, from which the finger slides along the surface to above
    /// another.
    Stroke {
        /// The place of the touch.
        place: [f64; 2],
        /// The place at which the stroke ends.
        to: [f64; 2],
    },
    /// A point of a ball, and the direction of the approach.
    Aim(Aim),
    /// A touch around a whole object from whose contact the finger slides along the surface.
    StrokeAround {
        /// The touch.
        aim: Aim,
        /// Way of the finger across the approach, in `W`, m.
        way_w: Vector3<f64>,
    },
    /// An action that a program adds, at a tap.
    Custom {
        /// Name of the action.
        name: String,
        /// The tap.
        tap: Box<Target>,
        /// Parameters of the action.
        parameters: Vec<f64>,
    },
    /// A look of a camera.
    Look {
        /// Number of the camera's place.
        camera: u32,
    },
}

impl Target {
    /// Returns the place of a zone that is touched, if it is one.
    pub fn place(&self) -> Option<&[f64]> {
        match self {
            Self::Place(place) => Some(place),
            Self::Tilted { place, .. } | Self::Stroke { place, .. } => Some(place),
            Self::Custom { tap, .. } => tap.place(),
            Self::Aim(_) | Self::StrokeAround { .. } | Self::Look { .. } => None,
        }
    }

    /// Returns the point that a touch aims at, in the domain of beliefs: the place of a zone, or x,
    /// y and z in `W`.
    pub fn point(&self) -> Option<Vec<f64>> {
        let aimed = || self.aim().map(|aim| aim.p_w.coords.as_slice());
        Some(self.place().or_else(aimed)?.into())
    }

    /// Returns the place of a zone where the finger leaves the surface, if nothing stops it.
    pub fn end(&self) -> Option<&[f64]> {
        match self {
            Self::Stroke { to, .. } => Some(to),
            _ => self.place(),
        }
    }

    /// Returns the pitch of the finger, if it is not the finger's own.
    pub fn pitch_deg(&self) -> Option<f64> {
        match self {
            Self::Tilted { pitch_deg, .. } => Some(*pitch_deg),
            Self::Custom { tap, .. } => tap.pitch_deg(),
            _ => None,
        }
    }

    /// Returns the aim into a ball, if it is one.
    pub fn aim(&self) -> Option<&Aim> {
        match self {
            Self::Aim(aim) | Self::StrokeAround { aim, .. } => Some(aim),
            Self::Custom { tap, .. } => tap.aim(),
            _ => None,
        }
    }

    /// Returns the length of a stroke across its approach, m; 0 for a tap.
    pub fn slide_m(&self) -> f64 {
        match self {
            Self::Stroke { place, to } => (to[0] - place[0]).hypot(to[1] - place[1]),
            Self::StrokeAround { way_w, .. } => way_w.norm(),
            _ => 0.0,
        }
    }

    /// Returns the line around a whole object on which the finger leaves it, if nothing stops it.
    pub(super) fn aim_at_end(&self) -> Option<Aim> {
        let way_w = match self {
            Self::StrokeAround { way_w, .. } => *way_w,
            _ => Vector3::zeros(),
        };
        self.aim().map(|aim| Aim { p_w: aim.p_w + way_w, ..*aim })
    }

    /// Returns the coordinates for a table: (x) or (x, z) of a place, followed by the pitch in
    /// degrees if the finger is tilted, or by the end of a stroke; for an aim, x, y and z of the
    /// point, then of the direction, followed by those of a stroke's way.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Place(place) => place.clone(),
            Self::Tilted { place: [x, z], pitch_deg } => vec![*x, *z, *pitch_deg],
            Self::Stroke { place: [x, z], to: [u, v] } => vec![*x, *z, *u, *v],
            Self::Aim(aim) => aim.numbers().to_vec(),
            Self::Look { camera } => vec![f64::from(*camera)],
            Self::Custom { tap, .. } => tap.numbers(),
            Self::StrokeAround { aim, way_w } => {
                aim.numbers().iter().chain(way_w).copied().collect()
            }
        }
    }

    /// Returns the stroke around a whole object with these numbers; `None` as for [`Aim::along`].
    fn stroke_around(p_w: [f64; 3], ahead_w: [f64; 3], way_w: [f64; 3]) -> Option<Self> {
        let (aim, way_w) = (Aim::along(p_w, ahead_w)?, Vector3::from(way_w));
        way_w.iter().all(|number| number.is_finite()).then_some(Self::StrokeAround { aim, way_w })
    }
}

impl From<Vec<f64>> for Target {
    fn from(place: Vec<f64>) -> Self {
        Self::Place(place)
    }
}

impl<const N: usize> From<[f64; N]> for Target {
    fn from(place: [f64; N]) -> Self {
        Self::Place(place.into())
    }
}

impl From<&[f64]> for Target {
    fn from(place: &[f64]) -> Self {
        Self::Place(place.into())
    }
}

impl From<Aim> for Target {
    fn from(aim: Aim) -> Self {
        Self::Aim(aim)
    }
}

/// A straight approach through a point of a ball.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Aim {
    /// The point, in `W`.
    pub p_w: Point3<f64>,
    /// Direction of the approach, in `W`.
    pub direction_w: UnitVector3<f64>,
}

impl Aim {
    /// Returns an aim at `p_w` against the outward direction `outward_w`; along −z if that has
    /// length zero.
    pub fn against(p_w: Point3<f64>, outward_w: &Vector3<f64>) -> Self {
        let down_w = -Vector3::z_axis();
        Self { p_w, direction_w: UnitVector3::try_new(-outward_w, 1e-12).unwrap_or(down_w) }
    }

    /// Returns the unit vector across the direction at an angle about it, rad.
    pub fn across_w(&self, turn_rad: f64) -> Vector3<f64> {
        let beside_w = any_orthogonal(&self.direction_w);
        beside_w * turn_rad.cos() + self.direction_w.cross(&beside_w) * turn_rad.sin()
    }

    /// Coordinates x, y and z of the point, then of the direction.
    fn numbers(&self) -> [f64; 6] {
        let [x, y, z]: [f64; 3] = self.p_w.into();
        let [u, v, w]: [f64; 3] = self.direction_w.into_inner().into();
        [x, y, z, u, v, w]
    }

    /// Returns an aim at the point `p_w` along `ahead_w`, unchanged if its length is 1. Returns
    /// `None` if a number is not finite or the direction has length zero.
    pub fn along(p_w: [f64; 3], ahead_w: [f64; 3]) -> Option<Self> {
        let (p_w, ahead_w) = (Point3::from(p_w), Vector3::from(ahead_w));
        let is_finite = p_w.iter().chain(&ahead_w).all(|number| number.is_finite());
        let is_unit = (ahead_w.norm() - 1.0).abs() < 1e-12;
        let ahead_w = match is_unit {
            true => UnitVector3::new_unchecked(ahead_w),
            false => UnitVector3::try_new(ahead_w, 1e-6)?,
        };
        is_finite.then_some(Self { p_w, direction_w: ahead_w })
    }
}

/// A target as written in a row.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum StoredTarget {
    /// The place (x) or (x, z) of a zone, m.
    Place(Vec<f64>),
    /// The place of a zone, touched with another pitch of the finger.
    Tilted {
        /// The place (x, z), m.
        place: [f64; 2],
        /// Pitch of the finger, deg.
        pitch_deg: f64,
    },
    /// A touch at a place of a zone, and a slide along the surface.
    Stroke {
        /// The place (x, z), m.
        place: [f64; 2],
        /// The place at which the slide ends, m.
        to: [f64; 2],
    },
    /// An approach to a whole object.
    Aim {
        /// The point aimed at, in `W`, m.
        p_w: [f64; 3],
        /// Unit direction of the approach, in `W`.
        ahead_w: [f64; 3],
    },
    /// An approach to a whole object, and a slide along the surface.
    StrokeAround {
        /// The point aimed at, in `W`, m.
        p_w: [f64; 3],
        /// Unit direction of the approach, in `W`.
        ahead_w: [f64; 3],
        /// Way of the slide across the approach, in `W`, m.
        way_w: [f64; 3],
    },
    /// An action that a program adds, at a tap.
    Custom {
        /// Name of the action.
        name: String,
        /// The tap.
        tap: Box<StoredTarget>,
        /// Parameters of the action.
        parameters: Vec<f64>,
    },
    /// A look of a camera.
    Look {
        /// Number of the camera's place.
        camera: u32,
    },
}

impl From<Target> for StoredTarget {
    fn from(target: Target) -> Self {
        match target {
            Target::Place(place) => Self::Place(place),
            Target::Tilted { place, pitch_deg } => Self::Tilted { place, pitch_deg },
            Target::Stroke { place, to } => Self::Stroke { place, to },
            Target::Aim(Aim { p_w, direction_w: ahead_w }) => {
                Self::Aim { p_w: p_w.into(), ahead_w: ahead_w.into_inner().into() }
            }
            Target::Look { camera } => Self::Look { camera },
            Target::Custom { name, tap, parameters } => {
                Self::Custom { name, tap: Box::new((*tap).into()), parameters }
            }
            Target::StrokeAround { aim, way_w } => Self::StrokeAround {
                p_w: aim.p_w.into(),
                ahead_w: aim.direction_w.into_inner().into(),
                way_w: way_w.into(),
            },
        }
    }
}

impl TryFrom<StoredTarget> for Target {
    type Error = String;

    fn try_from(read: StoredTarget) -> Result<Self, String> {
        match read {
            StoredTarget::Place(place) => Ok(Self::Place(place)),
            StoredTarget::Tilted { place, pitch_deg } => Ok(Self::Tilted { place, pitch_deg }),
            StoredTarget::Stroke { place, to } => Ok(Self::Stroke { place, to }),
            StoredTarget::Look { camera } => Ok(Self::Look { camera }),
            StoredTarget::Custom { name, tap, parameters } => {
                Ok(Self::Custom { name, tap: Box::new((*tap).try_into()?), parameters })
            }
            StoredTarget::Aim { p_w, ahead_w } => {
                Aim::along(p_w, ahead_w).map(Self::Aim).ok_or_else(|| no_direction(ahead_w))
            }
            StoredTarget::StrokeAround { p_w, ahead_w, way_w } => {
                Self::stroke_around(p_w, ahead_w, way_w).ok_or_else(|| no_direction(ahead_w))
            }
        }
    }
}

/// Returns a unit vector orthogonal to another.
pub(crate) fn any_orthogonal(to: &UnitVector3<f64>) -> Vector3<f64> {
    let axis = if to.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    to.cross(&axis).normalize()
}

fn no_direction(ahead_w: [f64; 3]) -> String {
    format!("the direction {ahead_w:?} has length zero or is not finite")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A target is read exactly as it was written.
        #[test]
        fn a_target_is_read_as_it_was_written(
            at in prop::array::uniform3(-0.5f64..0.5),
            outward in prop::array::uniform3(-1f64..1.0),
        ) {
            let aim = Aim::against(Point3::from(at), &Vector3::from(outward));
            let tilted = Target::Tilted { place: [at[0], at[1]], pitch_deg: at[2] };
            let stroke = Target::Stroke { place: [at[0], at[1]], to: [at[2], at[0]] };
            let around = Target::StrokeAround { aim, way_w: outward.into() };
            for target in [aim.into(), at[..2].to_vec().into(), tilted, stroke, around] {
                let json = serde_json::to_string(&target).unwrap();
                prop_assert_eq!(&serde_json::from_str::<Target>(&json).unwrap(), &target);
            }
        }
    }

    #[test]
    fn a_target_is_written_by_name() {
        let json = |target: Target| serde_json::to_string(&target).unwrap();
        assert_eq!(json(vec![0.5, 1.0].into()), r#"{"place":[0.5,1.0]}"#);
        let aim = Aim::against(Point3::origin(), &Vector3::z());
        assert_eq!(json(aim.into()), r#"{"aim":{"p_w":[0.0,0.0,0.0],"ahead_w":[-0.0,-0.0,-1.0]}}"#);
    }

    #[test]
    fn an_aim_has_a_point_and_a_direction() {
        assert!(Aim::along([0.0; 3], [0.0; 3]).is_none());
        assert!(Aim::along([0.0; 3], [0.0, 0.0, f64::NAN]).is_none());
        assert_eq!(*Aim::along([0.0; 3], [0.0, 0.0, -2.0]).unwrap().direction_w, -Vector3::z());
    }
}
