//! A check drawn: each measure's change with its interval, and what is tolerated.

use super::lines::word;
use crate::report::canvas::{Anchor, Area, Canvas};
use crate::report::style;
use crate::report::style::{FAINT_INK, GRID, INK, SMALL_PX, TEXT_PX};
use crate::study::check::{Held, Rules, Verdict};

const LEFT_PX: f64 = 300.0;
const WIDTH_PX: f64 = 360.0;
const RIGHT_PX: f64 = 90.0;
const TOP_PX: f64 = 46.0;
const LINE_PX: f64 = 22.0;

/// The axis reaches from −4 to 4 tolerances; what lies beyond is cut off there.
const REACH: f64 = 4.0;

/// Draws it.
pub fn draw(name: &str, held: &Held, rules: &Rules) -> String {
    let lines: usize = held.planners.iter().map(|planner| planner.judgements.len().max(1)).sum();
    let height = TOP_PX + lines as f64 * LINE_PX + 40.0;
    let mut canvas = Canvas::new(LEFT_PX + WIDTH_PX + RIGHT_PX, height);
    let bottom = height - 34.0;
    let at = |share: f64| LEFT_PX + WIDTH_PX * (0.5 + 0.5 * (share / REACH).clamp(-1.0, 1.0));
    canvas.text(
        [LEFT_PX + 0.5 * WIDTH_PX, 20.0],
        &format!("{name}: {}", word(held.verdict())),
        TEXT_PX,
        Anchor::Middle,
    );
    let tolerated = Area {
        left: at(-1.0),
        top: TOP_PX - 10.0,
        width: at(1.0) - at(-1.0),
        height: bottom - TOP_PX + 10.0,
    };
    canvas.rect(tolerated, &style::fill(GRID, 0.6));
    canvas.line([[at(0.0), TOP_PX - 10.0], [at(0.0), bottom]], &style::stroke(FAINT_INK, 1.0));
    let mut y = TOP_PX + 4.0;
    for planner in &held.planners {
        let colour = style::planner(&[], &planner.name);
        if planner.judgements.is_empty() {
            canvas.text([LEFT_PX - 10.0, y + 4.0], &planner.name, SMALL_PX, Anchor::End);
            let words = format!("{}, {} trials", word(planner.verdict), planner.trials);
            canvas.text([at(0.0) + 8.0, y + 4.0], &words, SMALL_PX, Anchor::Start);
            y += LINE_PX;
        }
        for judgement in &planner.judgements {
            let words = format!("{}, {}", planner.name, judgement.judged.title);
            canvas.text([LEFT_PX - 10.0, y + 4.0], &words, SMALL_PX, Anchor::End);
            let allowed = judgement.judged.allowed(rules.tolerance);
            let [low, high] = judgement.sequence.interval.map(|end| at(end / allowed));
            canvas.line([[low, y], [high, y]], &style::stroke(colour, 2.0));
            canvas.circle(
                [at(judgement.sequence.mean / allowed), y],
                4.0,
                &style::fill(colour, 1.0),
            );
            let ink = if judgement.verdict >= Verdict::Undecided { INK } else { FAINT_INK };
            let right = [LEFT_PX + WIDTH_PX + 8.0, y + 4.0];
            canvas.coloured_text(right, word(judgement.verdict), SMALL_PX, Anchor::Start, ink);
            y += LINE_PX;
        }
    }
    let percent = 100.0 * rules.tolerance;
    for (share, words) in
        [(-1.0, format!("−{percent} %")), (0.0, "as it was".into()), (1.0, format!("+{percent} %"))]
    {
        canvas.text([at(share), bottom + 14.0], &words, SMALL_PX, Anchor::Middle);
    }
    canvas.text([at(0.0), bottom + 29.0], "less is better", SMALL_PX, Anchor::Middle);
    canvas.finish()
}
