//! From an experiment to its trials: the one way that everything goes which runs a simulation.

use crate::backend::ros::arm::Lab;
use crate::backend::ros::settings::BackendKind;
use crate::backend::{Backend, Fault, LinkFault};
use crate::experiment::experiment::Experiment;
use crate::experiment::measure::shape::TrueShape;
use crate::experiment::notice;
use crate::experiment::notice::Notice;
use crate::experiment::real_robot::{self, MissingForRobot};
use crate::experiment::trial::GroundTruth;
use crate::experiment::trial::entrant::{Entrant, ORACLE};
use crate::experiment::trial::row::TrialRow;
use crate::experiment::trial::trial;
use crate::experiment::trial::witness::Witness;
use crate::experiment::truth::Truth;
use crate::experiment::truth::cloud::CloudError;
use crate::experiment::truth::scan_truth::LeftOut;
use crate::explore::planner::{self, PlannerFactory};
use crate::explore::probe::Probe;
use crate::explore::probe::servo::Servo;
use crate::math::seed;
use crate::sim::Environment;
use crate::sim::environment::EnvironmentError;
use crate::sim::simulator::{Simulator, SimulatorError};
use crate::task::Task;
use rand::RngExt;
use std::sync::Arc;
use thiserror::Error;

/// An experiment with everything that its trials share: the scene built, its models compiled, the
/// truth sampled. It never changes, and threads share it.
pub struct Simulation {
    experiment: Experiment,
    simulator: Simulator,
    truth: Truth,
    /// The true surface of a whole object, where that is explored.
    shape: Option<TrueShape>,
    /// The arm that touches in place of the simulated body, once it is connected.
    lab: Option<Arc<Lab>>,
    /// How far the truth may itself be off, if it was scanned.
    left_out: Option<LeftOut>,
    /// Planners that are not built in.
    own_planners: Vec<Box<dyn PlannerFactory>>,
}

