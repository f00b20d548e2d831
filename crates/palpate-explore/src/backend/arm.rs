//! Real arms: the settings that connect to an arm, and the connected arm.

use super::interlock::StartCheckSettings;
use super::{Backend, Fault, LinkFault};
use crate::robot::arm::{ArmSettings, Chain};
use crate::robot::sensor::SensorSettings;
use nalgebra::{Isometry3, Point3};
use palpate_input::config::{Loader, Validate};
use palpate_input::error::InputError;
use std::any::Any;
use std::sync::Arc;

/// Settings of a kind of arm: a table of `[backend]`, whose presence selects the arm.
pub trait Connector: Validate {
    /// Changes the settings in `loader` before they are read: fills in the defaults of the arm's
    /// driver in the table with the dotted key `table`.
    fn prepare(_loader: &mut Loader, _table: &str)
    where
        Self: Sized,
    {
    }

    /// Sets omitted values from the model of the arm.
    fn complete(&mut self, _arm: Option<&ArmSettings>) {}

    /// Connects to the arm of `chain`. In a rehearsal nothing is touched, so joint states are
    /// enough.
    ///
    /// # Errors
    /// If it cannot be reached, or this build lacks the connection.
    fn connect(&self, chain: &Chain, is_rehearsal: bool) -> Result<Arc<dyn Arm>, LinkFault>;

    /// Checks that the connection has the samples of a sensor.
    ///
    /// # Errors
    /// If it has other ones, with those that fit.
    fn check_sensor(&self, _sensor: &SensorSettings) -> Result<(), InputError> {
        Ok(())
    }

    /// Returns the configured names of the joints in messages, from the base on; empty for those
    /// of the model.
    fn joints(&self) -> &[String] {
        &[]
    }

    /// Returns the frame of the robot's base in messages.
    fn base_frame(&self) -> String {
        BASE_FRAME.into()
    }
}

/// Usual frame of a robot's base (REP 105).
pub const BASE_FRAME: &str = "base_link";

/// A connected arm.
pub trait Arm: Any + Send + Sync {
    /// Returns a backend on this arm; use one at a time.
    fn backend(self: Arc<Self>) -> Box<dyn Backend>;

    /// Checks arm and sensors at rest.
    ///
    /// # Errors
    /// The first check that fails.
    fn check_start(self: Arc<Self>, settings: &StartCheckSettings) -> Result<(), Fault>;

    /// Clears the faults latched here and on the arm; only an operator may request it.
    ///
    /// # Errors
    /// If the arm refuses.
    fn clear_fault(&self) -> Result<(), LinkFault>;

    /// Publishes solids that other programs' arms avoid, in place of those of the same names; by
    /// default nothing is published.
    fn show_solids(&self, _solids: &dyn Fn() -> Vec<KeepOutSolid>) {}

    /// Publishes the pose of a recognised object's mesh in `W`; by default nothing is published.
    fn show_object(&self, _x_wm: &Isometry3<f64>) {}
}

/// A closed surface whose inside arms of other programs avoid.
#[derive(Clone, Debug, PartialEq)]
pub struct KeepOutSolid {
    /// Name.
    pub id: &'static str,
    /// Vertices in `W`, m.
    pub vertices_w: Vec<Point3<f64>>,
    /// Triangles, with corners counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}
