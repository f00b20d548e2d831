//! Design of registration touches: the most informative touches of a known body.

use super::hand_eye::{
    HandEyeFit, PARAMETERS, RegistrationTouch, SENSING_PARAMETERS, parameters, undetermined,
};
use super::known_body::{CalibrationBody, FingerOutline};
use crate::backend::interlock::defaults;
use crate::backend::{Backend, Capabilities, Command, Fault, Reading};
use crate::control::posture;
use crate::probe::Probe;
use crate::probe::servo::{BEYOND_M, Servo};
use crate::robot::Robot;
use crate::robot::arm::{Chain, Clearance, JointSegment, JointType, Joints};
use crate::robot::finger::Finger;
use crate::robot::finger::frame::FRAME_S;
use crate::robot::sensor::GelPad;
use crate::task::Approach;
use crate::task::touch::TouchSettings;
use nalgebra::{
    DMatrix, Isometry3, Point3, Rotation3, SMatrix, Translation3, UnitQuaternion, UnitVector3,
    Vector3,
};
use palpate_gp::math::least_squares::{Problem, jacobian, predict_information};
use palpate_input::error::InputError;
use rand::Rng;
use rand::seq::SliceRandom;

/// Touches to make, in order, and their predicted information.
#[derive(Clone, Debug)]
pub struct RegistrationDesign {
    /// Approaches of the touches.
    pub approaches: Vec<Approach>,
    /// Predicted standard deviation of each parameter, in its own unit, from the expected scatter.
    pub sds: [f64; PARAMETERS],
    /// Parameters that these touches would not determine.
    pub undetermined: Vec<&'static str>,
    /// Condition number of the determined parameters.
    pub condition: f64,
}

/// Largest condition number of a design; a heuristic: the largest ratio between the effects of a
/// residual's error on two parameters, all in plausible units.
const CONDITION_MAX: f64 = 1000.0;

/// Search distance before and behind the expected place of the body; a heuristic: the plausible
/// error of finger and body.
const MARGIN_M: f64 = 0.012;

/// Free distance in front of the search region, so that the finger can move from one side of the
/// body to another; a heuristic.
const STANDOFF_M: f64 = 0.05;

/// Largest approach speed: 50 µm in the 10 ms between two frames; a heuristic.
const APPROACH_M_S: f64 = 0.005;

/// Number of frames averaged; a heuristic: a fifth of a single frame's noise.
const FRAMES: usize = 25;

/// Touched points of the finger: fraction of its radius before the origin of `T`, or of its length
/// behind it; and degrees around it from the pad. A heuristic: pad and tip, to the sides as far as
/// there is fluid under the skin.
const SITES: [f64; 6] = [0.8, 0.55, 0.2, -0.25, -0.6, -0.88];
const TURNS_DEG: [f64; 5] = [-65.0, -25.0, 0.0, 25.0, 65.0];

/// Touched places of a pad along each side, as fractions of it from the middle; a heuristic:
/// the rim stays free.
const PAD_SITES: [f64; 3] = [-0.2, 0.0, 0.2];

/// Expected indentation of a pad, part of it that a located point is above the deepest, and
/// distance of these points on a plate as a fraction of the pad's shorter side; heuristics.
const PAD_PRESSED_M: f64 = 0.5e-3;
const PAD_SHARE: f64 = 0.3;
const PAD_AROUND: f64 = 0.2;

/// Number of steps onto the body; heuristic: each leaves at most a tenth of the distance.
const STEPS: usize = 12;

/// Directions from which the body is touched: angles from its free side, and number on that circle;
/// a heuristic.
const SIDES: [(f64, usize); 3] = [(0.0, 1), (25.0, 6), (50.0, 8)];

/// Number of rotations of the finger about the contact normal; a heuristic.
const SPINS: usize = 12;

/// Largest number of candidate touches; a heuristic.
const CANDIDATES: usize = 600;

/// Number of touches per spare one, since the arm cannot make some of them; a heuristic.
const SPARE: usize = 2;

/// Allowed penetration of the body by a candidate away from its point of contact.
const INTO_M: f64 = 2e-4;

/// Mean travel of the finger from the pressure threshold until it is read: the frames that must
/// agree, half a frame for the first, and the press.
pub fn pressed_m(robot: &Robot, touch: &TouchSettings) -> f64 {
    if !robot.sensor.is_soft() {
        return 0.0;
    }
    let frames = f64::from(touch.detection.frames) - 0.5;
    touch.press_m + touch.approach_m_s * frames * FRAME_S
}

