//! Travelling around an object, from where one approach ended to where the next sets out.

use super::arm_reach::Leg;
use super::round::rounds;
use super::trajectory::Path;
use super::{DEEPER_M, Servo, State};
use crate::backend::Fault;
use crate::task::{Approach, KeepOut};
use nalgebra::{Isometry3, UnitVector3, Vector3};

/// Joints are home when each is this near; chosen, as for a finger that is turned.
const HOME_RAD: f64 = 2e-3;

impl Servo {
    /// Goes around what lies between two approaches to the stand-off `above`, an arm on a way that
    /// it has tried out.
    pub(super) fn travel_around(
        &mut self,
        around: &KeepOut,
        approach: &Approach,
        above: Isometry3<f64>,
    ) -> Result<(), Fault> {
        let ahead_t = approach.r_at.inverse() * -Vector3::y_axis();
        self.leave(around, &ahead_t)?;
        let legs = match &self.reach {
            None => vec![Leg::Around(above)],
            Some(reach) => {
                let q = self.robot.chain.joints_from(&self.state.q);
                q.and_then(|q| reach.plan(&q, approach)).ok_or_else(|| self.no_way())?
            }
        };
        for leg in legs {
            match leg {
                Leg::Around(to) => self.go_around(around, approach, to)?,
                Leg::Home => self.go_home(around)?,
            }
        }
        Ok(())
    }

    fn go_around(
        &mut self,
        around: &KeepOut,
        approach: &Approach,
        to: Isometry3<f64>,
    ) -> Result<(), Fault> {
        let here = self.x_wt();
        for round in rounds(around, here, to, &self.robot.finger, &approach.r_at) {
            let path = Path::round(round, self.settings.travel_m_s);
            self.follow("the stand-off", path, false)?;
        }
        Ok(())
    }

    /// Brings all joints home together, from where an arm comes to all that it reaches; on a line
    /// that is tried out from where they really are.
    fn go_home(&mut self, around: &KeepOut) -> Result<(), Fault> {
        let q = self.robot.chain.joints_from(&self.state.q);
        let line = self.reach.as_ref().zip(q).and_then(|(reach, q)| reach.line_home(&q, around));
        let mut line = line.ok_or_else(|| self.no_way())?;
        let period_s = self.period_s();
        let mut deadline_s = None;
        loop {
            let posture = line.advance(period_s);
            let State { time_s, q } = &self.state;
            let no_command = |cause| Fault::no_command(*time_s, cause);
            let qdot = self.control.along(q, &posture).map_err(no_command)?;
            self.carry_out(&qdot)?;
            let State { time_s, q } = &self.state;
            let deadline_s = *deadline_s.get_or_insert(time_s + line.patience_s());
            let home = self.robot.chain.start();
            let is_home = q.iter().zip(home).all(|(q, home)| (q - home).abs() < HOME_RAD);
            if line.is_done() && is_home {
                return Ok(());
            }
            if *time_s > deadline_s {
                return Err(Fault::Late { phase: "home", time_s: *time_s, q: q.clone() });
            }
        }
    }

    /// Goes straight back out of the sphere the way the finger points, where the tip is in it:
    /// after a touch that was broken off there may be something beside it.
    fn leave(&mut self, around: &KeepOut, ahead_t: &UnitVector3<f64>) -> Result<(), Fault> {
        let here = self.x_wt();
        let p_wt = here.translation.vector.into();
        if around.depth_m(&p_wt) < DEEPER_M {
            return Ok(());
        }
        let out_w = around.entrance_w(&p_wt, &(here.rotation * ahead_t));
        let out = Isometry3::from_parts(out_w.coords.into(), here.rotation);
        let speed_m_s = self.settings.approach_m_s;
        if let Some(reach) = &self.reach {
            let path = Path::straight(here.translation.vector, out, speed_m_s);
            let q = self.robot.chain.joints_from(&self.state.q);
            if !q.is_some_and(|q| reach.leaves(&q, path, around)) {
                return Err(self.no_way());
            }
        }
        self.go("the way back", out, speed_m_s, false).map(|_| ())
    }

    fn no_way(&self) -> Fault {
        Fault::NoWay { time_s: self.state.time_s, q: self.state.q.clone() }
    }
}
