//! Files of constants that a scene names: of a sensor or a camera, included or the user's own.

use palpate_input::config::{ConfigError, Loader};
use palpate_input::files;
use std::borrow::Cow;
use std::path::Path;
use toml::{Table, Value};

/// Returns the text of the model `name` under `key`, one of `included` (names and texts) or a file,
/// and whether it is included.
///
/// # Errors
/// If it is neither, or cannot be read.
pub(super) fn text(
    loader: &Loader,
    key: &str,
    name: &str,
    included: &[(&str, &'static str)],
) -> Result<(Cow<'static, str>, bool), ConfigError> {
    if let Some((_, text)) = included.iter().find(|(known, _)| *known == name) {
        return Ok((Cow::Borrowed(text), true));
    }
    let shown = format!("\"{name}\"");
    if !name.ends_with(".toml") {
        let names: Vec<String> = included.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        let allowed = format!("{}, or a file ending in .toml", names.join(", "));
        return Err(loader.not_allowed(key, &shown, &allowed));
    }
    let text = files::text(Path::new(name), files::TEXT_MAX).map_err(|cause| {
        let allowed = format!("a readable file ({name}: {cause})");
        loader.not_allowed(key, &shown, &allowed)
    })?;
    Ok((Cow::Owned(text), false))
}

/// Adds the values of `model` that `scene` lacks, to it and to those of its tables that exist.
pub(super) fn overlay(scene: &mut Table, model: &Table) {
    for (key, value) in model {
        match (scene.get_mut(key), value) {
            (Some(Value::Table(own)), Value::Table(inner)) => overlay(own, inner),
            (None, Value::Table(_)) | (Some(_), _) => {}
            (None, value) => drop(scene.insert(key.clone(), value.clone())),
        }
    }
}
