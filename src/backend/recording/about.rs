//! What a recording is of, and how what it recorded ended: the records of metadata in its file.

use super::error::RecordingError;
use crate::backend::Capabilities;
use std::collections::BTreeMap;
use std::str::FromStr;

/// What a recording is of.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Of the program that wrote it.
    pub version: String,
    /// The experiment with every default written out, as TOML.
    pub experiment: String,
    /// The planner's name.
    pub planner: String,
    /// The trial's number.
    pub trial: u32,
    /// What the body was reset with.
    pub seed: u64,
    /// What the body can do.
    pub capabilities: Capabilities,
}

/// How what was recorded ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ending {
    /// Why it ended before its last touch, if it did.
    pub failure: Option<String>,
    /// Whether it was interrupted from outside after a touch, so that it can be continued.
    pub is_interrupted: bool,
}

/// Texts by name, as metadata holds them.
pub(super) type Texts = BTreeMap<String, String>;

/// Name of the metadata that an [`About`] is written to.
pub(super) const ABOUT: &str = "palpate";

/// Name of the metadata that an [`Ending`] is written to.
pub(super) const ENDING: &str = "palpate_ending";

const FAILURE: &str = "failure";
const INTERRUPTED: &str = "interrupted";

impl About {
    pub(super) fn texts(&self) -> Texts {
        // Names and numbers always have a JSON.
        let capabilities = serde_json::to_string(&self.capabilities).unwrap_or_default();
        let texts = [
            ("version", self.version.clone()),
            ("resolved.toml", self.experiment.clone()),
            ("planner", self.planner.clone()),
            ("trial", self.trial.to_string()),
            ("seed", self.seed.to_string()),
            ("capabilities", capabilities),
        ];
        texts.into_iter().map(|(name, text)| (name.to_owned(), text)).collect()
    }

    pub(super) fn of(texts: &Texts) -> Result<Self, RecordingError> {
        Ok(Self {
            version: text(texts, "version")?.into(),
            experiment: text(texts, "resolved.toml")?.into(),
            planner: text(texts, "planner")?.into(),
            trial: number(texts, "trial")?,
            seed: number(texts, "seed")?,
            capabilities: serde_json::from_str(text(texts, "capabilities")?)
                .map_err(|_| bad(texts, "capabilities"))?,
        })
    }
}

impl Ending {
    pub(super) fn texts(&self) -> Texts {
        let failure = self.failure.iter().map(|failure| (FAILURE, failure.clone()));
        let interrupted = self.is_interrupted.then(|| (INTERRUPTED, true.to_string()));
        failure.chain(interrupted).map(|(name, text)| (name.to_owned(), text)).collect()
    }

    pub(super) fn of(texts: &Texts) -> Self {
        let is_interrupted = texts.contains_key(INTERRUPTED);
        Self { failure: texts.get(FAILURE).cloned(), is_interrupted }
    }
}

fn text<'a>(texts: &'a Texts, name: &'static str) -> Result<&'a str, RecordingError> {
    texts.get(name).map(String::as_str).ok_or_else(|| bad(texts, name))
}

fn number<T: FromStr>(texts: &Texts, name: &'static str) -> Result<T, RecordingError> {
    text(texts, name)?.parse().map_err(|_| bad(texts, name))
}

fn bad(texts: &Texts, name: &'static str) -> RecordingError {
    RecordingError::About { name, found: texts.get(name).cloned() }
}
