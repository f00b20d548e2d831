//! A share of touches, and how well it is known.

/// Half of what a 95 % interval leaves out.
const TAIL: f64 = 0.025;

/// What is this close to a whole number is one; chosen, far above rounding.
const ROUNDING: f64 = 1e-9;

/// So many of so many touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Those counted.
    pub count: usize,
    /// All of them.
    pub of: usize,
    /// The share's 95 % interval.
    pub interval: [f64; 2],
}

impl Share {
    /// Of the touches of several trials; none without any.
    ///
    /// The interval is Clopper's and Pearson's (1934) of as many independent touches as tell as
    /// much: touches of one trial are alike, and n of them count as n over the ratio of the share's
    /// variance between trials to that of independent touches (Korn and Graubard 1998).
    pub fn of(trials: &[Vec<bool>]) -> Option<Self> {
        let of = trials.iter().map(Vec::len).sum::<usize>();
        let count_of = |trial: &[bool]| trial.iter().filter(|is_counted| **is_counted).count();
        let count = trials.iter().map(|trial| count_of(trial)).sum::<usize>();
        let (n, share) = (of as f64, count as f64 / of as f64);
        let independent = share * (1.0 - share) / (n - 1.0);
        // Of a ratio: a trial has as many touches as it has.
        let squares = trials.iter().map(|trial| {
            let off = count_of(trial) as f64 - share * trial.len() as f64;
            (off / n).powi(2)
        });
        let k = trials.len() as f64;
        let between = squares.sum::<f64>() * k / (k - 1.0);
        let ratio = between / independent;
        let alike = if ratio.is_finite() { ratio.max(1.0) } else { 1.0 };
        let counted = n / alike;
        // Parts of a touch are left out where that makes the interval wider.
        let [all, few, many] = [
            (counted + ROUNDING).floor(),
            (share * counted + ROUNDING).floor(),
            (share * counted - ROUNDING).ceil(),
        ];
        let interval = [lower(few, all), 1.0 - lower(all - many, all)];
        (of > 0).then_some(Self { count, of, interval })
    }
}

/// The share at which `k` or more of `n` come about with [`TAIL`]'s probability.
fn lower(k: f64, n: f64) -> f64 {
    let (mut low, mut high) = (0.0, if k > 0.0 { k / n } else { 0.0 });
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_least(k, n, middle) < TAIL {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Probability of `k` or more of `n`, each with probability `p`.
fn at_least(k: f64, n: f64, p: f64) -> f64 {
    let odds = p / (1.0 - p);
    let mut log = n * (1.0 - p).ln();
    let mut below = 0.0;
    for i in 0..k as u32 {
        below += log.exp();
        log += ((n - f64::from(i)) / f64::from(i + 1) * odds).ln();
    }
    1.0 - below
}
