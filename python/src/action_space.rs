//! Actions and observations of explorations, as fractions of the region.

use crate::exploration::{AROUND, OVER_ZONE};
use crate::known::AIM;
use nalgebra::{Point3, Vector3};
use palpate::explore::evidence::Contact;
use palpate::task::{Aim, Ball, Region, Target, Zone};

/// Actions and observations in a region.
pub(crate) trait ActionSpace: Send + Sync {
    /// Points on an even grid with `per_side` along each axis, x fastest.
    fn grid(&self, per_side: usize) -> Vec<Vec<f64>>;

    /// Number of values of a touch's row.
    fn row_size(&self) -> usize;

    /// Names of the measures.
    fn measures(&self) -> [&'static str; 3];

    /// Unit of lengths in observations, m.
    fn unit_m(&self) -> f64;

    /// Converts an action, whose values are from −1 to 1, to a target.
    fn target(&self, action: &[f64]) -> Target;

    /// Row of a touch: its target, contact and 1; without contact its target alone.
    fn row(&self, target: &Target, contact: Option<&Contact>) -> Vec<f64>;
}

/// Returns the action space of a region.
pub(crate) fn of(region: &Region) -> Box<dyn ActionSpace> {
    match region {
        Region::Zone(zone) => Box::new(zone.clone()),
        Region::Ball(ball) => Box::new(*ball),
    }
}

impl ActionSpace for Zone {
    fn grid(&self, per_side: usize) -> Vec<Vec<f64>> {
        self.grid(per_side)
    }

    fn row_size(&self) -> usize {
        2 * self.dimension() + 2
    }

    fn measures(&self) -> [&'static str; 3] {
        OVER_ZONE
    }

    fn unit_m(&self) -> f64 {
        0.5 * self.widest_m()
    }

    /// An action is a place.
    fn target(&self, action: &[f64]) -> Target {
        let fractions: Vec<f64> = action.iter().map(|at| 0.5 * (at + 1.0)).collect();
        self.at(&fractions).into()
    }

    fn row(&self, target: &Target, contact: Option<&Contact>) -> Vec<f64> {
        let fraction = |(at, [low, high]): (&f64, [f64; 2])| 2.0 * (at - low) / (high - low) - 1.0;
        let place = target.place().unwrap_or_default();
        let mut row: Vec<f64> = place.iter().zip(self.sides()).map(fraction).collect();
        if let Some(contact) = contact {
            row.extend(self.place(&contact.p_wc).iter().zip(self.sides()).map(fraction));
            row.extend([self.height_m(&contact.p_wc) / ActionSpace::unit_m(self), 1.0]);
        }
        row
    }
}

impl ActionSpace for Ball {
    /// The grid is that of the cube around the ball.
    fn grid(&self, per_side: usize) -> Vec<Vec<f64>> {
        let step = 2.0 / (per_side.max(2) - 1) as f64;
        let at = |i: usize| if per_side > 1 { step * i as f64 - 1.0 } else { 0.0 };
        let all = (0..per_side.pow(3)).map(|i| [i, i / per_side, i / per_side.pow(2)]);
        all.map(|each| {
            let offset = Vector3::from(each.map(|i| at(i % per_side)));
            (self.centre_w + offset * self.radius_m).coords.as_slice().to_vec()
        })
        .collect()
    }

    fn row_size(&self) -> usize {
        AIM + 7
    }

    fn measures(&self) -> [&'static str; 3] {
        AROUND
    }

    fn unit_m(&self) -> f64 {
        self.radius_m
    }

    /// An action is the side from which the finger approaches, and the aimed point as an offset from
    /// the centre, clipped to the ball.
    fn target(&self, action: &[f64]) -> Target {
        let offset = Vector3::from_column_slice(&action[3..]).cap_magnitude(1.0);
        let p_w = self.centre_w + offset * self.radius_m;
        Aim::against(p_w, &Vector3::from_column_slice(&action[..3])).into()
    }

    fn row(&self, target: &Target, contact: Option<&Contact>) -> Vec<f64> {
        let Some(aim) = target.aim() else { return Vec::new() };
        let within = |p_w: Point3<f64>| (p_w - self.centre_w) / self.radius_m;
        let mut row: Vec<f64> = aim.direction_w.iter().map(|ahead| -ahead).collect();
        row.extend(within(aim.p_w).iter());
        if let Some(contact) = contact {
            row.extend(within(contact.p_wc).iter().chain(contact.normal_w.iter()));
            row.push(1.0);
        }
        row
    }
}
