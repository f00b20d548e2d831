//! Efficiency of each piece of a trial relative to the machine, on one thread: its operations and
//! bytes in a second, as fractions of those of multiply-adds in registers and of a triad over long
//! arrays. Pieces are timed in turns, so that other load affects all alike; numbers are medians
//! over rounds.
//!
//! `cargo bench --bench limits -- PART` times the pieces whose name contains PART.

#[path = "common/pieces/mod.rs"]
#[allow(dead_code)]
mod pieces;

use pieces::{pieces, timing};

const ROUNDS: usize = 15;

/// Number of reference pieces of the machine, which come first.
const LIMITS: usize = 2;

fn main() {
    let part = std::env::args().skip(1).find(|it| !it.starts_with('-')).unwrap_or_default();
    let all = pieces().into_iter().enumerate();
    let mut timed: Vec<_> = all
        .filter_map(|(i, piece)| (i < LIMITS || piece.name.contains(&part)).then_some(piece))
        .collect();
    println!(
        "{:<52} {:>10} {:>9} {:>12} {:>8} {:>10}",
        "piece", "time us", "GFLOP/s", "% of peak", "GB/s", "% of triad"
    );
    let cell =
        |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:.digits$}"));
    for it in timing::time(&mut timed, ROUNDS) {
        println!(
            "{:<52} {:>10.1} {:>9} {:>12} {:>8} {:>10}",
            it.name,
            1e6 * it.time_s,
            cell(it.gflops, 2),
            cell(it.of_peak.map(|share| 100.0 * share), 0),
            cell(it.gbytes, 1),
            cell(it.of_stream.map(|share| 100.0 * share), 0)
        );
    }
}
