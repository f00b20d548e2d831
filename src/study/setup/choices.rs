//! Unit and up axis of a mesh, each with the evidence for it. If the evidence is ambiguous, the
//! user is asked if possible; otherwise the most plausible value is taken and named as a guess.

use crate::sim::placement::{self, USUAL_UNITS, UpAxis};
use crate::sim::scene::Unit;
use clap::ValueEnum;
use palpate_geometry::import::FileStatements;
use palpate_geometry::mesh::Mesh;

/// Value with the evidence for it.
pub struct Choice<T> {
    pub(super) value: T,
    pub(super) evidence: String,
}

/// Way to settle an ambiguous value.
#[derive(Clone, Copy)]
pub struct Asker<'a> {
    /// Returns the index that the user selects among choices for a question; `None` if the user
    /// cannot be asked or does not answer.
    pub choose: &'a dyn Fn(&str, &[&str]) -> Option<usize>,
    /// Prints a note.
    pub note: &'a dyn Fn(&str),
}

impl Asker<'_> {
    /// Returns the value that the user selects among `choices` (values and their descriptions), and
    /// whether it was confirmed; `None` if there are none. The first is the default. A default that
    /// is not confirmed is a guess: the note `why` says so.
    fn choose<T: Copy>(self, what: &str, choices: &[(T, String)], why: &str) -> Option<(T, bool)> {
        let default = choices.first()?.0;
        let words: Vec<&str> = choices.iter().map(|(_, words)| words.as_str()).collect();
        if let Some((value, _)) = (self.choose)(what, &words).and_then(|index| choices.get(index)) {
            return Some((*value, true));
        }
        (self.note)(why);
        Some((default, false))
    }
}