/// Returns the touch settings of a registration: slow and from afar, otherwise as in the task.
pub fn touch_settings(touch: &TouchSettings) -> TouchSettings {
    TouchSettings {
        approach_m_s: touch.approach_m_s.min(APPROACH_M_S),
        standoff_m: touch.standoff_m.max(STANDOFF_M),
        frames: touch.frames.max(FRAMES),
        ..touch.clone()
    }
}

/// A candidate touch.
struct Candidate {
    touch: RegistrationTouch,
    approach: Approach,
    rows: DMatrix<f64>,
}

impl Candidate {
    /// Returns the approach that ends at the surface of the body in its expected pose.
    fn expected(&self) -> Approach {
        let beyond_m = MARGIN_M + BEYOND_M;
        let back_w = self.approach.direction_w().scale(beyond_m);
        Approach { p_far_w: self.approach.p_far_w - back_w, ..self.approach }
    }
}

impl RegistrationDesign {
    /// Selects the `count` most informative touches of `body` that `robot` reaches, greedily by the
    /// volume of the parameters' ellipsoid (D-optimal design). Then they are simulated in the order
    /// of execution, and those that cannot follow their predecessor are replaced by others, as long
    /// as there are candidates.
    ///
    /// # Errors
    /// If the robot reaches too few, or they would determine too little.
    pub fn new(
        robot: &Robot,
        touch: &TouchSettings,
        body: &CalibrationBody,
        count: usize,
        rng: &mut impl Rng,
    ) -> Result<Self, InputError> {
        if !robot.chain.has_revolute() {
            return Err(unreachable(0, 0, count));
        }
        let outline = FingerOutline::new(robot);
        let free_w = free_side(robot, body);
        let mut all = candidates(&outline, robot, body, &free_w, rng);
        let tried = all.len();
        // Prior of plausible values; it keeps the first selections finite.
        let mut information = SMatrix::<f64, PARAMETERS, PARAMETERS>::identity();
        let mut chosen: Vec<Candidate> = Vec::new();
        loop {
            while chosen.len() < count + count / SPARE && !all.is_empty() {
                let Some(covariance) = information.try_inverse() else { break };
                let results = |candidate: &Candidate| {
                    let rows = &candidate.rows;
                    let inner = DMatrix::identity(rows.nrows(), rows.nrows())
                        + rows * covariance * rows.transpose();
                    inner.determinant()
                };
                let values: Vec<f64> = all.iter().map(results).collect();
                let best = (0..all.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]));
                let candidate = all.swap_remove(best.unwrap_or_default());
                if is_reached(robot, &candidate.approach) {
                    information += candidate.rows.transpose() * &candidate.rows;
                    chosen.push(candidate);
                }
            }
            let simulated = chosen.len();
            chosen = in_order(robot, chosen);
            let ways: Vec<Approach> = chosen.iter().map(Candidate::expected).collect();
            let made = simulate_touches(robot, &touch_settings(touch), &ways)
                .map_err(|fault| InputError::new(fault.to_string()))?;
            chosen = (chosen.into_iter().enumerate())
                .filter_map(|(i, candidate)| made.contains(&i).then_some(candidate))
                .collect();
            if chosen.len() >= count {
                break;
            }
            // Without further candidates, another round would give the same touches.
            if all.is_empty() || simulated == chosen.len() {
                return Err(unreachable(chosen.len(), tried, count));
            }
            information = SMatrix::identity();
            for candidate in &chosen {
                information += candidate.rows.transpose() * &candidate.rows;
            }
        }
        chosen.truncate(count);
        let touches: Vec<_> = chosen.iter().map(|candidate| candidate.touch.clone()).collect();
        let fit = HandEyeFit::new(&outline, &touches);
        let foreseen = predict_information(&fit, &HandEyeFit::start(*body))
            .map_err(|error| InputError::new(error.to_string()))?;
        let named = parameters(body);
        let sds = std::array::from_fn(|i| foreseen.covariance[(i, i)].sqrt() * named[i].1);
        let lost = undetermined(&foreseen, body);
        Ok(Self {
            approaches: chosen.into_iter().map(|candidate| candidate.approach).collect(),
            sds,
            undetermined: lost,
            condition: foreseen.condition,
        })
    }

    /// Checks whether these touches are worth making.
    ///
    /// # Errors
    /// If they leave a parameter undetermined, or determine it poorly.
    pub fn check(&self) -> Result<(), InputError> {
        // Parameters of the sensing may remain undetermined; the poses must not.
        let sought = self.undetermined.iter().filter(|name| !SENSING_PARAMETERS.contains(name));
        let lost: Vec<&'static str> = sought.copied().collect();
        if !lost.is_empty() {
            let (touches, lost) = (self.approaches.len(), lost.join(", "));
            return Err(InputError::new(format!(
                "these {touches} touches would not determine {lost}"
            ))
            .remedy("increase --touches"));
        }
        match self.condition <= CONDITION_MAX {
            true => Ok(()),
            false => Err(InputError::new(format!(
                "the condition number of these touches is {:.0}; allowed is at most {CONDITION_MAX}",
                self.condition
            ))),
        }
    }
}

