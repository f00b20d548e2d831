//! Nonlinear least squares with detection of undetermined directions and rejection of outliers.
//!
//! Gauss-Newton with step halving. The step is computed by singular values, and undetermined
//! directions of the parameters are not changed.

use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use thiserror::Error;

/// A least-squares problem.
///
/// Parameters are in units of their plausible error, residuals in units of their expected standard
/// deviation. A singular value of the Jacobian is then the factor by which the data narrow a
/// direction relative to its prior.
pub trait Problem {
    /// State that is fitted.
    type State: Clone;

    /// Returns the number of parameters of a step.
    fn parameters(&self) -> usize;

    /// Returns `state` moved by a step.
    fn moved(&self, state: &Self::State, step: &DVector<f64>) -> Self::State;

    /// Returns the residuals at `state`, a fixed number of them.
    fn residuals(&self, state: &Self::State) -> DVector<f64>;

    /// Fraction of the largest singular value below which a direction counts as undetermined.
    fn resolution(&self) -> f64 {
        0.0
    }

    /// Relative decrease of the cost below which a step is the last.
    fn gained(&self) -> f64 {
        GAINED
    }

    /// Step of the central differences in units of the parameters: near the cube root of the
    /// residuals' precision.
    fn difference(&self) -> f64 {
        DIFFERENCE
    }

    /// Returns the kind of residual `i`: each kind has its own scatter.
    fn kind(&self, _i: usize) -> usize {
        0
    }
}

/// Result of a least-squares fit.
#[derive(Clone, Debug)]
pub struct Solution<S> {
    /// Best parameters.
    pub state: S,
    /// Covariance in the problem's units: s²(JᵀJ)⁻¹ in the determined directions, and 1, the prior
    /// variance, in the others.
    pub covariance: DMatrix<f64>,
    /// Unit vectors of the directions that the data do not determine.
    pub undetermined: Vec<DVector<f64>>,
    /// Largest singular value over the smallest determined one.
    pub condition: f64,
    /// Final residuals, including outliers.
    pub residuals: DVector<f64>,
    /// Whether each residual was used; outliers were not.
    pub used: Vec<bool>,
}

/// Error of a problem that cannot be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FitError {
    /// A residual is not finite.
    #[error("a residual is not finite")]
    NotFinite,
    /// There are no residuals.
    #[error("there are no residuals to fit")]
    Empty,
    /// No step decreases the cost.
    #[error("the fit does not converge")]
    Unsettled,
}

/// Smallest factor by which the data must narrow a direction relative to its plausible error to
/// count as determined; a heuristic.
pub const NARROWER: f64 = 3.0;

/// Default step of central differences; a heuristic: for residuals precise to rounding.
const DIFFERENCE: f64 = 1e-4;

/// Largest number of steps, and of outlier rejections; heuristics: several times the usual number.
const STEPS: usize = 250;
const ROUNDS: usize = 12;

/// Step length, in units of the parameters, below which a step is the last; a heuristic.
const SETTLED: f64 = 1e-7;

/// Default relative decrease of the cost below which a step is the last; a heuristic.
const GAINED: f64 = 1e-9;

/// Robust standard deviations beyond which a residual is an outlier; a heuristic: 1 in 2000 of a
/// normal distribution.
const OUTLIER: f64 = 3.5;

/// Limit up to which residuals count with their square, and beyond with their absolute value (Huber
/// 1964).
const HUBER: f64 = 1.345;

/// Standard deviations per median absolute deviation of a normal distribution.
const SD_PER_MAD: f64 = 1.4826;

/// Smallest scatter of a kind as a fraction of the expected one; smaller values are replaced by it;
/// a heuristic.
const LEAST_SCATTER: f64 = 0.05;

/// Fits `problem` from `start`.
///
/// At first, large residuals count with their absolute value only; then those beyond 3.5 robust
/// standard deviations of their kind are rejected, repeatedly until the set is stable.
///
/// # Errors
/// If a residual is not finite, there is none, or no step decreases the cost.
pub fn fit<P: Problem>(problem: &P, start: &P::State) -> Result<Solution<P::State>, FitError> {
    let count = problem.residuals(start).len();
    if count == 0 {
        return Err(FitError::Empty);
    }
    let mut used = vec![true; count];
    let mut state = settle(problem, start, huber)?;
    for _ in 0..ROUNDS {
        let residuals = problem.residuals(&state);
        let scatter = scatters(problem, &residuals);
        let now: Vec<bool> = (residuals.iter().enumerate())
            .map(|(i, r)| r.abs() <= OUTLIER * scatter[problem.kind(i)])
            .collect();
        state = settle(problem, &state, |r| kept(r, &now))?;
        if std::mem::replace(&mut used, now) == used {
            break;
        }
    }
    conclude(problem, state, used)
}

/// Returns the best parameters from `start` and their cost without rejection of outliers: large
/// residuals count with their absolute value only.
///
/// # Errors
/// If a residual is not finite, there is none, or no step decreases the cost.
pub fn robust<P: Problem>(problem: &P, start: &P::State) -> Result<(P::State, f64), FitError> {
    if problem.residuals(start).is_empty() {
        return Err(FitError::Empty);
    }
    let state = settle(problem, start, huber)?;
    let (_, cost) = huber(&problem.residuals(&state));
    Ok((state, cost))
}

