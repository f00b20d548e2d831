//! Names that commands had in the version before: they still answer.

use anyhow::{bail, ensure};
use std::ffi::OsString;

/// `arguments`, of which the first is the program's name, in today's words, and how its command is
/// called today if it had another name.
///
/// # Errors
/// If there is no such command any more, or its arguments cannot be put into today's order.
pub(super) fn today(
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
        "stress" => bail!("palpate stress is gone: `make hard-cases` runs and explains them all"),
        "bench" => bail!("palpate bench is gone: `make bench` measures speed"),
        "cost" => bail!("palpate cost is gone: `make check-cost` counts instructions"),
        _ => {
            arguments.append(&mut rest);
            return Ok((arguments, None));
        }
    };
    arguments[at] = now.into();
    arguments.append(&mut rest);
    Ok((arguments, Some(format!("palpate {name} is now palpate {words}"))))
}

/// Whether the option `name` is among `arguments`.
fn has(arguments: &[OsString], name: &str) -> bool {
    arguments.iter().any(|argument| value(argument, name).is_some())
}

/// Gives the option `old` its name of today.
fn rename(arguments: &mut [OsString], old: &str, new: &str) {
    for argument in arguments {
        if let Some(value) = value(argument, old) {
            *argument = format!("{new}{value}").into();
        }
    }
}

/// What follows the option `name` in its own argument, `=VALUE` or nothing, if it is that option.
fn value(argument: &OsString, name: &str) -> Option<String> {
    let value = argument.to_str()?.strip_prefix(name)?;
    (value.is_empty() || value.starts_with('=')).then(|| value.into())
}