fn unreachable(reached: usize, tried: usize, wanted: usize) -> InputError {
    InputError::new(format!(
        "the robot reaches {reached} of {tried} touches of the body; required are {wanted}"
    ))
    .remedy(
        "a finger must be turned to find its pose, which a stage cannot do; move the body closer \
         (--at)",
    )
}

/// Returns the side from which the robot comes: from the body's centre to the fingertip at home; a
/// plate's normal.
fn free_side(robot: &Robot, body: &CalibrationBody) -> UnitVector3<f64> {
    match body {
        CalibrationBody::Plate { normal_w, .. } => *normal_w,
        CalibrationBody::Ball { centre_w, .. } => {
            let home_w = robot.chain.forward(&robot.chain.home).translation.vector;
            UnitVector3::try_new(home_w - centre_w.coords, 0.0).unwrap_or(Vector3::y_axis())
        }
    }
}

/// Returns touches at every site of the finger, from every side of the body, at every spin; a
/// subset if there are too many.
fn candidates(
    outline: &FingerOutline,
    robot: &Robot,
    body: &CalibrationBody,
    free_w: &UnitVector3<f64>,
    rng: &mut impl Rng,
) -> Vec<Candidate> {
    let sites = sites(outline);
    let mut all: Vec<(UnitVector3<f64>, &Site, f64)> = Vec::new();
    for side_w in sides(body, free_w) {
        for site in &sites {
            let spins = (0..SPINS).map(|i| std::f64::consts::TAU * i as f64 / SPINS as f64);
            all.extend(spins.map(|spin| (side_w, site, spin)));
        }
    }
    all.shuffle(rng);
    let made = all.into_iter().filter_map(|(side_w, site, spin)| {
        let x_wt = pose(body, &side_w, site, spin)?;
        let sensed_t = match outline.pad() {
            Some((pad, x_tp)) => pad_points(pad, x_tp, &site.p_t, body, &x_wt, &side_w),
            None => vec![site.p_t],
        };
        let touch = RegistrationTouch { x_wt, pressed_m: 0.0, sensed_t, load: None };
        let is_meant = outline.nearest(body, &x_wt).1 > -INTO_M;
        is_meant.then(|| {
            let only = std::slice::from_ref(&touch);
            let fit = HandEyeFit::new(outline, only);
            let state = HandEyeFit::start(*body);
            let (count, plausible) = (fit.residuals(&state).len(), fit.plausible_count());
            let rows = jacobian(&fit, &state, count).remove_rows(count - plausible, plausible);
            let approach = approach(&x_wt, &side_w, &robot.finger);
            Candidate { touch, approach, rows }
        })
    });
    made.take(CANDIDATES).collect()
}

/// Place of the finger that touches, and its outward normal.
struct Site {
    p_t: Point3<f64>,
    outward_t: UnitVector3<f64>,
}

/// Returns the places of the finger that touch, all over its outline or its pad.
fn sites(outline: &FingerOutline) -> Vec<Site> {
    if let Some((pad, x_tp)) = outline.pad() {
        let at = PAD_SITES.map(|share| pad.size_m.map(|size_m| share * size_m));
        let places = at.iter().flat_map(|[x, _]| at.iter().map(move |[_, y]| [*x, *y]));
        return places
            .map(|[x, y]| {
                let p = Point3::new(x, y, pad.surface_m([x, y]));
                // The normal of a dome leads away from its centre.
                let dome = UnitVector3::try_new(Vector3::new(x, y, p.z + pad.dome_m), 0.0);
                let normal = dome.filter(|_| pad.dome_m > 0.0).unwrap_or(Vector3::z_axis());
                Site { p_t: x_tp * p, outward_t: x_tp.rotation * normal }
            })
            .collect();
    }
    let places = SITES.iter().flat_map(|site| TURNS_DEG.map(|turn_deg| (*site, turn_deg)));
    places
        .map(|(site, turn_deg)| {
            let length_m = if site > 0.0 { outline.radius_m() } else { outline.length_m() };
            let (p_t, outward_t) = outline.at(site * length_m, turn_deg.to_radians());
            Site { p_t, outward_t }
        })
        .collect()
}