/// Predicts the covariance of a problem's parameters at `state`, before its data are
/// measured.
///
/// # Errors
/// If a residual is not finite, or there is none.
pub fn predict_information<P: Problem>(
    problem: &P,
    state: &P::State,
) -> Result<Solution<P::State>, FitError> {
    let count = problem.residuals(state).len();
    let mut foreseen = conclude(problem, state.clone(), vec![true; count])?;
    let jacobian = jacobian(problem, state, count);
    foreseen.covariance = Spectrum::of(&jacobian, problem.resolution())?.covariance(1.0);
    Ok(foreseen)
}

/// Returns ∂r/∂step at a zero step, by central differences.
pub fn jacobian<P: Problem>(problem: &P, state: &P::State, count: usize) -> DMatrix<f64> {
    let parameters = problem.parameters();
    let mut jacobian = DMatrix::zeros(count, parameters);
    for j in 0..parameters {
        let mut step = DVector::zeros(parameters);
        step[j] = problem.difference();
        let ahead = problem.residuals(&problem.moved(state, &step));
        let behind = problem.residuals(&problem.moved(state, &-step));
        jacobian.set_column(j, &((ahead - behind) / (2.0 * problem.difference())));
    }
    jacobian
}

/// Returns the covariance of the parameters at `state` of a robust fit with clustered residuals
/// (Liang & Zeger 1986). Returns the covariance of the parameters at `state` of a robust fit with
/// clustered residuals, A⁻¹ (Σ g gᵀ) A⁻¹ · n/(n − 1) with A = JᵀWJ and the n clusters' gradients g
/// = Σ Jᵢᵀ wᵢ rᵢ (Liang & Zeger 1986). Residuals without a cluster, those of priors, count in A
/// only. Returns `None` if A is singular.
pub fn clustered_covariance<P: Problem>(
    problem: &P,
    state: &P::State,
    cluster: impl Fn(usize) -> Option<usize>,
) -> Option<DMatrix<f64>> {
    let residuals = problem.residuals(state);
    let slopes = jacobian(problem, state, residuals.len());
    let weights = residuals.map(huber_weight);
    let mut weighted = slopes.clone();
    (weighted.row_iter_mut().zip(weights.iter())).for_each(|(mut row, weight)| row *= *weight);
    let inverse = (slopes.transpose() * &weighted).try_inverse()?;
    let mut gradients: BTreeMap<usize, DVector<f64>> = BTreeMap::new();
    for (i, residual) in residuals.iter().enumerate() {
        if let Some(cluster) = cluster(i) {
            let sum = gradients.entry(cluster).or_insert_with(|| DVector::zeros(slopes.ncols()));
            *sum += weighted.row(i).transpose() * *residual;
        }
    }
    let count = gradients.len() as f64;
    let parameters = slopes.ncols();
    let spread = (gradients.values())
        .fold(DMatrix::zeros(parameters, parameters), |sum, g| sum + g * g.transpose());
    Some(&inverse * spread * &inverse * (count / (count - 1.0).max(1.0)))
}

/// Iterates steps until they are negligible. `weigh` returns the weight of each residual and the
/// total cost.
fn settle<P: Problem>(
    problem: &P,
    start: &P::State,
    weigh: impl Fn(&DVector<f64>) -> (DVector<f64>, f64),
) -> Result<P::State, FitError> {
    let mut state = start.clone();
    for _ in 0..STEPS {
        let residuals = problem.residuals(&state);
        let (weights, cost) = weigh(&residuals);
        if !cost.is_finite() {
            return Err(FitError::NotFinite);
        }
        let roots = weights.map(f64::sqrt);
        let mut slopes = jacobian(problem, &state, residuals.len());
        (slopes.row_iter_mut().zip(roots.iter())).for_each(|(mut row, root)| row *= *root);
        let mut step =
            -Spectrum::of(&slopes, problem.resolution())?.solve(&residuals.component_mul(&roots));
        let mut gain = 0.0;
        while step.norm() > SETTLED && gain <= 0.0 {
            let next = problem.moved(&state, &step);
            gain = cost - weigh(&problem.residuals(&next)).1;
            if gain > 0.0 {
                state = next;
            }
            step *= 0.5;
        }
        if gain <= problem.gained() * cost {
            return Ok(state);
        }
    }
    Err(FitError::Unsettled)
}

/// Returns Huber weights and cost; the scatter is the expected one.
fn huber(residuals: &DVector<f64>) -> (DVector<f64>, f64) {
    let weights = residuals.map(huber_weight);
    let costs = residuals.iter().map(|r| match r.abs() <= HUBER {
        true => 0.5 * r * r,
        false => HUBER * (r.abs() - 0.5 * HUBER),
    });
    let cost = costs.sum();
    (weights, cost)
}

/// Returns the Huber weight of a residual, which beyond a limit counts with its absolute value
/// (Huber 1964).
pub fn huber_weight(residual: f64) -> f64 {
    HUBER / residual.abs().max(HUBER)
}

