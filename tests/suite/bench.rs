//! Tests of the benchmarks' workloads and of their shares of the machine's limits.

#[path = "../../benches/common/pieces/mod.rs"]
#[allow(dead_code)]
mod pieces;

use pieces::timing::time;
use pieces::{Piece, pieces};
use std::collections::HashSet;

#[test]
fn every_piece_runs_and_has_a_name_of_its_own() {
    let mut all = pieces();
    let names: HashSet<String> = all.iter().map(|piece| piece.name.clone()).collect();
    assert_eq!(names.len(), all.len());
    assert!(all.len() > 15);
    all.iter_mut().for_each(|piece| (piece.run)());
}

/// Twice the operations in the same time is twice the share; without operations there is no share.
#[test]
fn shares_are_rates_over_those_of_the_limits() {
    let work = || {
        let sum = (0..10_000).map(|i| f64::from(std::hint::black_box(i))).sum::<f64>();
        std::hint::black_box(sum);
    };
    let piece =
        |name: &str, flops, bytes| Piece { name: name.into(), flops, bytes, run: Box::new(work) };
    let mut all =
        [piece("a", 1e4, 0.0), piece("b", 0.0, 1e5), piece("c", 2e4, 5e4), piece("d", 0.0, 0.0)];
    let timed = time(&mut all, 5);
    assert_eq!((timed[0].of_peak, timed[1].of_stream), (Some(1.0), Some(1.0)));
    let rate = |flops: f64| 1e-9 * flops / timed[2].time_s;
    let near = |a: Option<f64>, b: f64| (a.unwrap() / b - 1.0).abs() < 1e-9;
    assert!(near(timed[2].gflops, rate(2e4)) && near(timed[2].gbytes, rate(5e4)));
    assert!(timed[2].of_peak > Some(0.0) && timed[2].of_stream > Some(0.0));
    assert_eq!((timed[3].gflops, timed[3].of_peak), (None, None));
    assert_eq!((timed[3].gbytes, timed[3].of_stream), (None, None));
}