/// Returns points of the body, in `T`, that a pad locates when it is pressed at `p_t` from its pose
/// `x_wt` of first contact.
fn pad_points(
    pad: &GelPad,
    x_tp: &Isometry3<f64>,
    p_t: &Point3<f64>,
    body: &CalibrationBody,
    x_wt: &Isometry3<f64>,
    side_w: &UnitVector3<f64>,
) -> Vec<Point3<f64>> {
    let mut x_wp = x_wt * x_tp;
    x_wp.translation.vector -= side_w.scale(PAD_PRESSED_M);
    let middle = x_tp.inverse_transform_point(p_t);
    let [width_m, height_m] = pad.size_m;
    let mut around_m = PAD_AROUND * width_m.min(height_m);
    if let CalibrationBody::Ball { radius_m, .. } = body {
        around_m = around_m.min((2.0 * radius_m * PAD_PRESSED_M * PAD_SHARE).sqrt());
    }
    let places = [[0.0, 0.0], [1.0, 0.0], [-0.5, 0.87], [-0.5, -0.87]];
    places
        .map(|[x, y]| {
            let mut p = middle + Vector3::new(x, y, 0.0) * around_m;
            // Along the pad's normal, until it is on the body.
            for _ in 0..STEPS {
                p.z += body.distance_m(&(x_wp * p));
            }
            x_tp * p
        })
        .into()
}

/// Returns directions from the body towards the finger: around the free side of a ball; one for a
/// plate.
fn sides(body: &CalibrationBody, free_w: &UnitVector3<f64>) -> Vec<UnitVector3<f64>> {
    if let CalibrationBody::Plate { normal_w, .. } = body {
        return vec![*normal_w];
    }
    let [across, along] = CalibrationBody::axes(free_w);
    let circle = |(angle_deg, count): (f64, usize)| {
        (0..count).map(move |i| {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            let (up, aside) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
            let side = free_w.into_inner() * cos + (across * aside + along * up) * sin;
            UnitVector3::new_normalize(side)
        })
    };
    SIDES.iter().copied().flat_map(circle).collect()
}

/// Returns the pose of `T` at which the finger's `site` touches the body on `side_w`, rotated by
/// `spin` about the outward normal; `None` if there is none.
fn pose(
    body: &CalibrationBody,
    side_w: &UnitVector3<f64>,
    site: &Site,
    spin: f64,
) -> Option<Isometry3<f64>> {
    let p_w = match body {
        CalibrationBody::Ball { centre_w, radius_m } => centre_w + side_w.scale(*radius_m),
        CalibrationBody::Plate { point_w, .. } => *point_w,
    };
    let inward_w = -side_w.into_inner();
    let turn = Rotation3::rotation_between(&site.outward_t, &inward_w)
        .or_else(|| Rotation3::rotation_between(&-site.outward_t.into_inner(), side_w))?;
    let spun = Rotation3::from_axis_angle(side_w, spin) * turn;
    let r_wt = UnitQuaternion::from_rotation_matrix(&spun);
    let p_wt = p_w - r_wt * site.p_t.coords;
    Some(Isometry3::from_parts(Translation3::from(p_wt.coords), r_wt))
}

/// Returns the approach to the pose `x_wt` against `side_w`.
fn approach(x_wt: &Isometry3<f64>, side_w: &UnitVector3<f64>, finger: &Finger) -> Approach {
    let p_wt = Point3::from(x_wt.translation.vector);
    let [across, _] = CalibrationBody::axes(side_w);
    let axes = [across, side_w.into_inner(), across.cross(side_w)];
    let r_wa = Rotation3::from_basis_unchecked(&axes);
    let r_wa = UnitQuaternion::from_rotation_matrix(&r_wa);
    // The servo offsets an approach by the hull's bulge and radius.
    let ahead_m = [finger.bulge_m() - MARGIN_M, MARGIN_M - finger.radius_m];
    let [p_near_w, p_far_w] = ahead_m.map(|ahead_m| p_wt - side_w.scale(ahead_m));
    Approach {
        p_near_w,
        p_far_w,
        r_wa,
        r_at: r_wa.inverse() * x_wt.rotation,
        obstacle: None,
        slide_w: None,
    }
}

/// Whether `robot` has a posture at both ends of the approach.
fn is_reached(robot: &Robot, approach: &Approach) -> bool {
    let ahead_w = approach.direction_w();
    let bulge_m = robot.finger.bulge_m();
    let ends = [
        approach.p_near_w - ahead_w.scale(bulge_m + STANDOFF_M),
        approach.p_far_w + ahead_w.scale(robot.finger.radius_m),
    ];
    ends.into_iter().all(|p_wt| {
        let x_wt = Isometry3::from_parts(p_wt.coords.into(), approach.r_wt());
        posture(&robot.chain, &x_wt).is_ok()
    })
}