/// Returns weights and cost of the residuals that are used.
fn kept(residuals: &DVector<f64>, used: &[bool]) -> (DVector<f64>, f64) {
    let weights =
        DVector::from_iterator(used.len(), used.iter().map(|&used| f64::from(u8::from(used))));
    let cost = 0.5 * residuals.component_mul(&weights).norm_squared();
    (weights, cost)
}

/// Returns the robust standard deviation of each kind.
fn scatters<P: Problem>(problem: &P, residuals: &DVector<f64>) -> Vec<f64> {
    let kinds = (0..residuals.len()).map(|i| problem.kind(i)).max().map_or(0, |last| last + 1);
    let of = |kind: usize| {
        let all = residuals.iter().enumerate();
        let mut sizes: Vec<f64> =
            all.filter(|(i, _)| problem.kind(*i) == kind).map(|(_, r)| r.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let median = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
        (SD_PER_MAD * median).max(LEAST_SCATTER)
    };
    (0..kinds).map(of).collect()
}

/// Computes covariance and rank of the solution.
fn conclude<P: Problem>(
    problem: &P,
    state: P::State,
    used: Vec<bool>,
) -> Result<Solution<P::State>, FitError> {
    let residuals = problem.residuals(&state);
    if residuals.is_empty() {
        return Err(FitError::Empty);
    }
    let mut slopes = jacobian(problem, &state, residuals.len());
    for (mut row, used) in slopes.row_iter_mut().zip(&used) {
        row *= f64::from(u8::from(*used));
    }
    let spectrum = Spectrum::of(&slopes, problem.resolution())?;
    let squares: f64 =
        residuals.iter().zip(&used).filter(|(_, used)| **used).map(|(r, _)| r * r).sum();
    let count = used.iter().filter(|used| **used).count();
    // With as many data as parameters the scatter cannot be estimated: the expected one is used.
    let variance = match count.checked_sub(spectrum.rank()) {
        Some(freedom) if freedom > 0 => squares / freedom as f64,
        _ => 1.0,
    };
    Ok(Solution {
        covariance: spectrum.covariance(variance),
        undetermined: spectrum.undetermined(),
        condition: spectrum.condition(),
        state,
        residuals,
        used,
    })
}

/// Singular values of a Jacobian with their parameter directions.
struct Spectrum {
    /// Square roots of the eigenvalues of JᵀJ.
    values: DVector<f64>,
    directions: DMatrix<f64>,
    slopes: DMatrix<f64>,
    /// Smallest value of a determined direction.
    least: f64,
}

impl Spectrum {
    fn of(slopes: &DMatrix<f64>, resolution: f64) -> Result<Self, FitError> {
        if slopes.iter().any(|slope| !slope.is_finite()) {
            return Err(FitError::NotFinite);
        }
        let parameters = slopes.ncols();
        // Zero rows complete the decomposition's directions if there are few data.
        let rows = slopes.nrows().max(parameters);
        let svd = slopes
            .clone()
            .resize(rows, parameters, 0.0)
            .try_svd(false, true, f64::EPSILON, 10_000)
            .ok_or(FitError::NotFinite)?;
        let directions = svd.v_t.ok_or(FitError::NotFinite)?.transpose();
        let least = NARROWER.max(resolution * svd.singular_values.max());
        Ok(Self { values: svd.singular_values, directions, slopes: slopes.clone(), least })
    }

    fn counts(&self, i: usize) -> bool {
        self.values[i] >= self.least
    }

    fn rank(&self) -> usize {
        (0..self.values.len()).filter(|&i| self.counts(i)).count()
    }

    /// Returns the smallest step that explains `residuals`, along determined directions only.
    fn solve(&self, residuals: &DVector<f64>) -> DVector<f64> {
        let gradient = self.slopes.transpose() * residuals;
        let mut step = DVector::zeros(self.directions.nrows());
        for i in (0..self.values.len()).filter(|&i| self.counts(i)) {
            let direction = self.directions.column(i);
            step += direction * (direction.dot(&gradient) / self.values[i].powi(2));
        }
        step
    }

    fn covariance(&self, variance: f64) -> DMatrix<f64> {
        let mut covariance = DMatrix::zeros(self.directions.nrows(), self.directions.nrows());
        for i in 0..self.values.len() {
            let direction = self.directions.column(i);
            let along = if self.counts(i) { variance / self.values[i].powi(2) } else { 1.0 };
            covariance += direction * direction.transpose() * along;
        }
        covariance
    }

    fn undetermined(&self) -> Vec<DVector<f64>> {
        let lost = (0..self.values.len()).filter(|&i| !self.counts(i));
        lost.map(|i| self.directions.column(i).into_owned()).collect()
    }

    fn condition(&self) -> f64 {
        let counted = (0..self.values.len()).filter(|&i| self.counts(i)).map(|i| self.values[i]);
        let least = counted.clone().fold(f64::INFINITY, f64::min);
        let greatest = counted.fold(0.0, f64::max);
        if greatest > 0.0 { greatest / least } else { f64::INFINITY }
    }
}
