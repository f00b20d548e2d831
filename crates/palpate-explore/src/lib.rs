//! What the robot does, on the bench as in simulation: touch, believe, plan.
//!
//! A [`Belief`](belief::Belief) takes in touches and is asked by a [`Planner`](planner::Planner)
//! where it is unsure; a [`Probe`](probe::Probe) goes the way of an approach. Nothing here knows
//! where the object is.
//!
//! ```
//! use nalgebra::Vector3;
//! use palpate_explore::belief::{Belief, HeightField};
//! use palpate_explore::gp_settings::GpSettings;
//! use palpate_explore::planner::{self, PlanningSettings};
//! use palpate_explore::probe::{Contact, Touch};
//! use palpate_gp::math::seed;
//! use palpate_explore::task::{Region, Zone};
//!
//! // An interval of x, 20 cm wide; the surface there is y = 0.1·x².
//! let zone = Zone::new([-0.1, 0.1], None);
//! let mut heights = HeightField::new(zone.clone(), GpSettings::default());
//! let touch_at = |x_m: f64| {
//!     let p_wc = zone.point(&[x_m], 0.1 * x_m * x_m);
//!     Touch::Contact(Contact { p_wc, normal_w: Vector3::y() })
//! };
//! for x_m in [-0.09, -0.02, 0.05] {
//!     heights.observe(&[x_m], &touch_at(x_m));
//! }
//! heights.refit()?;
//!
//! let active = planner::by_name("active").expect("it is there");
//! let random = seed::stream(1, 0, "planner");
//! let mut planner = (active.make)(&PlanningSettings::default(), random);
//! let plan = planner.plan(&Belief::from(heights))?;
//! assert!(Region::from(zone).contains(&plan.target));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod around;
pub mod backend;
pub mod belief;
pub mod control;
mod free_space;
pub mod gp_settings;
pub mod planner;
pub mod presence;
pub mod probe;
pub mod registration;
pub mod robot;
pub mod task;
