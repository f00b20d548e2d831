//! Validation rules: defined once, used for the check and for the message.

use crate::format;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;

/// Checks values against the rules and keeps the first violation.
#[derive(Default)]
pub struct Rules {
    prefix: String,
    /// First violation: key, value found, allowed values.
    pub(super) violation: Option<(String, String, String)>,
    /// Allowed values of each key, if they are recorded.
    record: Option<BTreeMap<String, String>>,
}

impl Rules {
    /// Returns the allowed values of each key of `checked`, as in messages: ranges and names, not
    /// constraints between keys.
    pub fn allowed_values(checked: &impl Validate) -> BTreeMap<String, String> {
        let mut rules = Self { record: Some(BTreeMap::new()), ..Self::default() };
        checked.check(&mut rules);
        rules.record.unwrap_or_default()
    }

    /// Returns key, value and allowed values of the first violation in `checked`.
    pub fn first_violation(checked: &impl Validate) -> Option<(String, String, String)> {
        let mut rules = Self::default();
        checked.check(&mut rules);
        rules.violation
    }

    /// Whether `checked` satisfies all rules.
    pub fn is_satisfied(checked: &impl Validate) -> bool {
        Self::first_violation(checked).is_none()
    }

    fn note(&mut self, key: &str, allowed: impl FnOnce() -> String) {
        if let Some(record) = &mut self.record {
            record.insert(format!("{}{key}", self.prefix), allowed());
        }
    }

    /// Requires `key` to be a number in `allowed`; NaN is never allowed.
    pub fn number(&mut self, key: &str, value: f64, allowed: RangeInclusive<f64>) {
        let described = || format!("{} to {}", allowed.start(), allowed.end());
        self.note(key, described);
        self.require(key, value, allowed.contains(&value), described);
    }

    /// Checks an optional key like [`number`](Self::number).
    pub fn optional_number(&mut self, key: &str, value: Option<f64>, allowed: RangeInclusive<f64>) {
        if let Some(value) = value {
            self.number(key, value, allowed);
        }
    }

    /// Requires each entry of `key` to be a number in `allowed`.
    pub fn numbers(&mut self, key: &str, values: &[f64], allowed: RangeInclusive<f64>) {
        for (i, &value) in values.iter().enumerate() {
            self.number(&format!("{key}[{i}]"), value, allowed.clone());
        }
    }

    /// Requires `key` to be an interval [smallest, largest] within `allowed`.
    pub fn interval(&mut self, key: &str, [low, high]: [f64; 2], allowed: RangeInclusive<f64>) {
        self.numbers(key, &[low, high], allowed);
        self.require(key, format!("[{low}, {high}]"), low < high, || {
            "the smaller number first, then a larger one".into()
        });
    }

    /// Requires `key` to be one of `names`.
    pub fn one_of(&mut self, key: &str, value: &str, names: &[&str]) {
        self.note(key, || names.join(", "));
        let known = names.contains(&value);
        self.require(key, format!("\"{value}\""), known, || {
            let known: Vec<String> = names.iter().map(|name| (*name).into()).collect();
            format!("one of {}{}", names.join(", "), format::did_you_mean(value, &known))
        });
    }

    /// Requires `condition` for `key` with `value`; if violated, `allowed` describes the
    /// allowed values.
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

    /// Validates the table under `key`.
    pub fn table(&mut self, key: &str, checked: &impl Validate) {
        let outer = self.prefix.len();
        self.prefix += key;
        self.prefix.push('.');
        checked.check(self);
        self.prefix.truncate(outer);
    }
}

/// A configuration with validation rules.
pub trait Validate {
    /// Applies every rule to `rules`.
    fn check(&self, rules: &mut Rules);
}
