//! Connection to an arm, over ROS or by the Franka Control Interface.

use palpate_explore::backend::{Backend, Fault, LinkFault};
use palpate_explore::robot::arm::Chain;
#[cfg(feature = "franka")]
use palpate_franka::FrankaArm;
#[cfg(not(feature = "franka"))]
use palpate_input::error::InputError;
use palpate_ros::arm::RosArm;
use palpate_ros::settings::{BackendKind, BackendSettings};
use std::sync::Arc;

/// A connected arm.
#[derive(Clone)]
pub enum RealArm {
    /// Behind ROS topics.
    Ros(Arc<RosArm>),
    /// By the Franka Control Interface, with the table `[backend]`.
    #[cfg(feature = "franka")]
    Franka(Arc<FrankaArm>, Box<BackendSettings>),
}

impl RealArm {
    /// Connects to the arm of `chain`.
    ///
    /// # Errors
    /// If it cannot be reached, or this build lacks the kind of connection.
    pub fn connect(settings: &BackendSettings, chain: &Chain) -> Result<Self, LinkFault> {
        if settings.kind != BackendKind::Franka {
            return RosArm::connect_over(settings, chain).map(Self::Ros);
        }
        #[cfg(feature = "franka")]
        {
            let address = settings.address.as_deref().unwrap_or_default();
            let arm = FrankaArm::connect(address, settings.realtime, chain)?;
            Ok(Self::Franka(arm, Box::new(settings.clone())))
        }
        #[cfg(not(feature = "franka"))]
        Err(InputError::new("kind = \"franka\" needs a build with the feature `franka`")
            .remedy("cargo build --release --features franka")
            .into())
    }

    /// Returns a backend on this arm; use one at a time.
    pub fn backend(&self) -> Box<dyn Backend> {
        match self {
            Self::Ros(arm) => Box::new(arm.backend()),
            #[cfg(feature = "franka")]
            Self::Franka(arm, _) => Box::new(arm.backend()),
        }
    }

    /// Checks arm and sensors at rest.
    ///
    /// # Errors
    /// The first check that fails.
    pub fn check_start(&self) -> Result<(), Fault> {
        match self {
            Self::Ros(arm) => arm.check_start(),
            #[cfg(feature = "franka")]
            Self::Franka(arm, settings) => arm.check_start(&settings.start_checks),
        }
    }

    /// Clears the faults latched here and on the arm; only an operator may request it.
    ///
    /// # Errors
    /// If the arm refuses.
    pub fn clear_fault(&self) -> Result<(), LinkFault> {
        match self {
            Self::Ros(arm) => arm.clear_fault(),
            #[cfg(feature = "franka")]
            Self::Franka(arm, _) => arm.clear_fault(),
        }
    }

    /// Returns the arm behind ROS topics, if it is one.
    pub fn ros(&self) -> Option<&RosArm> {
        match self {
            Self::Ros(arm) => Some(arm),
            #[cfg(feature = "franka")]
            Self::Franka(..) => None,
        }
    }
}
