//! From an experiment to its trials: the one way that everything goes which runs a simulation.

use crate::experiment::experiment::Experiment;
use crate::experiment::measure::shape::TrueShape;
use crate::experiment::notice;
use crate::experiment::real_robot;
use crate::experiment::trial::row::TrialRow;
use crate::experiment::trial::{self, GroundTruth, OracleFactory, TrialObserver};
use crate::experiment::truth::Truth;
use crate::sim::Environment;
use crate::sim::simulator::Simulator;
use palpate_explore::backend::{Backend, Fault, LinkFault};
use palpate_explore::planner::{self, PlannerFactory};
use palpate_explore::probe::Probe;
use palpate_explore::probe::servo::Servo;
use palpate_explore::task::Task;
use palpate_gp::math::seed;
use palpate_input::error::Invalid;
use palpate_ros::arm::Lab;
use palpate_ros::settings::BackendKind;
use rand::RngExt;
use std::sync::Arc;

/// An experiment with everything that its trials share: the scene built, its models compiled, the
/// truth sampled. It never changes, and threads share it.
pub struct Simulation {
    experiment: Experiment,
    simulator: Simulator,
    truth: Arc<GroundTruth>,
    /// The arm that touches in place of the simulated body, once it is connected.
    lab: Option<Arc<Lab>>,
    /// The notice about a truth that was scanned.
    scanned: Option<String>,
    /// Planners that are not built in: the oracle, and those that were added.
    own_planners: Vec<Box<dyn PlannerFactory>>,
}

impl Simulation {
    /// Builds the experiment's scene, compiles its models and samples the truth.
    ///
    /// # Errors
    /// If the scene cannot be built or simulated, or the zone has no surface.
    pub fn new(experiment: Experiment) -> Result<Self, Invalid> {
        Self::new_telling(experiment, &|_| ())
    }

    /// As [`new`](Self::new); `tell` is called with the name of each step that may take long, as it
    /// begins.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn new_telling(mut experiment: Experiment, tell: &dyn Fn(&str)) -> Result<Self, Invalid> {
        real_robot::check(&experiment, false)?;
        if experiment.backend.kind != BackendKind::Simulated {
            // Otherwise taken from the mesh.
            if let Some(zone) = &mut experiment.scene.zone {
                zone.datum_y_m.get_or_insert(0.0);
            }
        }
        let environment = Environment::build_telling(experiment.scene.clone(), tell);
        let environment = environment.map_err(|error| Invalid::new(error.to_string()))?;
        Self::sampled(experiment, Arc::new(environment), tell)
    }

    /// As [`new`](Self::new), in an environment that is there already; its scene takes the place of
    /// the experiment's.
    ///
    /// # Errors
    /// If it cannot be simulated, or the zone has no surface.
    pub fn within(experiment: Experiment, environment: Arc<Environment>) -> Result<Self, Invalid> {
        Self::sampled(experiment, environment, &|_| ())
    }

    /// In an environment whose truth is sampled as the experiment asks.
    fn sampled(
        experiment: Experiment,
        environment: Arc<Environment>,
        tell: &dyn Fn(&str),
    ) -> Result<Self, Invalid> {
        let per_side = experiment.grid as usize;
        let (truth, scanned) = match (environment.task().zone(), &experiment.truth) {
            (Some(zone), Some(scan)) => {
                let (truth, contacts, rmse_m) = scan.sample(zone, per_side)?;
                (truth, Some(notice::of_scan(contacts, rmse_m)))
            }
            _ => (Truth::sample(&environment, per_side, tell), None),
        };
        if environment.task().zone().is_some() && !truth.is_known() {
            return Err(Invalid::new(
                "no place of the zone has a surface along the approach: nothing to explore",
            ));
        }
        let shape = TrueShape::of(&environment);
        tell("compiling the model");
        let truth = GroundTruth { environment, truth, shape };
        Ok(Self { scanned, ..Self::made(experiment, truth)? })
    }

    /// As [`within`](Self::within), held against a `truth` that was sampled before; an unknown one
    /// leaves the measures that need none.
    ///
    /// # Errors
    /// If it cannot be simulated.
    pub fn against(
        experiment: Experiment,
        environment: Arc<Environment>,
        truth: Truth,
    ) -> Result<Self, Invalid> {
        Self::made(experiment, GroundTruth { environment, truth, shape: None })
    }

    fn made(mut experiment: Experiment, truth: GroundTruth) -> Result<Self, Invalid> {
        experiment.scene = truth.environment.scene().clone();
        let simulator = Simulator::new(Arc::clone(&truth.environment));
        let simulator = simulator.map_err(|error| Invalid::new(error.to_string()))?;
        let truth = Arc::new(truth);
        let own_planners: Vec<Box<dyn PlannerFactory>> =
            vec![Box::new(OracleFactory(truth.clone()))];
        Ok(Self { experiment, simulator, truth, lab: None, scanned: None, own_planners })
    }

    /// With planners that are not built in, under the names that the experiment lists them by.
    pub fn with_planners(mut self, planners: Vec<Box<dyn PlannerFactory>>) -> Self {
        self.own_planners.extend(planners);
        self
    }

    /// The planner of a name: one that is built in or [own](Self::with_planners), or the oracle.
    pub fn planner(&self, name: &str) -> Option<&dyn PlannerFactory> {
        let built_in = planner::by_name(name).map(|entry| entry as &dyn PlannerFactory);
        let mut own = self.own_planners.iter().map(|planner| &**planner);
        built_in.or_else(|| own.find(|planner| planner.name() == name))
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
        let mut notices: Vec<String> = self.simulator.notices();
        notices.extend(notice::of_truth(self.task().zone(), self.truth()));
        notices.extend(self.scanned.clone());
        notices.extend(self.shape().and_then(notice::of_shape));
        notices
    }

    /// The truth on the test grid.
    pub fn truth(&self) -> &Truth {
        &self.truth.truth
    }

    /// The true surface of a whole object; none where one side is explored.
    pub fn shape(&self) -> Option<&TrueShape> {
        self.truth.shape.as_ref()
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
    pub fn trial(&self, planner: &dyn PlannerFactory, trial: u32) -> TrialRow {
        match self.probe(trial) {
            Ok(mut probe) => self.trial_with(&mut *probe, planner, trial, &mut |_| Ok(())),
            Err(fault) => TrialRow::unstarted(trial, planner.name(), &fault),
        }
    }

    /// Runs a trial like [`trial`](Self::trial) with the touches of any `probe`, and calls
    /// `observer` after each.
    pub fn trial_with(
        &self,
        probe: &mut dyn Probe,
        planner: &dyn PlannerFactory,
        trial: u32,
        observer: &mut TrialObserver,
    ) -> TrialRow {
        trial::run(&self.experiment, &self.truth, probe, (planner, trial), observer)
    }
}
