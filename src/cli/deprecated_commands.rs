//! Deprecated names of commands and options, accepted for one version.

use anyhow::{bail, ensure};
use std::ffi::OsString;

/// Translates `arguments`, the first of which is the program's name, from deprecated to current
/// names. Also returns a note if the command's name was deprecated.
///
/// # Errors
/// If the command was removed, or its arguments cannot be translated.
pub(super) fn translate(
    mut arguments: Vec<OsString>,
) -> anyhow::Result<(Vec<OsString>, Option<String>)> {
    let is_option = |argument: &OsString| argument.as_encoded_bytes().starts_with(b"-");
    let named = arguments.iter().skip(1).position(|argument| !is_option(argument));
    let Some(at) = named.map(|before| before + 1) else { return Ok((arguments, None)) };
    let mut rest = arguments.split_off(at + 1);
    let name = arguments[at].to_string_lossy().into_owned();
    let places = rest.iter().take_while(|argument| !is_option(argument)).count();
    let (now, words) = match name.as_str() {
        "plan" => {
            rename(&mut rest, "--shards", "--plan");
            if !has(&rest, "--plan") {
                rest.push("--plan=1".into());
            }
            ("run", "run EXPERIMENT --plan SHARDS")
        }
        "merge" => {
            ensure!(places > 0, "palpate merge is now palpate report FOLDER --merge SHARDS");
            rest.insert(1, "--merge".into());
            ("report", "report FOLDER --merge SHARDS")
        }
        "watch" => {
            rest.push("--watch".into());
            ("show", "show SCENE --watch")
        }
        "scan" => ("export", "export SCENE"),
        "align" => {
            ensure!(places > 1, "palpate align is now palpate register MESH --cloud CLOUD");
            rest.swap(0, 1);
            rest.insert(1, "--cloud".into());
            rename(&mut rest, "--position", "--at");
            ("register", "register MESH --cloud CLOUD")
        }
        "suite" => ("run", "run SWEEP"),
        "twin" => ("serve", "serve EXPERIMENT"),
        "check" if has(&rest, "--bless") => {
            rename(&mut rest, "--bless", "--accept");
            ("check", "check --accept REASON")
        }
        "accuracy" if has(&rest, "--fresh") => {
            rename(&mut rest, "--fresh", "--held-out");
            ("accuracy", "accuracy --held-out N")
        }
        "fidelity" => {
            rename(&mut rest, "--from", "--against");
            if !has(&rest, "--against") {
                rest.extend(["--against", "reference"].map(OsString::from));
            }
            ("accuracy", "accuracy SCENE --against reference")
        }
        "effects" => {
            rest.extend(["--against", "scene"].map(OsString::from));
            ("accuracy", "accuracy SCENE --against scene")
        }
        "stress" => bail!("palpate stress was removed; use `make hard-cases`"),
        "bench" => bail!("palpate bench was removed; use `make bench` to measure speed"),
        "cost" => bail!("palpate cost was removed; use `make check-cost` to count instructions"),
        _ => {
            arguments.append(&mut rest);
            return Ok((arguments, None));
        }
    };
    arguments[at] = now.into();
    arguments.append(&mut rest);
    let former = match name.as_str() {
        "check" => "--bless",
        "accuracy" => "--fresh",
        name => name,
    };
    Ok((arguments, Some(format!("`{former}` is now `palpate {words}`"))))
}

/// Whether the option `name` is among `arguments`.
fn has(arguments: &[OsString], name: &str) -> bool {
    arguments.iter().any(|argument| value(argument, name).is_some())
}

/// Renames the option `old` to `new`.
fn rename(arguments: &mut [OsString], old: &str, new: &str) {
    for argument in arguments {
        if let Some(value) = value(argument, old) {
            *argument = format!("{new}{value}").into();
        }
    }
}

/// Returns the rest of the argument after the option `name`: `=VALUE` or nothing.
fn value(argument: &OsString, name: &str) -> Option<String> {
    let value = argument.to_str()?.strip_prefix(name)?;
    (value.is_empty() || value.starts_with('=')).then(|| value.into())
}
