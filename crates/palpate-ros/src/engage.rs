//! Start and end of control over an arm: no other program commands it, its controller accepts
//! commands, and its frames are those of the model.

use super::arm::{POLL_INTERVAL, RosArm};
use super::controllers::{Controller, Switch, switch_to};
use super::receiver::LatestMessages;
use super::service::Service;
use super::status::ArmStatus;
use super::topics::Topic;
use nalgebra::{Isometry3, Point3};
use palpate_explore::backend::LinkFault;
use palpate_input::error::InputError;
use std::sync::{MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time after which all participants of a DDS network know each other.
// heuristic: four times the 0.4 s that a second explorer needed on a local network.
const DISCOVERY: Duration = Duration::from_secs(2);

/// Time from the creation of the publisher of commands until its subscribers know it.
// heuristic: several exchanges of endpoint discovery on a local network.
const MATCHING: Duration = Duration::from_millis(300);

/// Time for the question whether the controller is still active.
const ASK_S: f64 = 0.3;

impl RosArm {
    /// Makes the arm accept commands. Another program that commands it stays undisturbed: it does
    /// not see this one before.
    ///
    /// # Errors
    /// If another program commands the arm, nothing receives commands, or a service is refused.
    pub(super) fn engage(&self) -> Result<(), LinkFault> {
        let is_first = !self.mailbox.latest().is_engaged;
        if is_first && self.settings().is_networked {
            sleep(DISCOVERY.saturating_sub(self.opened.elapsed()));
        }
        self.check_sole(&self.mailbox.latest())?;
        self.check_program()?;
        let hand_back = match self.settings().driver().modes {
            None => {
                self.wait_for_subscriber()?;
                self.open_commands();
                self.mailbox.latest().is_engaged = true;
                self.call(&Service::Unhold)?;
                Some(Service::Hold)
            }
            Some(_) => {
                let switched = self.switch()?;
                self.open_commands();
                self.mailbox.latest().is_engaged = true;
                switched.map(|switch| Service::SwitchController(switch.reversed()))
            }
        };
        // A later call finds the controller active; the arm is handed back as it was at first.
        if let Some(service) = hand_back {
            self.hand_back().get_or_insert(service);
        }
        Ok(())
    }

    /// Creates the publisher of commands, and waits until its subscribers know it.
    fn open_commands(&self) {
        let is_new = self.link.publisher_count(Topic::Command) == 0;
        self.link.open_commands();
        if is_new && self.settings().is_networked {
            sleep(MATCHING);
        }
    }

    /// Activates the controller that takes the commands; returns the switch, unless it was active.
    fn switch(&self) -> Result<Option<Switch>, LinkFault> {
        let settings = self.settings();
        let all = self.call(&Service::ListControllers)?.controllers;
        let names = self.mailbox.names.names();
        let switch = switch_to(&settings.controller(), &all, names, &settings.modes())?;
        self.wait_for_subscriber()?;
        if let Some(switch) = &switch {
            self.call(&Service::SwitchController(switch.clone()))?;
        }
        Ok(switch)
    }

    pub(super) fn hand_back(&self) -> MutexGuard<'_, Option<Service>> {
        self.hand_back.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks that no other program commands the arm.
    pub(super) fn check_sole(&self, heard: &LatestMessages) -> Result<(), LinkFault> {
        let topics = &self.settings().topics;
        let count = self.link.publisher_count(Topic::Command);
        // This program's own publisher exists while it is engaged.
        if count > usize::from(heard.is_engaged) {
            let (topic, own) =
                (topics.name(Topic::Command), if heard.is_engaged { "one" } else { "none" });
            let publishers = palpate_input::format::counted(count as u64, "publisher");
            return Err(InputError::new(format!(
                "{publishers} on {topic}; allowed is {own}: another program commands the arm"
            ))
            .into());
        }
        if heard.goals.is_active() {
            return Err(InputError::new(format!(
                "another program's goal is pursued ({}); cancel it or wait for its end",
                topics.name(Topic::Goals)
            ))
            .into());
        }
        Ok(())
    }

    /// Checks that a robot with a program runs it: its controllers stop and start with the program,
    /// and a switch before would be undone.
    fn check_program(&self) -> Result<(), LinkFault> {
        let heard = self.mailbox.latest();
        let refusal = heard.status.as_ref().and_then(ArmStatus::refusal);
        match refusal.filter(|_| self.settings().driver().modes.is_some()) {
            Some(words) => Err(LinkFault::Arm(words)),
            None => Ok(()),
        }
    }

    /// Waits until something subscribes to the commands.
    fn wait_for_subscriber(&self) -> Result<(), LinkFault> {
        let (begun, timeout_s) = (Instant::now(), self.settings().connect_timeout_s);
        while self.link.subscriber_count() == 0 {
            if begun.elapsed().as_secs_f64() > timeout_s {
                let topics = &self.settings().topics;
                return Err(InputError::new(format!(
                    "nothing subscribes to {} ({}); check that the driver's controller of this name is \
                     loaded, and {}",
                    topics.name(Topic::Command),
                    topics.type_name(Topic::Command),
                    self.settings().key("topics.command")
                ))
                .into());
            }
            sleep(POLL_INTERVAL);
        }
        Ok(())
    }

    /// Returns the fault of a driver that has stopped, if its controllers show that.
    pub(super) fn ended_driver(&self) -> Option<LinkFault> {
        self.settings().driver().lifeline?;
        let all = self.call_within(&Service::ListControllers, ASK_S).ok()?.controllers;
        self.ended_among(&all)
    }

    fn ended_among(&self, all: &[Controller]) -> Option<LinkFault> {
        let (name, words) = self.settings().driver().lifeline?;
        let is_off = all.iter().any(|one| one.name == name && !one.is_active());
        is_off.then(|| LinkFault::Arm(words.into()))
    }

    /// Returns the fault of a controller that another program switched off.
    pub(super) fn lost_controller(&self) -> Option<LinkFault> {
        self.settings().driver().modes?;
        let all = self.call_within(&Service::ListControllers, ASK_S).ok()?.controllers;
        if let Some(fault) = self.ended_among(&all) {
            return Some(fault);
        }
        let own = self.settings().controller();
        if all.iter().any(|one| one.name == own && one.is_active()) {
            return None;
        }
        // The arm is not handed back: it belongs to the other program.
        *self.hand_back() = None;
        let groups = [self.mailbox.names.names(), &self.settings().modes()].concat();
        let holds = all.iter().filter(|one| one.holds(&groups));
        let holders: Vec<&str> = holds.map(|one| one.name.as_str()).collect();
        let by = match holders.as_slice() {
            [] => "no other holds the arm".into(),
            names => format!("the arm is held by {}", names.join(", ")),
        };
        Some(
            InputError::new(format!(
                "controller {own} is not active any more: another program switched it off; {by}"
            ))
            .into(),
        )
    }

    /// Returns the pose of `T` in the force/torque sensor's frame, inverted: that of the sensor in
    /// `T`.
    pub(super) fn sensor_in_tip(&self) -> Isometry3<f64> {
        let sensor = *self.sensor.lock().unwrap_or_else(PoisonError::into_inner);
        self.chain.tool.inverse() * sensor.unwrap_or_default()
    }

    /// Compares the frames of the driver with those of the model, and finds the frame of the
    /// force/torque sensor. The arm is at rest, and the fingertips may differ by `allowed_m`.
    ///
    /// # Errors
    /// If the fingertip would be elsewhere by the driver's model of the robot, or a frame is
    /// missing.
    pub(super) fn check_model(&self, allowed_m: f64) -> Result<(), LinkFault> {
        let Some(flange) = self.settings().flange_frame() else { return Ok(()) };
        let base = self.settings().base_frame();
        let heard = self.mailbox.latest();
        let Some(q) = self.chain.joints_from(&heard.q) else { return Ok(()) };
        let (own, tool) = (self.chain.flange_at(&q), self.chain.tool);
        let Some(other) = heard.frames.pose(&flange, &base) else {
            return Err(InputError::new(format!(
                "no frames {base} and {flange} on /tf; check that robot_state_publisher runs, and \
                 backend.ros2.prefix and backend.ros2.base_frame"
            ))
            .into());
        };
        let tip = |flange: &Isometry3<f64>| flange * tool * Point3::origin();
        let off_m = (tip(&own) - tip(&other)).norm();
        if off_m > allowed_m {
            return Err(InputError::new(format!(
                "by the driver's frames the fingertip is {:.1} mm from where the arm's model has it; \
                 allowed are {:.1} mm: the robot's own calibration is missing",
                1e3 * off_m, 1e3 * allowed_m
            ))
            .remedy(
                "save the robot's model by `palpate doctor --arm EXPERIMENT --save robot.urdf`, and set \
                 scene.arm.calibration = \"robot.urdf\"",
            )
            .into());
        }
        let frame = &heard.wrench_frame;
        let sensor = match frame.is_empty() || *frame == flange || self.settings().dry {
            true => Isometry3::identity(),
            false => {
                own.inverse()
                    * heard.frames.pose(frame, &base).ok_or_else(|| {
                        InputError::new(format!(
                            "the wrench on {} is in the frame \"{frame}\", which /tf does not have",
                            self.settings().topics.name(Topic::Wrench)
                        ))
                    })?
            }
        };
        drop(heard);
        *self.sensor.lock().unwrap_or_else(PoisonError::into_inner) = Some(sensor);
        Ok(())
    }
}
