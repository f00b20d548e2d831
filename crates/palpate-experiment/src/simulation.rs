//! Simulation of an experiment's trials.

use crate::experiment::Experiment;
use crate::metrics::shape::TrueShape;
use crate::metrics::truth::Truth;
use crate::notice;
use crate::real_robot;
use crate::row::TrialRow;
use crate::trial::looks;
use crate::trial::{self, GroundTruth, OracleFactory, TrialObserver};
use palpate_explore::backend::arm::Arm;
use palpate_explore::backend::live_view::{LiveView, ViewedBackend};
use palpate_explore::backend::{Backend, Fault, LinkFault};
use palpate_explore::planner::{self, PlannerFactory};
use palpate_explore::probe::Probe;
use palpate_explore::probe::servo::Servo;
use palpate_explore::recognition::Library;
use palpate_explore::task::Task;
use palpate_explore::whole_object::settings::PriorShape;
use palpate_gp::math::seed;
use palpate_input::error::InputError;
use palpate_sim::Environment;
use palpate_sim::library::{LoadedLibrary, OBJECT, TrueObject};
use palpate_sim::simulator::Simulator;
use rand::RngExt;
use std::sync::Arc;

/// An experiment with the data that its trials share: the built scene, the compiled models and the
/// sampled ground truth. It is immutable and shared between threads.
pub struct Simulation {
    experiment: Experiment,
    simulator: Simulator,
    truth: Arc<GroundTruth>,
    /// Connected arm that replaces the simulated robot.
    arm: Option<Arc<dyn Arm>>,
    /// Notice about a scanned ground truth.
    scan_notice: Option<String>,
    /// Planners that are not built in: the oracle, and added ones.
    external_planners: Vec<Box<dyn PlannerFactory>>,
}

impl Simulation {
    /// Builds the experiment's scene, compiles its models and samples the ground truth.
    ///
    /// # Errors
    /// If the scene cannot be built or simulated, or the zone has no surface.
    pub fn new(experiment: Experiment) -> Result<Self, InputError> {
        Self::new_with_progress(experiment, &|_| ())
    }

    /// Builds the simulation as [`new`](Self::new) does, and reports the name of each slow step to
    /// `tell`.
    ///
    /// # Errors
    /// See [`new`](Self::new).
    pub fn new_with_progress(
        mut experiment: Experiment,
        tell: &dyn Fn(&str),
    ) -> Result<Self, InputError> {
        let library = experiment.scene.library.as_ref().map(|settings| {
            tell("reading the library");
            LoadedLibrary::read(settings).map(Arc::new)
        });
        let library = library.transpose()?;
        if let Some(library) = &library {
            library.complete(&mut experiment.scene);
            library.check_poses(&experiment.scene)?;
        }
        real_robot::check(&experiment, false)?;
        let is_real = experiment.backend.is_real();
        if is_real {
            // A simulation takes this from the mesh.
            if let Some(zone) = &mut experiment.scene.zone {
                zone.datum_y_m.get_or_insert(0.0);
            }
        }
        let is_drawn = !is_real && experiment.scene.object.is_none();
        if let Some(library) = library.as_ref().filter(|_| is_drawn) {
            return Self::with_library(experiment, library, None);
        }
        let environment = Environment::build_with_progress(experiment.scene.clone(), tell);
        let environment = environment.map_err(|error| InputError::new(error.to_string()))?;
        Self::sampled(experiment, Arc::new(environment), library, tell)
    }

    /// Builds the simulation of a trial with an object of a library; without a trial, of its first
    /// one, and no ground truth is that of all trials.
    fn with_library(
        experiment: Experiment,
        library: &Arc<LoadedLibrary>,
        trial: Option<u32>,
    ) -> Result<Self, InputError> {
        let number = trial.unwrap_or(0);
        let prior = experiment.scene.pose.clone().unwrap_or_default();
        let mut random = seed::stream(experiment.seed, number.into(), OBJECT);
        let object = library.draw(&prior, number, &mut random);
        let scene = library.place(&experiment.scene, &object);
        let environment = Arc::new(Environment::build(scene)?);
        let truth = match trial {
            Some(_) => Truth::sample(&environment, experiment.grid as usize, &|_| ()),
            None => Truth::unknown(environment.task().zone(), experiment.grid as usize),
        };
        if trial.is_none() {
            looks::check(&experiment, &environment)?;
        }
        let (library, object) = (Some(Arc::clone(library)), Some(object));
        // Sampled only where the object is reconstructed too.
        let is_rebuilt = trial.is_some() && experiment.space.prior == PriorShape::Library;
        let shape = is_rebuilt.then(|| TrueShape::from_environment(&environment)).flatten();
        let mut made =
            Self::made(experiment, GroundTruth { environment, truth, shape, library, object })?;
        // Each trial has its own.
        made.experiment.scene.object = None;
        Ok(made)
    }

