//! `palpate bench`.

use super::columns::{aligned, cell, duration};
use super::progress::progress_bar;
use super::terminal::{Ending, Talk, print};
use crate::study::bench::{Piece, Timed, pieces, time};
use anyhow::bail;
use serde::Serialize;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate bench                       every piece, in turns, on one thread
  palpate bench likelihood            pieces whose name contains this
  palpate bench --rounds 50 --json    longer, for a program to read

Shares are of what two pieces of the same run reach, a product of matrices and a triad over long
arrays; times are medians over rounds. `palpate check --cost` counts instructions instead.")]
pub(super) struct Args {
    /// Pieces whose name contains this [default: all].
    piece: Option<String>,
    /// Rounds in which each piece is timed once.
    #[arg(long, default_value_t = 15, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    rounds: u16,
    /// Print lines of JSON instead of a table.
    #[arg(long)]
    json: bool,
}

/// A piece as JSON.
#[derive(Serialize)]
struct Record<'a> {
    piece: &'a str,
    time_s: f64,
    gflops: Option<f64>,
    of_product: Option<f64>,
    gbytes: Option<f64>,
    of_stream: Option<f64>,
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let all = pieces();
    let names: Vec<String> = all.iter().map(|piece| piece.name.clone()).collect();
    let wanted = args.piece.as_deref().unwrap_or("");
    let (limits, others) = (2, |piece: &Piece| piece.name.contains(wanted));
    let mut chosen: Vec<Piece> = (all.into_iter().enumerate())
        .filter_map(|(i, piece)| (i < limits || others(&piece)).then_some(piece))
        .collect();
    if chosen.len() == limits && !names.iter().take(limits).any(|name| name.contains(wanted)) {
        bail!("no piece is called `{wanted}`; there are: {}", names.join("; "));
    }
    let bar = progress_bar(talk, "bench", "rounds", args.rounds.into(), 0);
    let timed = time(&mut chosen, args.rounds.into(), || bar.inc(1));
    bar.finish_and_clear();
    let text = if args.json { lines(&timed)? } else { table(&timed) };
    print(text.trim_end())?;
    Ok(Ending::Done)
}

fn lines(timed: &[Timed]) -> anyhow::Result<String> {
    let mut text = String::new();
    for Timed { name, time_s, gflops, of_product, gbytes, of_stream } in timed {
        let [gflops, of_product, gbytes, of_stream] = [*gflops, *of_product, *gbytes, *of_stream];
        let record = Record { piece: name, time_s: *time_s, gflops, of_product, gbytes, of_stream };
        text += &serde_json::to_string(&record)?;
        text.push('\n');
    }
    Ok(text)
}

fn table(timed: &[Timed]) -> String {
    let titles = ["piece", "time", "GFLOP/s", "% of product", "GB/s", "% of triad"];
    let mut table = vec![titles.map(String::from)];
    table.extend(timed.iter().map(|piece| {
        [
            piece.name.clone(),
            duration(piece.time_s),
            cell(piece.gflops, 2),
            cell(piece.of_product.map(|share| 100.0 * share), 0),
            cell(piece.gbytes, 1),
            cell(piece.of_stream.map(|share| 100.0 * share), 0),
        ]
    }));
    aligned(&table)
}
