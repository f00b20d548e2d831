//! Offer: the actions that a planner may choose, and what they cost in time.

use crate::task::Target;
pub use crate::view::LookOffer;

/// Further actions on offer beside a tap at any target of the region, and what they cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Offer {
    /// Looks of the camera.
    pub looks: Vec<LookOffer>,
    /// Time of a touch, s.
    pub touch_s: f64,
    /// Strokes; `None` if the scene allows none.
    pub stroke: Option<StrokeOffer>,
}

impl Offer {
    /// Returns the offer without the kinds of actions that are not among `actions`.
    pub fn only(self, actions: &[ActionKind]) -> Self {
        let has = |kind| actions.contains(&kind);
        Self {
            looks: if has(ActionKind::Look) { self.looks } else { Vec::new() },
            stroke: self.stroke.filter(|_| has(ActionKind::Stroke)),
            touch_s: self.touch_s,
        }
    }
}

/// Kind of actions that a planner may choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActionKind {
    /// A touch at one place.
    Tap,
    /// A touch that slides along the surface.
    Stroke,
    /// A look of a camera.
    Look,
}

impl ActionKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Tap, Self::Stroke, Self::Look];

    /// Name in an experiment's list of planners: `active(tap, look)`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tap => "tap",
            Self::Stroke => "stroke",
            Self::Look => "look",
        }
    }

    /// Returns the kinds in a list of names; `None` if it has another name, or none.
    pub fn parse(names: &str) -> Option<Vec<Self>> {
        let kind = |name: &str| Self::ALL.into_iter().find(|kind| kind.name() == name.trim());
        names.split(',').map(kind).collect()
    }
}

/// Strokes that a scene allows, and what they cost.
#[derive(Clone, Debug, PartialEq)]
pub struct StrokeOffer {
    /// Largest length of a stroke across the approach, m.
    pub longest_m: f64,
    /// Speed along it, m/s.
    pub speed_m_s: f64,
    /// Time of a tap without the way there, s.
    pub tap_s: f64,
    /// Speed of the way to a touch, m/s.
    pub travel_m_s: f64,
    /// Last target, from whose end the finger comes.
    pub from: Option<Target>,
}
