//! A driver for Palpate, as in the guide "Your robot".

use super::driver::Driver;
use crate::service::Service;
use crate::topics::Topic;

pub(super) static DRIVER: Driver = Driver {
    topics: &[Topic::Joints, Topic::Wrench, Topic::Tactile, Topic::Status],
    further: &[],
    services: &Service::COMMON,
    defaults: |_, _| Vec::new(),
    base_frame: "base_link",
    flange_frame: None,
    modes: None,
    zero_wrench: None,
    clear_fault: Some(Service::ClearFault),
    estimated_wrench: None,
    lifeline: None,
    silence: None,
};
