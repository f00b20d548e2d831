//! Timing of pieces in turns, so that other load affects all alike.

use super::Piece;
use std::time::Instant;

// heuristic: least time of a sample, far above a clock's tick.
const SAMPLE_S: f64 = 2e-3;

/// Timing of one piece.
#[derive(Clone, Debug, PartialEq)]
pub struct Timed {
    /// Name of the piece.
    pub name: String,
    /// Median time of one execution.
    pub time_s: f64,
    /// Operations in a second, 1e9; `None` if they are not counted.
    pub gflops: Option<f64>,
    /// Fraction of the first piece's operations in a second, median over rounds.
    pub of_peak: Option<f64>,
    /// Bytes in a second, 1e9; `None` if they are not counted.
    pub gbytes: Option<f64>,
    /// Fraction of the second piece's bytes in a second, median over rounds.
    pub of_stream: Option<f64>,
}

/// Times all pieces in each of `rounds`, relative to the first two.
pub fn time(pieces: &mut [Piece], rounds: usize) -> Vec<Timed> {
    let counts: Vec<usize> = pieces.iter_mut().map(calibrated).collect();
    let mut samples_s = vec![Vec::with_capacity(rounds); pieces.len()];
    for _ in 0..rounds {
        for ((piece, count), samples_s) in pieces.iter_mut().zip(&counts).zip(&mut samples_s) {
            samples_s.push(seconds(piece, *count) / *count as f64);
        }
    }
    let rates = |of: fn(&Piece) -> f64, i: usize| -> Vec<f64> {
        pieces.get(i).map_or(vec![], |piece| samples_s[i].iter().map(|s| of(piece) / s).collect())
    };
    let share = |of: fn(&Piece) -> f64, i: usize, limit: usize| {
        let (own, limits) = (rates(of, i), rates(of, limit));
        median(own.iter().zip(&limits).map(|(own, limit)| own / limit).collect())
    };
    let flops: fn(&Piece) -> f64 = |piece| piece.flops;
    let bytes: fn(&Piece) -> f64 = |piece| piece.bytes;
    (pieces.iter().enumerate())
        .map(|(i, piece)| {
            let counts = |number: f64| number > 0.0;
            Timed {
                name: piece.name.clone(),
                time_s: median(samples_s[i].clone()),
                gflops: counts(piece.flops).then(|| 1e-9 * median(rates(flops, i))),
                of_peak: counts(piece.flops).then(|| share(flops, i, 0)),
                gbytes: counts(piece.bytes).then(|| 1e-9 * median(rates(bytes, i))),
                of_stream: counts(piece.bytes).then(|| share(bytes, i, 1)),
            }
        })
        .collect()
}

/// Returns the number of repetitions of a piece in a sample.
fn calibrated(piece: &mut Piece) -> usize {
    let mut count = 1;
    while seconds(piece, count) < SAMPLE_S {
        count *= 2;
    }
    count
}

fn seconds(piece: &mut Piece, count: usize) -> f64 {
    let begun = Instant::now();
    (0..count).for_each(|_| (piece.run)());
    begun.elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
