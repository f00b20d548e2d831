//! Tip for a setting that is given as an option.

use super::terminal::quoted;
use crate::report::reference::is_setting;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::ffi::OsString;

/// Suggests `--set KEY=VALUE` in the error of an unknown option that is named like a setting;
/// `program` is the command parser, `arguments` those of the process.
pub(super) fn with_setting_tip(
    mut error: clap::Error,
    program: &clap::Command,
    arguments: &[OsString],
) -> clap::Error {
    if let Some(tip) = tip(&error, program, arguments) {
        // A similar option would mislead.
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::Usage);
        let tips = vec![StyledStr::from(tip)];
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips));
    }
    error
}

fn tip(error: &clap::Error, program: &clap::Command, arguments: &[OsString]) -> Option<String> {
    let Some(ContextValue::String(option)) = error.get(ContextKind::InvalidArg) else {
        return None;
    };
    let words: Vec<&str> = arguments.iter().skip(1).filter_map(|word| word.to_str()).collect();
    let command = words.iter().find_map(|word| program.find_subcommand(word))?;
    let has_settings = command.get_arguments().any(|option| option.get_long() == Some("set"));
    let option = option.split('=').next()?;
    let key = option.strip_prefix("--")?.replace('-', "_");
    if error.kind() != ErrorKind::UnknownArgument || !has_settings || !is_setting(&key) {
        return None;
    }
    let given = words.iter().enumerate().find_map(|(i, word)| match word.strip_prefix(option)? {
        "" => words.get(i + 1).filter(|next| !next.starts_with("--")).copied(),
        value => value.strip_prefix('='),
    });
    let assignment = match given {
        Some(value) => quoted(&format!("{key}={value}")),
        None => format!("{key}=VALUE"),
    };
    Some(format!("`{key}` is a setting: use `--set {assignment}`"))
}