/// Formats a length with a suitable unit.
fn length(length_m: f64) -> String {
    let digits = |value: f64| {
        let decimals = (2.0 - value.abs().log10().floor()).clamp(0.0, 6.0) as usize;
        let text = format!("{value:.decimals$}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    };
    match length_m {
        length_m if length_m >= 1.0 => format!("{} m", digits(length_m)),
        length_m => format!("{} mm", digits(1e3 * length_m)),
    }
}

/// Returns the name of a unit in a sentence, where "in" would be read as a word.
pub fn label(unit: Unit) -> String {
    if unit == Unit::In { "inch".into() } else { unit.to_string() }
}

/// Describes the size in each unit: "as mm 80 mm, as inch 2.03 m".
fn sizes(extent: f64, units: impl IntoIterator<Item = Unit>) -> String {
    let sizes = units
        .into_iter()
        .map(|unit| format!("as {} {}", label(unit), length(extent * unit.metres_per_unit())));
    sizes.collect::<Vec<_>>().join(", ")
}

/// Returns the unit of a mesh, and the factor that makes it explorable if no unit does. `extent` is
/// the largest in the file's numbers; `is_stl` for a format in which millimetres are usual.
pub fn unit(
    extent: f64,
    is_stl: bool,
    given: Option<Unit>,
    stated: &FileStatements,
    asker: Asker<'_>,
) -> Choice<(Unit, f64)> {
    let all = || sizes(extent, USUAL_UNITS);
    let named = stated.metres_per_unit.as_ref().and_then(|stated| {
        let is_same = |unit: &&Unit| unit.metres_per_unit() == stated.value;
        let unit = Unit::value_variants().iter().find(is_same)?;
        Some((*unit, stated.words.clone()))
    });
    let known = given.map(|unit| (unit, format!("--unit {}", label(unit)))).or(named);
    if let Some((unit, evidence)) = known {
        let size_m = extent * unit.metres_per_unit();
        let scale = placement::explorable_scale(size_m);
        if scale != 1.0 {
            (asker.note)(&format!(
                "in {} ({evidence}) the object measures {}, and a finger explores {}: use another --unit \
                 ({}), or set object.scale = {scale} in the scene for a model of it",
                label(unit),
                length(size_m),
                explorable(),
                all()
            ));
        }
        return Choice { value: (unit, 1.0), evidence };
    }
    let plausible = placement::plausible_units(extent, is_stl);
    match plausible[..] {
        [] => {
            let unit = Unit::M;
            let scale = placement::explorable_scale(extent * unit.metres_per_unit());
            (asker.note)(&format!(
                "the unit is unknown: no usual one gives a size of {} ({}); the mesh is scaled to {}; if \
                 you know the unit, name it, as in --unit mm",
                explorable(),
                all(),
                length(extent * scale)
            ));
            Choice { value: (unit, scale), evidence: "unknown, scaled".into() }
        }
        [unit] => {
            let evidence = match is_stl && unit == Unit::Mm {
                true => format!("usual in STL files ({})", all()),
                false => {
                    format!("the only usual one for an object of {} ({})", explorable(), all())
                }
            };
            Choice { value: (unit, 1.0), evidence }
        }
        [unit, other, ..] => {
            let both = sizes(extent, plausible.iter().copied());
            let why = format!(
                "the unit is a guess: the file states none, and several are plausible ({both}); {} is \
                 taken; if that is wrong, use for example --unit {}",
                label(unit),
                label(other)
            );
            let size = |unit: &Unit| length(extent * unit.metres_per_unit());
            let choices =
                plausible.iter().map(|unit| (*unit, format!("{}: {}", label(*unit), size(unit))));
            let choices: Vec<_> = choices.collect();
            let (unit, is_confirmed) = asker
                .choose("Unit of the file, and largest side of the object", &choices, &why)
                .unwrap_or((unit, false));
            Choice { value: (unit, 1.0), evidence: evidence(is_confirmed, &both) }
        }
    }
}

/// Describes the evidence for a value among several.
fn evidence(is_confirmed: bool, all: &str) -> String {
    match is_confirmed {
        true => "your answer".into(),
        false => format!("a guess ({all})"),
    }
}

fn explorable() -> String {
    let [low, high] = placement::EXPLORABLE_M;
    format!("{} to {}", length(low), length(high))
}

/// Returns the up axis of a mesh in the frame of its file.
///
/// The evidence, in this order: the option, the file, the only plane of the file that the object
/// stands on, a flat base, the most stable pose. Otherwise the most stable of y and z is a guess.
pub fn up(
    mesh: &Mesh,
    given: Option<UpAxis>,
    stated: &FileStatements,
    asker: Asker<'_>,
) -> Choice<UpAxis> {
    if let Some(up) = given {
        return Choice { value: up, evidence: format!("--up {}", name(&up)) };
    }
    let all = UpAxis::value_variants();
    let named = stated.up.as_ref().and_then(|stated| {
        let is_same = |up: &&UpAxis| up.direction() == stated.value;
        Some((*all.iter().find(is_same)?, stated.words.clone()))
    });
    if let Some((value, evidence)) = named {
        return Choice { value, evidence };
    }
    let ground = placement::ground_axes(mesh);
    if let [value] = ground[..] {
        let evidence = format!("it stands on the plane {} = 0 of its file", name(&value));
        return Choice { value, evidence };
    }
    if let Some((value, share)) = placement::resting_axis(mesh) {
        let percent = 100.0 * share;
        let evidence = format!("it rests on a flat base ({percent:.0} % of its underside)");
        return Choice { value, evidence };
    }
    let axes = if ground.is_empty() { all } else { &ground[..] };
    if let Some((value, stable_deg)) = placement::stable_axis(mesh, axes) {
        let evidence = format!("its most stable pose, which a tilt of {stable_deg:.0} deg upsets");
        return Choice { value, evidence };
    }
    let stable_deg = |up: UpAxis| placement::stability_deg(mesh, up);
    let (usual, other) = match stable_deg(UpAxis::Y) > stable_deg(UpAxis::Z) {
        true => (UpAxis::Y, UpAxis::Z),
        false => (UpAxis::Z, UpAxis::Y),
    };
    let why = format!(
        "the up axis is a guess: the file states none, and neither a flat base nor stability decides; {} \
         is taken; if the object lies on its side in the picture, use for example --up {}",
        name(&usual),
        name(&other)
    );
    let size_m = mesh.bounds().1 - mesh.bounds().0;
    let rest = all.iter().copied().filter(|up| *up != usual && *up != other);
    let choices: Vec<(UpAxis, String)> = [usual, other]
        .into_iter()
        .chain(rest)
        .map(|up| {
            let share = size_m.dot(&up.direction()).abs() / size_m.max();
            let height =
                format!("{} up: {:.0} % of its longest side high", name(&up), 100.0 * share);
            (up, height)
        })
        .collect();
    let (value, is_confirmed) =
        asker.choose("Up axis of the file", &choices, &why).unwrap_or((usual, false));
    Choice { value, evidence: evidence(is_confirmed, "the more stable of y and z") }
}

/// Returns the command-line name of a value.
pub fn name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_three_digits_and_a_suitable_unit() {
        for (length_m, words) in [
            (0.08, "80 mm"),
            (2.032, "2.03 m"),
            (0.0004, "0.4 mm"),
            (1234.0, "1234 m"),
            (0.12345, "123 mm"),
            (1.0, "1 m"),
            (2e-9, "0.000002 mm"),
        ] {
            assert_eq!(length(length_m), words);
        }
    }
}
