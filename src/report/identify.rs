//! Sentences of an identification.

use super::recognition::title;
use crate::experiment::metrics::recognition::{NONE, RecognitionMetrics};
use crate::study::identify::IdentifyResult;
use palpate_explore::recognition::RecordedObject;
use palpate_gp::math::pose::parts;
use palpate_input::format::counted;

/// Number of hypotheses in a line.
const LISTED: usize = 3;

/// Returns the likeliest hypotheses after a touch.
pub fn line(count: u32, found: &RecognitionMetrics) -> String {
    let mut likely: Vec<(&String, &f64)> = found.probabilities.iter().collect();
    likely.sort_by(|a, b| b.1.total_cmp(a.1));
    let likely = likely.iter().take(LISTED).map(|(name, p)| format!("{} {p:.3}", title(name)));
    format!("touch {count:>2}: {}", likely.collect::<Vec<_>>().join(", "))
}

/// Returns what is there, where, how sure, after how many touches.
pub fn conclusion(result: &IdentifyResult) -> String {
    let IdentifyResult { touches, found, is_sure } = result;
    let touches = counted(*touches, "touch");
    let confidence = found.confidence();
    if !*is_sure {
        return format!(
            "undecided after {touches}: most likely {} ({confidence:.3})",
            title(&found.object)
        );
    }
    if found.object == NONE {
        return format!(
            "none of the library's objects ({confidence:.3}), after {touches}; explore its shape with \
             palpate run"
        );
    }
    let pose = &found.pose;
    let mut text = format!(
        "{} ({confidence:.3}), after {touches}\nposition_m = [{}]\nrotation_deg = [{}]\nits surface is \
         there within {:.1} mm on average (95 %)",
        found.object,
        numbers(&pose.position_m, 4),
        numbers(&pose.rotation_deg, 1),
        1e3 * pose.distance_95_m
    );
    if let Some(error) = &found.error {
        let is_right = if error.hypothesis == found.object { "right" } else { "wrong" };
        text += &format!("\n{is_right}: the object is {}", error.object);
        if let Some(distance_m) = error.distance_m {
            text += &format!(", its surface {:.2} mm off", 1e3 * distance_m);
        }
    }
    text
}

/// Returns the objects with their probabilities, and pose and errors of the likeliest, after
/// `count` recorded contacts.
pub fn recorded(found: &[(String, RecordedObject)], count: usize) -> String {
    let likely: Vec<String> = (found.iter())
        .take(RECORDED)
        .map(|(name, it)| format!("{name} {:.3}", it.probability))
        .collect();
    let others = found.len().saturating_sub(RECORDED);
    let others = if others > 0 { format!(", {others} others") } else { String::new() };
    let head = format!("{}: {}{others}", counted(count, "contact"), likely.join(", "));
    let Some((name, best)) = found.first() else { return head };
    let (position_m, rotation_deg) = parts(&best.x_wo);
    let errors = &best.errors;
    let fits = match errors.is_plausible() {
        true => "",
        false => {
            "\nnone of the objects fits the contacts: they err by too much; check the unit and the frame"
        }
    };
    format!(
        "{head}\n{name}: contacts lie {:.1} mm from its surface on average, {:.1} mm outside in common; \
         each errs by {:.1} mm (standard deviation, learned)\nposition_m = [{}]\nrotation_deg = \
         [{}]\nits surface is there within {:.1} mm on average (95 %){fits}",
        1e3 * errors.distance_m,
        1e3 * errors.offset_m,
        1e3 * errors.sd_m,
        numbers(&position_m, 4),
        numbers(&rotation_deg, 1),
        1e3 * best.distance_95_m
    )
}

/// Number of objects of a library that are named.
const RECORDED: usize = 10;

fn numbers(values: &[f64], decimals: usize) -> String {
    let each = values.iter().map(|value| format!("{value:.decimals$}"));
    each.collect::<Vec<_>>().join(", ")
}
