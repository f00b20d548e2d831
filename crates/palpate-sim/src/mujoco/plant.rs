//! Arm or stage with velocity servos, gravity and friction, one step at a time.

use super::joint_servo::{JointServo, embedded};
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::{MjModel, MjtIntegrator, MjtObjBase};
use nalgebra::{
    DMatrix, Isometry3, Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion,
    Vector3, Vector6,
};
use palpate_explore::backend::{Fault, IdealContact, Wrench};
use palpate_explore::robot::arm::Joints;
use palpate_explore::robot::arm::chain::MAX_JOINTS;
use palpate_input::error::InputError;
use std::sync::Arc;

/// Plant: a compiled model of [`mjcf::scene`](crate::mjcf::scene), shared, with one state of
/// it.
///
/// It does not model the skin: the caller gives the wrench on the fingertip.
pub struct Plant {
    data: MjData<Arc<MjModel>>,
    servo: JointServo,
    /// Inertia that the model adds to the joints in place of its servos' damping; `None` if the
    /// servos damp themselves.
    gain_kg_m2: Option<Joints>,
    /// Site of `T` and the body that has it.
    tip: usize,
    finger: usize,
    /// Pose of the sensor in `T`.
    x_tm: Isometry3<f64>,
    /// Whether a step evaluates the model at intermediate stages.
    staged: bool,
    contact: Option<IdealContact>,
}

