//! Formatting of values and of parser errors for messages to users.

use std::fmt::Display;

/// Largest number of characters of a value in a message; a heuristic.
const SHOWN_MAX: usize = 60;

/// Formats a value for a message: long numbers in powers of ten, other long values shortened.
pub fn shorten(text: &str) -> String {
    if text.chars().count() <= SHOWN_MAX {
        return text.into();
    }
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => format!("{number:e}"),
        _ => text.chars().take(SHOWN_MAX).chain(['…']).collect(),
    }
}

/// Returns the values that a parser with this error `message` accepts, if known: the message
/// contains Rust types.
pub fn allowed(message: &str) -> Option<String> {
    let (_, expected) = message.rsplit_once("expected ")?;
    let names: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
    if message.starts_with("unknown variant") && !names.is_empty() {
        return Some(names.join(", "));
    }
    let length = |text: &str| text.split(' ').next().and_then(|n| n.parse::<usize>().ok());
    Some(match expected {
        "u8" => format!("a whole number from 0 to {}", u8::MAX),
        "u16" => format!("a whole number from 0 to {}", u16::MAX),
        "u32" => format!("a whole number from 0 to {}", u32::MAX),
        "u64" | "usize" => "a whole number, 0 or more".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        "f32" | "f64" => "a number".into(),
        "a boolean" => "true or false".into(),
        "a string" | "path string" => "text in quotes".into(),
        "a sequence" => "a list in brackets".into(),
        "a map" => "a table".into(),
        "fewer elements in array" => "a shorter list".into(),
        _ if expected.starts_with("struct ") => "a table".into(),
        _ => {
            let count = expected.strip_prefix("an array of length ");
            let count = count.or(expected.strip_prefix("a tuple of size ")).and_then(length)?;
            format!("a list of {count} values")
        }
    })
}

/// Returns the name most similar to `word`, if few typing errors lead from one to the other.
pub fn nearest(word: &str, names: &[String]) -> Option<String> {
    let slips = |name: &String| strsim::damerau_levenshtein(word, name);
    let most = (word.chars().count() / 2).min(2);
    names.iter().min_by_key(|name| slips(name)).filter(|name| slips(name) <= most).cloned()
}

/// Returns the end of a message that suggests the name most similar to `word`, or nothing.
pub fn did_you_mean(word: &str, names: &[String]) -> String {
    nearest(word, names).map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// Formats a count with its regular `noun`, which is given in the singular.
pub fn counted(count: impl Display, noun: &str) -> String {
    let count = count.to_string();
    let ending = match noun {
        _ if count == "1" => "",
        noun if noun.ends_with("ch") || noun.ends_with('s') => "es",
        _ => "s",
    };
    format!("{count} {noun}{ending}")
}

/// Describes the problem of a JSON text, without its place.
pub fn json(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let what = text.split(" at line ").next().unwrap_or_default();
    match (allowed(what), what.rsplit_once("expected ")) {
        (Some(allowed), _) => format!("allowed is {allowed}"),
        (None, Some((before, expected))) if before.starts_with("invalid ") => {
            format!("allowed is {expected}")
        }
        _ => what.into(),
    }
}

/// Returns bytes in hexadecimal, as for hashes.
pub fn hex(bytes: impl AsRef<[u8]>) -> String {
    bytes.as_ref().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noun_agrees_with_its_count() {
        let touches = [0, 1, 2, 11].map(|count| counted(count, "touch"));
        assert_eq!(touches, ["0 touches", "1 touch", "2 touches", "11 touches"]);
        let others = ["trial", "miss", "initial touch"].map(|noun| counted(2, noun));
        assert_eq!(others, ["2 trials", "2 misses", "2 initial touches"]);
        assert_eq!(counted(1, "miss"), "1 miss");
    }

    #[test]
    fn the_nearest_name_is_suggested_if_it_is_near() {
        let names = ["slope", "sobol", "active"].map(String::from);
        assert_eq!(did_you_mean("slop", &names), "; did you mean `slope`?");
        assert_eq!(did_you_mean("entropy", &names), "");
    }
}