    /// Returns the objects of hypotheses.
    pub fn library(&self) -> Option<&Arc<Library>> {
        self.truth.library.as_ref().map(|library| &library.known)
    }

    /// Returns the library of the scene with its unknown objects.
    pub fn loaded_library(&self) -> Option<&LoadedLibrary> {
        self.truth.library.as_deref()
    }

    /// Returns the object of the trial that this simulation was [drawn](Self::drawn) for.
    pub fn object(&self) -> Option<&TrueObject> {
        self.truth.object.as_ref()
    }

    /// Returns the simulation of one trial, where each touches another object; `None` where all
    /// share one.
    ///
    /// # Errors
    /// If the scene with the object cannot be built or simulated.
    pub fn drawn(&self, trial: u32) -> Result<Option<Self>, InputError> {
        let is_drawn = self.truth.object.is_some();
        let Some(library) = self.truth.library.as_ref().filter(|_| is_drawn) else {
            return Ok(None);
        };
        Self::with_library(self.experiment.clone(), library, Some(trial)).map(Some)
    }

    /// Builds the simulation in an existing environment, whose scene replaces the experiment's.
    ///
    /// # Errors
    /// If the scene cannot be simulated, or the zone has no surface.
    pub fn in_environment(
        experiment: Experiment,
        environment: Arc<Environment>,
    ) -> Result<Self, InputError> {
        Self::sampled(experiment, environment, None, &|_| ())
    }

    /// Builds the simulation in an environment and samples the ground truth that the experiment
    /// selects.
    fn sampled(
        experiment: Experiment,
        environment: Arc<Environment>,
        library: Option<Arc<LoadedLibrary>>,
        tell: &dyn Fn(&str),
    ) -> Result<Self, InputError> {
        let per_side = experiment.grid as usize;
        let (truth, scanned) = match (environment.task().zone(), &experiment.truth) {
            (Some(zone), Some(scan)) => {
                let (truth, contacts, rmse_m) = scan.sample(zone, per_side)?;
                (truth, Some(notice::scan_notice(contacts, rmse_m)))
            }
            _ => (Truth::sample(&environment, per_side, tell), None),
        };
        if environment.task().zone().is_some() && !truth.is_known() {
            let mut known = vec!["check scene.zone and object.position_m".to_owned()];
            known.extend(environment.notices().iter().cloned());
            let problem = "no surface in the zone along the approach";
            return Err(InputError::new(problem).remedy(known.join("; ")));
        }
        looks::check(&experiment, &environment)?;
        let shape = TrueShape::from_environment(&environment);
        tell("compiling the model");
        let truth = GroundTruth { environment, truth, shape, library, object: None };
        Ok(Self { scan_notice: scanned, ..Self::made(experiment, truth)? })
    }

    /// Builds the simulation as [`in_environment`](Self::in_environment) does, with a ground truth
    /// sampled before. Without a known truth only truth-free measures are computed.
    ///
    /// # Errors
    /// If the scene cannot be simulated.
    pub fn with_truth(
        experiment: Experiment,
        environment: Arc<Environment>,
        truth: Truth,
    ) -> Result<Self, InputError> {
        let (library, object) = (None, None);
        Self::made(experiment, GroundTruth { environment, truth, shape: None, library, object })
    }

    fn made(mut experiment: Experiment, truth: GroundTruth) -> Result<Self, InputError> {
        experiment.scene = truth.environment.scene().clone();
        let simulator = Simulator::new(Arc::clone(&truth.environment));
        let simulator = simulator.map_err(|error| InputError::new(error.to_string()))?;
        let truth = Arc::new(truth);
        let restricted = experiment.planners.iter().filter_map(|name| planner::restricted(name));
        let oracle: Box<dyn PlannerFactory> = Box::new(OracleFactory(truth.clone()));
        let own_planners: Vec<_> = restricted.chain([oracle]).collect();
        Ok(Self {
            experiment,
            simulator,
            truth,
            arm: None,
            scan_notice: None,
            external_planners: own_planners,
        })
    }

    /// Adds planners that are not built in, under the names that the experiment lists.
    pub fn with_planners(mut self, planners: Vec<Box<dyn PlannerFactory>>) -> Self {
        self.external_planners.extend(planners);
        self
    }

    /// Finds a planner by name: built in, [added](Self::with_planners), or the oracle.
    pub fn planner(&self, name: &str) -> Option<&dyn PlannerFactory> {
        let built_in = planner::by_name(name).map(|entry| entry as &dyn PlannerFactory);
        let mut own = self.external_planners.iter().map(|planner| &**planner);
        built_in.or_else(|| own.find(|planner| planner.name() == name))
    }

    /// Returns the experiment, with the settings derived from its object filled in.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// Built scene.
    pub fn environment(&self) -> &Arc<Environment> {
        self.simulator.environment()
    }