impl Plant {
    /// Creates a state of `model` at q = 0; [`reset`](Self::reset) sets its start.
    ///
    /// # Errors
    /// If `model` is not one of a robot with a finger, or memory is short.
    pub fn new(model: Arc<MjModel>) -> Result<Self, Fault> {
        let part =
            |kind, name: &'static str| model.name_to_id(kind, name).ok_or(Fault::lacks(name));
        let tip = part(MjtObjBase::mjOBJ_SITE, "tip")?;
        let mount = part(MjtObjBase::mjOBJ_SITE, "mount")?;
        let finger = part(MjtObjBase::mjOBJ_BODY, "finger")?;
        let joints = model.nv() as usize;
        let driven = model.nq() as usize == joints && model.nu() as usize == joints;
        if !driven || joints > MAX_JOINTS {
            return Err(Fault::lacks("one servo for each of at most 8 joints"));
        }
        // Six numbers: the force, then the torque.
        if ![0, 6].contains(&model.nsensordata()) {
            return Err(Fault::lacks("a force and a torque sensor, or neither"));
        }
        let mut kv = Joints::zeros();
        let mut limit = Joints::zeros();
        let mut gain_kg_m2 = Some(Joints::zeros());
        let motors = model.actuator_gainprm().iter().zip(model.actuator_forcerange());
        for (i, (gain, range)) in motors.enumerate().take(joints) {
            kv[i] = gain[0];
            limit[i] = range[1];
            gain_kg_m2 = gain_kg_m2.zip(embedded(&model, i)).map(|(mut gains, gain)| {
                gains[i] = gain;
                gains
            });
        }
        let local = |site: usize| {
            let [x, y, z] = model.site_pos()[site];
            let [w, i, j, k] = model.site_quat()[site];
            Isometry3::from_parts(
                Translation3::new(x, y, z),
                UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k)),
            )
        };
        let x_tm = local(tip).inv_mul(&local(mount));
        let staged = model.opt().integrator == MjtIntegrator::mjINT_RK4 as i32;
        let data = MjData::try_new(Arc::clone(&model))
            .map_err(|_| InputError::new("no memory for the state of the body"))?;
        Ok(Self {
            data,
            servo: JointServo::new(kv, limit),
            gain_kg_m2,
            tip,
            finger,
            x_tm,
            staged,
            contact: None,
        })
    }

    /// Puts the arm at rest at `q` and time 0, with servos that hold its weight.
    ///
    /// # Errors
    /// [`Fault::Refused`] if `q` is not one finite number per joint.
    pub fn reset(&mut self, q: &[f64]) -> Result<(), Fault> {
        self.accept(q)?;
        self.data.reset();
        self.contact = None;
        self.data.qpos_mut().copy_from_slice(q);
        self.data.forward();
        self.servo.set_steady_state(self.data.qfrc_bias());
        self.check()
    }

    /// Brakes for the next step: the brakes hold the arm's weight and damp its motion like the
    /// servos without their integral. Their friction is not modelled.
    pub fn brake(&mut self) {
        self.servo.set_steady_state(self.data.qfrc_bias());
    }

    /// Advances by one time step with the velocities commanded to the servos (rad/s or m/s) and
    /// `wrench` on the fingertip, in `T` about its origin and constant during the step.
    ///
    /// # Errors
    /// [`Fault::Refused`] if a number is not finite or missing; [`Fault::Diverged`] with time, q
    /// and qdot if MuJoCo warns. The state is then invalid until the next reset.
    pub fn step(&mut self, qdot: &[f64], wrench: &Wrench) -> Result<(), Fault> {
        self.accept(qdot)?;
        let Wrench { force_n, torque_nm } = wrench;
        if !force_n.iter().chain(torque_nm.iter()).all(|value| value.is_finite()) {
            let values = force_n.iter().chain(torque_nm.iter()).copied().collect();
            return Err(Fault::Refused { values });
        }
        let step_s = self.step_s();
        for (i, &command) in qdot.iter().enumerate() {
            let (speed, force) = (self.data.qvel()[i], self.data.actuator_force()[i]);
            let control = self.servo.control(i, command, speed, force, step_s);
            let damped = if self.gain_kg_m2.is_some() { speed } else { 0.0 };
            self.data.ctrl_mut()[i] = control - damped;
        }
        // MuJoCo takes a wrench about the body's centre of mass. Only forces applied this way reach
        // the force/torque sensor.
        let x_wt = self.tip();
        let force_w = x_wt.rotation * force_n;
        let arm = x_wt.translation.vector - Vector3::from(self.data.xipos()[self.finger]);
        let torque_w = x_wt.rotation * torque_nm + arm.cross(&force_w);
        self.data.xfrc_applied_mut()[self.finger] =
            [force_w.x, force_w.y, force_w.z, torque_w.x, torque_w.y, torque_w.z];
        // This order gives positions and velocities after the step; `mj_step` would leave those
        // before it. `mj_step2` cannot do Runge–Kutta stages: it takes an Euler step instead.
        match self.staged {
            true => self.data.step(),
            false => self.data.step2(),
        }
        self.contact = contact(&self.data, self.finger, &x_wt);
        self.data.step1();
        self.check()
    }

    /// Returns the time step, s.
    pub fn step_s(&self) -> f64 {
        self.data.model_opt().timestep
    }

    /// Returns the time since the reset, s.
    pub fn time_s(&self) -> f64 {
        self.data.time()
    }

    /// Returns the joint positions, rad or m.
    pub fn q(&self) -> &[f64] {
        self.data.qpos()
    }

    /// Returns the joint velocities, rad/s or m/s.
    pub fn qdot(&self) -> &[f64] {
        self.data.qvel()
    }

    /// Returns the motor outputs during the last step, N·m or N.
    pub fn motor_efforts(&self) -> &[f64] {
        self.data.actuator_force()
    }

    /// Returns the force of MuJoCo's contacts on the finger during the last step, for a finger
    /// without skin.
    pub fn contact(&self) -> Option<IdealContact> {
        self.contact
    }

    /// Returns the pose of `T` in `W`.
    pub fn tip(&self) -> Isometry3<f64> {
        let p = Point3::from(self.data.site_xpos()[self.tip]);
        let r = Matrix3::from_row_slice(&self.data.site_xmat()[self.tip]);
        let r = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r));
        Isometry3::from_parts(p.into(), r)
    }

    /// Returns the velocity of `T`: linear (m/s) at its origin, then angular (rad/s), in `W`.
    pub fn tip_twist(&self) -> Vector6<f64> {
        let site = self.data.try_object_velocity(MjtObjBase::mjOBJ_SITE, self.tip, false);
        let [rx, ry, rz, x, y, z] = site.unwrap_or_default();
        Vector6::new(x, y, z, rx, ry, rz)
    }

    /// Returns the smallest effective mass of `T` against a push in the present posture, over all
    /// directions: one over the largest eigenvalue of `J M⁻¹ Jᵀ`.
    pub fn tip_mass_kg(&self) -> f64 {
        let n = self.q().len();
        let mut inertia = vec![0.0; n * n];
        let whole = self.data.full_m(&mut inertia).is_ok();
        for (i, gain) in self.gain_kg_m2.iter().flatten().enumerate().take(n) {
            inertia[i * n + i] -= gain;
        }
        let (linear, _) = self.data.jac_site(true, false, self.tip);
        let jacobian = DMatrix::from_row_slice(3, n, &linear);
        let solved = DMatrix::from_row_slice(n, n, &inertia).cholesky().filter(|_| whole);
        let mobility = solved.map(|inertia| &jacobian * inertia.solve(&jacobian.transpose()));
        mobility.map_or(0.0, |mobility| 1.0 / mobility.symmetric_eigenvalues().max())
    }

    /// Returns the reading of the force/torque sensor during the last step, transformed to `T`
    /// about its origin. It is the wrench on the fingertip plus the weight and inertia of adapter
    /// and finger. It is zero in a scene without the sensor.
    pub fn mount_wrench(&self) -> Wrench {
        let [fx, fy, fz, tx, ty, tz] = *self.data.sensordata() else { return Wrench::default() };
        // MuJoCo gives the force of the link on the finger; the sensor reads the opposite.
        let (force_n, torque_nm) = (-Vector3::new(fx, fy, fz), -Vector3::new(tx, ty, tz));
        Wrench { force_n, torque_nm }.moved(&self.x_tm)
    }

    fn accept(&self, values: &[f64]) -> Result<(), Fault> {
        let fits = values.len() == self.q().len() && values.iter().all(|value| value.is_finite());
        if fits { Ok(()) } else { Err(Fault::Refused { values: values.into() }) }
    }

    /// Checks for MuJoCo's warning of a state that is not finite or larger than 1e10.
    fn check(&self) -> Result<(), Fault> {
        if self.data.warning().iter().all(|warning| warning.number == 0) {
            return Ok(());
        }
        let state = self.q().iter().chain(self.qdot()).copied().collect();
        Err(Fault::Diverged { time_s: self.time_s(), state })
    }
}

