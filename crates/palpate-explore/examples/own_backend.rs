//! A custom backend: a stage of three prismatic joints in front of a wall.
//!
//! It uses no simulator, like the driver of a real arm. `cargo run --example own_backend` explores
//! the wall and prints the accuracy of the belief.

use nalgebra::{Point3, Vector3};
use palpate_explore::backend::{
    Backend, Capabilities, Command, Fault, IdealContact, Reading, Sample,
};
use palpate_explore::belief::{Belief, HeightField};
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::planner::PlanningSettings;
use palpate_explore::planner::{self, Offer};
use palpate_explore::probe::Probe;
use palpate_explore::probe::servo::Servo;
use palpate_explore::robot::arm::Chain;
use palpate_explore::robot::arm::stage::stage;
use palpate_explore::robot::{Finger, Robot};
use palpate_explore::task::touch::TouchSettings;
use palpate_explore::task::{Task, Zone};
use palpate_gp::math::seed;

/// Height of an inclined wall: y = 0.1·x + 0.2·z.
fn wall_y_m(x_m: f64, z_m: f64) -> f64 {
    0.1 * x_m + 0.2 * z_m
}

/// Contact stiffness of the wall against the fingertip.
const STIFFNESS_N_M: f64 = 2000.0;

/// A stage that follows its commands exactly and carries a ball that senses the wall.
pub struct Slides {
    chain: Chain,
    radius_m: f64,
    capabilities: Capabilities,
    reading: Reading,
}

impl Slides {
    /// Creates the stage at the home of `robot`, whose chain is a stage.
    pub fn new(robot: &Robot) -> Self {
        let chain = robot.chain.clone();
        let capabilities = Capabilities::simulated(&chain, 0.01);
        let (radius_m, reading) = (robot.finger.radius_m, Reading::default());
        Self { chain, radius_m, capabilities, reading }
    }

    /// Returns the contact of the ball centred at the stage's position.
    fn feel(&self) -> Option<IdealContact> {
        let &[x, y, z] = self.reading.q.as_slice() else { return None };
        // Unit normal of the wall, towards the finger.
        let normal_w = Vector3::new(-0.1, 1.0, -0.2).normalize();
        let gap_m = (y - wall_y_m(x, z)) * normal_w.y - self.radius_m;
        let x_wt = self.chain.forward(&self.chain.joints_from(&self.reading.q)?);
        let p_wc = Point3::new(x, y, z) - normal_w * (self.radius_m + gap_m);
        (gap_m < 0.0).then(|| IdealContact {
            p_tc: x_wt.inverse_transform_point(&p_wc),
            normal_t: x_wt.inverse_transform_vector(&normal_w),
            force_n: -gap_m * STIFFNESS_N_M,
        })
    }
}

impl Backend for Slides {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        self.reading = Reading { q: self.chain.start().into(), ..Reading::default() };
        self.reading.qdot = vec![0.0; self.reading.q.len()];
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let qdot = self.capabilities.accept(command)?;
        for (q, qdot) in self.reading.q.iter_mut().zip(qdot.iter()) {
            *q += qdot * self.capabilities.period_s;
        }
        self.reading.qdot.clone_from(&command.qdot);
        self.reading.applied.clone_from(command);
        self.reading.time_s += self.capabilities.period_s;
        self.reading.samples = self.feel().map(Sample::Ideal).into_iter().collect();
        Ok(&self.reading)
    }
}

/// Returns the task and the robot.
pub fn task_and_robot() -> Result<(Task, Robot), palpate_input::error::InputError> {
    let finger = Finger { length_m: 0.0, ..Finger::default() };
    let mut zone = Zone::new([-0.05, 0.05], Some([-0.05, 0.05]));
    // Depths run along the approach: the wall lies between y = 0.03 and y = −0.03.
    zone.depth_m = Some([-0.03, 0.03]);
    let task = Task::new(zone, TouchSettings::default(), &finger)?;
    let chain = stage(Point3::new(0.0, 0.08, 0.0), finger.r_at());
    Ok((task, Robot::new(chain, finger, false)))
}

/// Explores with `touches` touches; returns the belief and the largest error of a contact.
pub fn explore(touches: usize) -> Result<(HeightField, f64), Box<dyn std::error::Error>> {
    let (task, robot) = task_and_robot()?;
    let body = Slides::new(&robot);
    let mut servo = Servo::new(robot, task.touch().clone(), Box::new(body), 0)?;
    let zone = task.zone().ok_or("no zone")?;
    let mut belief = HeightField::new(zone.clone(), GpSettings::default());
    let active = planner::by_name("active").ok_or("no such planner")?;
    let random = seed::stream(1, 0, active.name);
    let mut planner = (active.make)(&PlanningSettings::default(), random);
    let mut worst_m: f64 = 0.0;
    for count in 0..touches {
        let target = match count {
            0 => zone.at(&[0.3, 0.6]).into(),
            _ => planner.plan(&Belief::from(belief.clone()), &Offer::default())?.target,
        };
        let approach = task.approach(&target).ok_or("not in the zone")?;
        let outcome = servo.touch(&approach)?;
        if let Some(contact) = outcome.contact() {
            let p_w = contact.p_wc;
            worst_m = worst_m.max((p_w.y - wall_y_m(p_w.x, p_w.z)).abs());
        }
        belief.observe(&target, &outcome);
        belief.refit()?;
    }
    Ok((belief, worst_m))
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (belief, worst_m) = explore(15)?;
    let surface = belief.surface().ok_or("no belief")?;
    let mut scratch = Default::default();
    println!("15 touches, largest distance of a contact from the wall {:.4} mm", 1e3 * worst_m);
    for place in [[-0.04, -0.04], [0.0, 0.0], [0.04, 0.02]] {
        let (mean_m, variance) =
            (surface.mean(&place, &mut scratch), surface.variance(&place, &mut scratch));
        let error_m = mean_m - wall_y_m(place[0], place[1]);
        println!("{place:?}: error {:.3} mm, sd {:.3} mm", 1e3 * error_m, 1e3 * variance.sqrt());
    }
    Ok(())
}
