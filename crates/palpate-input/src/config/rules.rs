//! What values may be: written once, used for the check and for the message.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;

/// Checks values against what is allowed and keeps the first violation.
#[derive(Default)]
pub struct Rules {
    prefix: String,
    /// The first violation: the key, the value found, what is allowed.
    pub(super) violation: Option<(String, String, String)>,
    /// What is allowed under each key, if that is asked for.
    record: Option<BTreeMap<String, String>>,
}

impl Rules {
    /// What is allowed under each key of `checked`, as messages say it: ranges and names, not what
    /// one key demands of another.
    pub fn of(checked: &impl Checked) -> BTreeMap<String, String> {
        let mut rules = Self { record: Some(BTreeMap::new()), ..Self::default() };
        checked.check(&mut rules);
        rules.record.unwrap_or_default()
    }

    /// Whether `checked` breaks none.
    pub fn hold(checked: &impl Checked) -> bool {
        let mut rules = Self::default();
        checked.check(&mut rules);
        rules.violation.is_none()
    }

    fn note(&mut self, key: &str, allowed: impl FnOnce() -> String) {
        if let Some(record) = &mut self.record {
            record.insert(format!("{}{key}", self.prefix), allowed());
        }
    }

    /// `key` must be a number in `allowed`; NaN never is.
    pub fn number(&mut self, key: &str, value: f64, allowed: RangeInclusive<f64>) {
        let described = || format!("{} to {}", allowed.start(), allowed.end());
        self.note(key, described);
        self.require(key, value, allowed.contains(&value), described);
    }

    /// As [`number`](Self::number), of a key that may be left out.
    pub fn given(&mut self, key: &str, value: Option<f64>, allowed: RangeInclusive<f64>) {
        if let Some(value) = value {
            self.number(key, value, allowed);
        }
    }

    /// Each entry of `key` must be a number in `allowed`.
    pub fn numbers(&mut self, key: &str, values: &[f64], allowed: RangeInclusive<f64>) {
        for (i, &value) in values.iter().enumerate() {
            self.number(&format!("{key}[{i}]"), value, allowed.clone());
        }
    }

    /// `key` must be an interval [smallest, largest] within `allowed`.
    pub fn interval(&mut self, key: &str, [low, high]: [f64; 2], allowed: RangeInclusive<f64>) {
        self.numbers(key, &[low, high], allowed);
        self.require(key, format!("[{low}, {high}]"), low < high, || {
            "the smaller number first, then a larger one".into()
        });
    }

    /// `key` must be one of `names`.
    pub fn one_of(&mut self, key: &str, value: &str, names: &[&str]) {
        self.note(key, || names.join(", "));
        let known = names.contains(&value);
        self.require(key, format!("\"{value}\""), known, || format!("one of {}", names.join(", ")));
    }

    /// `key` with `value` must hold `condition`; if it does not, `allowed` says what would.
    pub fn require(
        &mut self,
        key: &str,
        value: impl fmt::Display,
        condition: bool,
        allowed: impl FnOnce() -> String,
    ) {
        if !condition && self.violation.is_none() {
            self.violation = Some((format!("{}{key}", self.prefix), value.to_string(), allowed()));
        }
    }

    /// Checks the table under `key`.
    pub fn table(&mut self, key: &str, checked: &impl Checked) {
        let outer = self.prefix.len();
        self.prefix += key;
        self.prefix.push('.');
        checked.check(self);
        self.prefix.truncate(outer);
    }
}

/// A configuration that knows what its values may be.
pub trait Checked {
    /// Applies every rule to `rules`.
    fn check(&self, rules: &mut Rules);
}