    /// Factory of the trials' backends.
    pub fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    /// Warnings about likely configuration mistakes.
    pub fn notices(&self) -> Vec<String> {
        let mut notices: Vec<String> = self.simulator.notices();
        if self.truth.object.is_none() {
            notices.extend(notice::truth_notices(self.task().zone(), self.truth()));
        }
        notices.extend(self.scan_notice.clone());
        notices.extend(self.shape().and_then(notice::shape_notice));
        notices
    }

    /// Ground truth on the test grid.
    pub fn truth(&self) -> &Truth {
        &self.truth.truth
    }

    /// True surface of a whole object; `None` for a zone.
    pub fn shape(&self) -> Option<&TrueShape> {
        self.truth.shape.as_ref()
    }

    /// Exploration task: the part of the scene that is given to the robot.
    pub fn task(&self) -> &Task {
        self.environment().task()
    }

    /// Seed of all random numbers of a trial's backend.
    pub fn body_seed(&self, trial: u32) -> u64 {
        seed::stream(self.experiment.seed, trial.into(), "body").random()
    }

    /// Whether the experiment uses a real arm.
    pub fn is_real(&self) -> bool {
        self.experiment.backend.is_real()
    }

    /// Connects to the experiment's arm; returns `None` for a simulated one.
    ///
    /// # Errors
    /// If the arm cannot be reached, or is not ready to be moved.
    pub fn connect(&mut self) -> Result<Option<Arc<dyn Arm>>, LinkFault> {
        let backend = &self.experiment.backend;
        if let Some((_, arm)) = backend.arm() {
            let lacks = || LinkFault::Arm("the scene has no object to touch".into());
            let chain = self.environment().chain().ok_or_else(lacks)?;
            self.arm = Some(arm.connect(&chain, backend.dry)?);
        }
        Ok(self.arm.clone())
    }

    /// Returns the connected arm, if any.
    pub fn arm(&self) -> Option<&dyn Arm> {
        self.arm.as_deref()
    }

    /// Returns the backend of a trial, which a view may show: the connected arm or the simulated
    /// robot; `None` if touches are computed without motion.
    ///
    /// # Errors
    /// If no arm is connected, or memory for the simulator's state is missing.
    pub fn backend(&self, view: Option<&LiveView>) -> Result<Option<Box<dyn Backend>>, Fault> {
        let body = match &self.arm {
            Some(arm) => Some(Arc::clone(arm).backend()),
            None if self.is_real() => return Err(Fault::lacks("a connection to the arm")),
            None => self.simulator.body()?,
        };
        Ok(match (body, view) {
            (Some(body), Some(view)) => Some(Box::new(ViewedBackend::new(body, view.clone()))),
            (body, _) => body,
        })
    }

    /// Returns the servo that moves `body` through touches, within the experiment's interlocks.
    ///
    /// # Errors
    /// If the robot cannot be moved to its start.
    pub fn servo(&self, body: Box<dyn Backend>, seed: u64) -> Result<Servo, Fault> {
        self.simulator.servo_within(body, seed, &self.experiment.backend.interlocks)
    }

    /// Returns the probe that makes a trial's touches.
    ///
    /// # Errors
    /// If the robot cannot be moved to its start, or no arm is connected.
    pub fn probe(&self, trial: u32) -> Result<Box<dyn Probe>, Fault> {
        self.viewed_probe(trial, None)
    }

    /// Returns the probe as [`probe`](Self::probe) does, with a body that `view` shows.
    pub(crate) fn viewed_probe(
        &self,
        trial: u32,
        view: Option<&LiveView>,
    ) -> Result<Box<dyn Probe>, Fault> {
        let seed = self.body_seed(trial);
        match self.backend(view)? {
            Some(body) => Ok(Box::new(self.servo(body, seed)?)),
            None => self.simulator.probe(seed),
        }
    }

    /// Runs one trial of `planner` from start to end; the row contains any failure.
    pub fn trial(&self, planner: &dyn PlannerFactory, trial: u32) -> TrialRow {
        let run = || {
            let drawn = self.drawn(trial)?;
            let own = drawn.as_ref().unwrap_or(self);
            let mut probe = own.probe(trial)?;
            Ok(own.trial_with(&mut *probe, planner, trial, &mut |_| Ok(None)))
        };
        run().unwrap_or_else(|fault: Fault| TrialRow::not_started(trial, planner.name(), &fault))
    }

    /// Runs a trial like [`trial`](Self::trial) with any `probe`, and calls `observer` after each
    /// touch.
    pub fn trial_with(
        &self,
        probe: &mut dyn Probe,
        planner: &dyn PlannerFactory,
        trial: u32,
        observer: &mut TrialObserver,
    ) -> TrialRow {
        trial::run(&self.experiment, &self.truth, probe, planner, trial, observer)
    }
}
