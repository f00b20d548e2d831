//! Active touch for a robot, real or simulated: belief, planners, and a servo that makes touches.
//!
//! A [`Belief`](belief::Belief) observes the [`Outcome`](evidence::Outcome) of each action; a
//! [`Planner`](planner::Planner) selects the next target from it; a [`Probe`](probe::Probe)
//! executes the [`Action`](task::Action) and returns its outcome. A
//! [`Servo`](probe::servo::Servo) is the probe of a robot: it commands any
//! [`Backend`](backend::Backend), a real or simulated robot, through its interlocks. This crate
//! does not depend on a simulator, so no code in it has access to the object.
//!
//! | module | content |
//! |---|---|
//! | [`task`] | the region, targets in it, and the approach to each |
//! | [`robot`] | the arm from a model file, the finger, its sensors |
//! | [`backend`] | the trait `Backend`, faults, interlocks |
//! | [`belief`], [`whole_object`] | beliefs of a height field and of a whole object |
//! | [`band`] | the two-sided 95 % band of the heights |
//! | [`surface_evidence`] | probability of a surface from contacts and misses |
//! | [`evidence`] | what an action has shown: points, free space, a seen surface |
//! | [`planner`] | planners, one list for both |
//! | [`probe`], [`control`] | a touch, and the motion of the arm |
//! | [`view`] | what a depth camera has seen, and the error of its pose |
//! | [`registration`] | the pose of finger and object, found by touch |
//!
//! ```
//! use nalgebra::Vector3;
//! use palpate_explore::belief::{Belief, HeightField};
//! use palpate_explore::evidence::{Contact, Outcome};
//! use palpate_explore::gp_settings::GpSettings;
//! use palpate_explore::planner::{self, Offer, PlanningSettings};
//! use palpate_explore::task::{Region, Zone};
//! use palpate_gp::math::seed;
//!
//! // An interval of x, 20 cm wide; the surface there is y = 0.1·x².
//! let zone = Zone::new([-0.1, 0.1], None);
//! let mut heights = HeightField::new(zone.clone(), GpSettings::default());
//! let touch_at = |x_m: f64| {
//!     let p_wc = zone.point(&[x_m], 0.1 * x_m * x_m);
//!     Outcome::from(Contact::new(p_wc, Vector3::y()))
//! };
//! for x_m in [-0.09, -0.02, 0.05] {
//!     heights.observe(&[x_m].into(), &touch_at(x_m));
//! }
//! heights.refit()?;
//!
//! let active = planner::by_name("active").expect("it is there");
//! let random = seed::stream(1, 0, "planner");
//! let mut planner = (active.make)(&PlanningSettings::default(), random);
//! let plan = planner.plan(&Belief::from(heights), &Offer::default())?;
//! assert!(Region::from(zone).contains(&plan.target));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod backend;
pub mod band;
pub mod belief;
mod contact;
pub mod control;
pub mod episode;
pub mod evidence;
mod free_space;
pub mod gp_settings;
pub mod planner;
pub mod probe;
pub mod recognition;
pub mod registration;
pub mod robot;
mod surface_belief;
pub mod surface_evidence;
pub mod task;
pub mod view;
pub mod whole_object;