/// Sorts touches so that the finger turns little between them, starting from home.
fn in_order(robot: &Robot, mut left: Vec<Candidate>) -> Vec<Candidate> {
    let mut ordered: Vec<Candidate> = Vec::new();
    let mut at = robot.chain.forward(&robot.chain.home).rotation;
    while !left.is_empty() {
        let turn = |candidate: &Candidate| at.angle_to(&candidate.touch.x_wt.rotation);
        let next = (0..left.len()).min_by(|&a, &b| turn(&left[a]).total_cmp(&turn(&left[b])));
        let candidate = left.swap_remove(next.unwrap_or_default());
        at = candidate.touch.x_wt.rotation;
        ordered.push(candidate);
    }
    ordered
}

/// A purely kinematic arm: no mass, no object, no sensor. It stops before its links come too close
/// to each other.
struct KinematicArm {
    chain: Chain,
    clearance: Clearance,
    reaches_m: Joints,
    start: Joints,
    capabilities: Capabilities,
    q: Joints,
    reading: Reading,
}

/// Control period, s; a heuristic: sufficient for a resolved-rate controller, not for a servo.
const PERIOD_S: f64 = 0.01;

impl KinematicArm {
    /// Creates an arm at rest at `start`.
    fn new(robot: &Robot, start: Joints) -> Self {
        let chain = robot.chain.clone();
        Self {
            capabilities: Capabilities::simulated(&chain, PERIOD_S),
            clearance: Clearance::new(robot.capsules()),
            reaches_m: chain.reaches_m(robot.finger.radius_m),
            start,
            q: start,
            reading: Reading::default(),
            chain,
        }
    }

    fn report(&mut self, qdot: &Joints) {
        let joints = self.chain.joints.len();
        let results = [(&mut self.reading.q, &self.q), (&mut self.reading.qdot, qdot)];
        for (to, from) in results {
            to.clear();
            to.extend(from.iter().take(joints));
        }
    }
}

impl Backend for KinematicArm {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        self.q = self.start;
        self.reading.time_s = 0.0;
        self.report(&Joints::zeros());
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let qdot = self.capabilities.accept(command)?;
        let (chain, q, reaction_s) = (&self.chain, &self.q, PERIOD_S + defaults::REACTION_S);
        let ahead = JointSegment::braking(chain, &self.reaches_m, q, &qdot, reaction_s);
        let least_m = defaults::CLEARANCE_M + SLACK_M;
        let start = self.clearance.nearest(chain, q);
        if self.clearance.first_below(&ahead, least_m, start).is_some() {
            return Err(Fault::NoPath { time_s: self.reading.time_s, q: self.reading.q.clone() });
        }
        self.q = self.chain.clamp(&(self.q + qdot * PERIOD_S));
        self.reading.time_s += PERIOD_S;
        self.report(&qdot);
        Ok(&self.reading)
    }
}

/// Margins of the simulated joints to their limits, and of the links to each other beyond the
/// interlocks' clearance, since touches do not end exactly where they were simulated; heuristics.
const SLACK_RAD: f64 = 0.25;
const SLACK_M: f64 = 5e-3;

/// Returns the indices of those `approaches` that `robot` can make one after the other from home.
///
/// # Errors
/// If the robot cannot be driven at all.
fn simulate_touches(
    robot: &Robot,
    touch: &TouchSettings,
    approaches: &[Approach],
) -> Result<Vec<usize>, Fault> {
    let mut robot = robot.clone();
    for joint in robot.chain.joints.iter_mut().filter(|joint| joint.kind == JointType::Revolute) {
        joint.q_limits = [joint.q_limits[0] + SLACK_RAD, joint.q_limits[1] - SLACK_RAD];
    }
    // Simulated with the servo that will make them, on the arm's kinematics alone.
    let servo_at = |q: Joints| {
        Servo::new(robot.clone(), touch.clone(), Box::new(KinematicArm::new(&robot, q)), 0)
    };
    let mut q = robot.chain.home;
    let mut servo = servo_at(q)?;
    let mut made = Vec::new();
    for (i, approach) in approaches.iter().enumerate() {
        if servo.touch(approach).is_ok() {
            made.push(i);
            q = servo.joints().unwrap_or(q);
        } else {
            servo = servo_at(q)?;
        }
    }
    Ok(made)
}
