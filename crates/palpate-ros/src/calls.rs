//! Calls of the arm's services at the stages of a run.

use super::profile::{Profile, UR_CONTROLLERS};
use super::settings::BackendSettings;
use super::topics::{CommandMessage, Service, Switch, Topic};

impl BackendSettings {
    /// Returns the name of the controller of `ros2_control` that takes the commands: the part of
    /// their topic before the last.
    pub fn controller(&self) -> String {
        let name = self.topics.name(Topic::Command);
        name.rsplit('/').nth(1).unwrap_or_default().to_owned()
    }

    /// Returns the calls of which the first that is granted makes the arm accept commands.
    pub fn engage(&self) -> Vec<Service> {
        match self.profile {
            Profile::Palpate => vec![Service::Unhold],
            // The first is granted only if the controller was inactive, and no other moves the arm.
            Profile::Ur => vec![self.switch(true, false, true), self.switch(true, true, false)],
        }
    }

    /// Returns the call after which the arm is as it was before the call number `granted` of
    /// [`engage`](Self::engage), if one is needed.
    pub fn hand_back(&self, granted: usize) -> Option<Service> {
        match self.profile {
            Profile::Palpate => Some(Service::Hold),
            Profile::Ur if granted == 0 => Some(self.switch(false, false, false)),
            // The controller of trajectories remains active, at rest, as after the driver's start.
            Profile::Ur if self.topics.command.message == CommandMessage::Trajectory => None,
            Profile::Ur => Some(Service::SwitchController(Switch {
                activate: vec![UR_CONTROLLERS[0].into()],
                deactivate: vec![self.controller()],
                is_strict: false,
            })),
        }
    }

    /// Returns the call that stops the arm when its readings are unreliable.
    pub fn stop(&self) -> Service {
        match self.profile {
            Profile::Palpate => Service::Stop,
            // Without an active controller the robot stops itself.
            Profile::Ur => self.switch(false, false, false),
        }
    }

    /// Returns the call that clears faults on the arm; those of a UR are cleared on its pendant.
    pub fn clear_fault(&self) -> Option<Service> {
        (self.profile == Profile::Palpate).then_some(Service::ClearFault)
    }

    /// Returns the call that sets the zero of the force/torque sensor before the start checks.
    pub fn zero_wrench(&self) -> Option<Service> {
        (self.profile == Profile::Ur).then_some(Service::ZeroFtSensor)
    }

    /// Returns the switch that activates or deactivates the controller; `alone` also deactivates
    /// the others.
    fn switch(&self, is_active: bool, alone: bool, is_strict: bool) -> Service {
        let own = self.controller();
        let others = UR_CONTROLLERS.into_iter().filter(|other| alone && *other != own);
        let others: Vec<String> = others.map(String::from).collect();
        Service::SwitchController(match is_active {
            true => Switch { activate: vec![own], deactivate: others, is_strict },
            false => Switch { activate: Vec::new(), deactivate: vec![own], is_strict },
        })
    }
}
