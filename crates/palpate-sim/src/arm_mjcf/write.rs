//! MJCF of an arm from its model: masses, friction, velocity servos.

use palpate_explore::robot::arm::chain::JOINTS_APART;
use palpate_explore::robot::arm::model::{BASE, CapsuleModel, JointModel};
use palpate_explore::robot::arm::{ArmModel, JointType};
use std::fmt::{Display, Write};

/// Gain of a joint's velocity servo over its rotor's inertia, 1/s; a heuristic: the largest for
/// which a step of 2 ms, explicit in the velocity, would be stable. The inertia that a servo feels
/// is that of the rotor or more.
const GAIN_PER_S: f64 = 1000.0;

/// Returns the arm upright at q = 0, with a place for the tool; `None` if a joint has no dynamics.
pub fn arm(model: &ArmModel) -> Option<String> {
    let mut bodies = capsules(model, BASE);
    let mut motors = String::new();
    for (joint, chain) in model.joint.iter().zip(model.joints()) {
        let dynamics = joint.dynamics()?;
        let (name, [low, high]) = (joint.name(), chain.q_limits);
        let kind = match chain.kind {
            JointType::Revolute => "hinge",
            JointType::Prismatic => "slide",
        };
        let limit = dynamics.effort_limit;
        // Writing to a string cannot fail.
        let _ = write!(
            bodies,
            r#"<body name="{name}" pos="{origin}">
<joint name="{name}" type="{kind}" axis="{axis}" range="{low} {high}" armature="{}" damping="{}" frictionloss="{}"/>
<inertial pos="{}" mass="{}" fullinertia="{}"/>
{}"#,
            dynamics.armature,
            dynamics.damping,
            dynamics.friction,
            list(dynamics.centre_m),
            dynamics.mass_kg,
            list(dynamics.inertia_kg_m2),
            capsules(model, name),
            origin = list(chain.origin_m.iter()),
            axis = list(chain.axis.iter()),
        );
        let _ = writeln!(
            motors,
            r#"<velocity name="{name}" joint="{name}" kv="{}" forcerange="-{limit} {limit}"/>"#,
            GAIN_PER_S * dynamics.armature
        );
    }
    let names: Vec<&str> =
        [BASE].into_iter().chain(model.joint.iter().map(JointModel::name)).collect();
    let close = (0..names.len()).flat_map(|i| (i + 1..names.len()).map(move |j| (i, j)));
    let excluded: String = close
        .filter(|(i, j)| j - i < JOINTS_APART)
        .map(|(i, j)| format!(r#"<exclude body1="{}" body2="{}"/>"#, names[i], names[j]))
        .collect();
    let ends = "</body>".repeat(model.joint.len());
    Some(format!(
        r#"<mujoco model="arm">
<compiler angle="radian"/>
<default><geom contype="0" conaffinity="0" group="1" rgba=".86 .86 .84 1"/></default>
<worldbody><body name="base">{bodies}<!-- tool -->{ends}</body></worldbody>
<actuator>{motors}</actuator>
<contact>{excluded}</contact>
</mujoco>"#
    ))
}

/// Returns the capsules of a link.
fn capsules(model: &ArmModel, link: &str) -> String {
    let of_link = model.capsule.iter().filter(|capsule| capsule.link == link);
    let geom = |CapsuleModel { from_m, to_m, radius_m, .. }: &CapsuleModel| {
        let is_ball = from_m.iter().zip(to_m).all(|(from, to)| (from - to).abs() < 1e-6);
        match is_ball {
            true => format!(r#"<geom type="sphere" pos="{}" size="{radius_m}"/>"#, list(from_m)),
            false => {
                let ends = list(from_m.iter().chain(to_m));
                format!(r#"<geom type="capsule" fromto="{ends}" size="{radius_m}"/>"#)
            }
        }
    };
    of_link.map(geom).collect()
}

/// Returns the numbers separated by spaces.
pub(crate) fn list<T: Display>(numbers: impl IntoIterator<Item = T>) -> String {
    let texts: Vec<String> = numbers.into_iter().map(|number| number.to_string()).collect();
    texts.join(" ")
}