/// Combines MuJoCo's contacts with the finger into one, in `T`: centre weighted by force, sum of
/// the forces and its direction; `None` without force. Contacts between links and other bodies are
/// left out.
///
/// It is valid while `data` has the forces of the last step; `finger` is the finger's body.
fn contact(
    data: &MjData<Arc<MjModel>>,
    finger: usize,
    x_wt: &Isometry3<f64>,
) -> Option<IdealContact> {
    let (mut moment, mut weight_n, mut sum_n) = (Vector3::zeros(), 0.0, Vector3::zeros());
    for (i, contact) in data.contact().iter().enumerate() {
        let force_n = data.try_contact_force(i).map_or(0.0, |[normal, ..]| normal);
        // The normal points from the first geom to the second, which are ordered by kind.
        let [x, y, z, ..] = contact.frame;
        let of = |geom: i32| data.model().geom_bodyid().get(geom as usize);
        let outward = match contact.geom.map(|geom| of(geom) == Some(&(finger as i32))) {
            [_, true] => 1.0,
            [true, false] => -1.0,
            [false, false] => continue,
        };
        moment += Vector3::from(contact.pos) * force_n;
        weight_n += force_n;
        sum_n += outward * force_n * Vector3::new(x, y, z);
    }
    let force_n = sum_n.norm();
    (weight_n > 0.0 && force_n > 0.0).then(|| IdealContact {
        p_tc: x_wt.inverse_transform_point(&Point3::from(moment / weight_n)),
        normal_t: x_wt.inverse_transform_vector(&(sum_n / force_n)),
        force_n,
    })
}
