//! Custom fingertip sensor: a switch, which detects contact but not its location.
//!
//! `cargo run --release --example own_sensor`

use nalgebra::Vector3;
use palpate::backend::{Sample, Wrench};
use palpate::explore::probe::{Probe, servo::Servo};
use palpate::robot::Finger;
use palpate::robot::sensor::{Doubt, SensedContact, Sensor};
use palpate::sim::{Environment, Scene, simulator::Simulator};

/// Switch that closes at 0.5 N above the force at rest, and reports the foremost point of the tip
/// as the point of contact. A switch with its own driver would read [`Sample::Channels`].
#[derive(Default)]
pub struct Switch {
    force_n: Option<Vector3<f64>>,
    rest_n: Option<Vector3<f64>>,
}

impl Sensor for Switch {
    fn push(&mut self, _: f64, _: &[Sample], wrench: Option<&Wrench>) {
        self.force_n = wrench.map(|wrench| wrench.force_n);
    }
    fn clear_samples(&mut self) {}
    fn tare(&mut self) {
        self.rest_n = self.force_n;
    }
    fn is_present(&self) -> bool {
        self.rest_n.is_some()
    }
    fn is_touching(&self) -> Option<bool> {
        Some((self.force_n? - self.rest_n?).norm() > 0.5)
    }
    fn locate(&self, finger: &Finger, _moved_m: f64) -> Result<SensedContact, Doubt> {
        let ahead_t = finger.direction_t();
        Ok(SensedContact::new((ahead_t * finger.radius_m).into(), -ahead_t))
    }
}

/// Returns the true height of the container's middle above a contact there, m.
pub fn touch() -> Result<f64, Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/container_finger.toml");
    let scene = Scene::load(path.as_ref(), &["effects={skin={}, fluid={}, wrench={}}".into()])?;
    let simulator = Simulator::new(Environment::build(scene)?.into())?;
    let (world, place) = (simulator.environment(), [0.0, 0.5]);
    let (body, robot) = simulator.body()?.zip(world.robot()).ok_or("no body")?;
    let (task, zone) = (world.task(), world.task().zone().ok_or("no zone")?);
    let mut servo =
        Servo::new(robot, task.touch().clone(), body, 1)?.with_sensor(Box::new(Switch::default()));
    let outcome = servo.touch(&task.approach(&place.into()).ok_or("not in the zone")?)?;
    let contact = outcome.contact().ok_or("a miss")?;
    Ok(world.true_height_m(&place).ok_or("no surface")? - zone.height_m(&contact.p_wc))
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("contact {:.2} mm below the true surface", 1e3 * touch()?);
    Ok(())
}