/// An experiment that cannot be simulated.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// It moves a real robot and lacks settings that protect it.
    #[error(transparent)]
    MissingForRobot(#[from] MissingForRobot),
    /// Its scene cannot be built.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// Its body cannot be made.
    #[error(transparent)]
    Simulator(#[from] SimulatorError),
    /// The scan that is its truth cannot be read.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// No surface at any test place.
    #[error("no place of the zone has a surface along the approach: nothing to explore")]
    NoSurface,
}

impl Simulation {
    /// Builds the experiment's scene, compiles its models and samples the truth.
    ///
    /// # Errors
    /// If the scene cannot be built or simulated, or the zone has no surface.
    pub fn new(experiment: Experiment) -> Result<Self, SimulationError> {
        Self::new_telling(experiment, &|_| ())
    }

    /// As [`new`](Self::new); `tell` is called with the name of each step that may take long, as it
    /// begins.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn new_telling(
        mut experiment: Experiment,
        tell: &dyn Fn(&str),
    ) -> Result<Self, SimulationError> {
        real_robot::check(&experiment)?;
        if experiment.backend.kind != BackendKind::Simulated {
            // Otherwise taken from the mesh.
            if let Some(zone) = &mut experiment.scene.zone {
                zone.datum_y_m.get_or_insert(0.0);
            }
        }
        let environment = Environment::build_telling(experiment.scene.clone(), tell)?;
        let (truth, left_out) = sampled(&experiment, &environment, tell)?;
        let shape = TrueShape::of(&environment);
        tell("compiling the model");
        let simulation = Self::against(experiment, Arc::new(environment), truth)?;
        Ok(Self { left_out, shape, ..simulation })
    }

    /// As [`new`](Self::new), in an environment that is there already; its scene takes the place of
    /// the experiment's.
    ///
    /// # Errors
    /// If it cannot be simulated, or the zone has no surface.
    pub fn within(
        experiment: Experiment,
        environment: Arc<Environment>,
    ) -> Result<Self, SimulationError> {
        let (truth, left_out) = sampled(&experiment, &environment, &|_| ())?;
        let shape = TrueShape::of(&environment);
        Ok(Self { left_out, shape, ..Self::against(experiment, environment, truth)? })
    }

    /// As [`within`](Self::within), held against a `truth` that was sampled before; an unknown one
    /// leaves the measures that need none.
    ///
    /// # Errors
    /// If it cannot be simulated.
    pub fn against(
        mut experiment: Experiment,
        environment: Arc<Environment>,
        truth: Truth,
    ) -> Result<Self, SimulationError> {
        experiment.scene = environment.scene().clone();
        Ok(Self {
            experiment,
            simulator: Simulator::new(environment)?,
            truth,
            shape: None,
            lab: None,
            left_out: None,
            own_planners: Vec::new(),
        })
    }

    /// With planners that are not built in, under the names that the experiment lists them by.
    pub fn with_planners(mut self, planners: Vec<Box<dyn PlannerFactory>>) -> Self {
        self.own_planners.extend(planners);
        self
    }

    /// The entrant of a name: a planner that is built in or [own](Self::with_planners), or the
    /// oracle.
    pub fn planner(&self, name: &str) -> Option<Entrant<'_>> {
        if name == ORACLE {
            return Some(Entrant::Oracle);
        }
        let own = self.own_planners.iter().map(|planner| &**planner);
        let built_in = planner::by_name(name).map(Entrant::from);
        let is_it = |planner: &&dyn PlannerFactory| planner.name() == name;
        built_in.or_else(|| own.into_iter().find(is_it).map(Entrant::from))
    }

    /// What is run, with everything that it left to its object written out.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// The scene, built.
    pub fn environment(&self) -> &Arc<Environment> {
        self.simulator.environment()
    }

    /// What makes the trials' bodies.
    pub fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    /// What of the experiment may not be meant.
    pub fn notices(&self) -> Vec<String> {
        let scene = self.simulator.notices().into_iter().map(|notice| notice.to_string());
        let truth = notice::of_truth(self.task().zone(), &self.truth).into_iter();
        let left_out = self.left_out.map(Notice::FromScan).into_iter();
        let shape = self.shape.as_ref().and_then(notice::of_shape);
        let told = truth.chain(left_out).chain(shape).map(|notice| notice.to_string());
        scene.chain(told).collect()
    }

    /// The truth on the test grid.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The true surface of a whole object; none where one side is explored.
    pub fn shape(&self) -> Option<&TrueShape> {
        self.shape.as_ref()
    }

    /// What the robot is told.
    pub fn task(&self) -> &Task {
        self.environment().task()
    }

    /// Seed of all the randomness of a trial's body.
    pub fn body_seed(&self, trial: u32) -> u64 {
        seed::stream(self.experiment.seed, trial.into(), "body").random()
    }

    /// Whether the experiment wants an arm that is not simulated here.
    pub fn is_real(&self) -> bool {
        self.experiment.backend.kind != BackendKind::Simulated
    }

    /// Connects to the arm that the experiment wants, and none if it wants a simulated one.
    ///
    /// # Errors
    /// If it cannot be reached, or is not in a state to be driven.
    pub fn connect(&mut self) -> Result<Option<Arc<Lab>>, LinkFault> {
        if self.is_real() {
            let lacks = || LinkFault::Arm("the scene has no object to touch".into());
            let chain = self.environment().chain().ok_or_else(lacks)?;
            self.lab = Some(Lab::join(&self.experiment.backend, &chain)?);
        }
        Ok(self.lab.clone())
    }

    /// What is moved in a trial: the arm that is connected, or the simulated body; none where a
    /// touch is no motion.
    ///
    /// # Errors
    /// If no arm is connected, or there is no memory for the body's state.
    pub fn body(&self) -> Result<Option<Box<dyn Backend>>, Fault> {
        match &self.lab {
            Some(lab) => Ok(Some(Box::new(lab.body()))),
            None if self.is_real() => Err(Fault::lacks("a connection to the arm")),
            None => self.simulator.body(),
        }
    }

    /// What drives `body` through touches, within the experiment's interlocks.
    ///
    /// # Errors
    /// If it cannot be brought to its start.
    pub fn servo(&self, body: Box<dyn Backend>, seed: u64) -> Result<Servo, Fault> {
        self.simulator.servo_within(body, seed, &self.experiment.backend.interlocks)
    }

    /// What touches in a trial.
    ///
    /// # Errors
    /// If the body cannot be brought to its start, or no arm is connected.
    pub fn probe(&self, trial: u32) -> Result<Box<dyn Probe>, Fault> {
        let seed = self.body_seed(trial);
        match self.body()? {
            Some(body) => Ok(Box::new(self.servo(body, seed)?)),
            None => self.simulator.probe(seed),
        }
    }

    /// Runs one trial of `planner` from start to end; what goes wrong stands in its row.
    pub fn trial<'a>(&self, planner: impl Into<Entrant<'a>>, trial: u32) -> TrialRow {
        self.trial_seen(planner, trial, &mut ())
    }

    /// Runs a trial like [`trial`](Self::trial); `witness` sees every touch.
    pub fn trial_seen<'a>(
        &self,
        planner: impl Into<Entrant<'a>>,
        trial: u32,
        witness: &mut dyn Witness,
    ) -> TrialRow {
        let planner = planner.into();
        match self.probe(trial) {
            Ok(mut probe) => self.trial_before(&mut *probe, planner, trial, witness),
            Err(fault) => TrialRow::unstarted(trial, planner.name(), &fault),
        }
    }

    /// As [`trial`](Self::trial), with the touches of any `probe`.
    pub fn trial_with<'a>(
        &self,
        probe: &mut dyn Probe,
        planner: impl Into<Entrant<'a>>,
        trial: u32,
    ) -> TrialRow {
        self.trial_before(probe, planner, trial, &mut ())
    }

    /// As [`trial_with`](Self::trial_with), with `witness` told of every touch.
    pub fn trial_before<'a>(
        &self,
        probe: &mut dyn Probe,
        planner: impl Into<Entrant<'a>>,
        trial: u32,
        witness: &mut dyn Witness,
    ) -> TrialRow {
        let truth = GroundTruth {
            environment: self.environment(),
            truth: &self.truth,
            shape: self.shape.as_ref(),
        };
        trial::run(&self.experiment, &truth, probe, planner.into(), trial, witness)
    }
}

/// The truth that an experiment asks for, and how far it may be off, if it was scanned.
fn sampled(
    experiment: &Experiment,
    environment: &Environment,
    tell: &dyn Fn(&str),
) -> Result<(Truth, Option<LeftOut>), SimulationError> {
    let per_side = experiment.grid as usize;
    let Some(zone) = environment.task().zone() else {
        return Ok((Truth::around(environment.mesh()), None));
    };
    let (truth, left_out) = match &experiment.truth {
        Some(scan) => {
            let (truth, left_out) = scan.sample(zone, per_side)?;
            (truth, Some(left_out))
        }
        None => (Truth::sample_telling(environment, per_side, tell), None),
    };
    match truth.is_known() {
        true => Ok((truth, left_out)),
        false => Err(SimulationError::NoSurface),
    }
}
