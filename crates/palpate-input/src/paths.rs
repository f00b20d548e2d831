//! Paths among settings, found by their type.

use crate::tables;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use std::any::TypeId;
use std::collections::BTreeMap;
use std::ops::Deref;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use toml::{Table, Value};

/// Path of an input file or folder in settings. In a file it is relative to that file's folder.
///
/// Every setting of this type is made absolute when settings are loaded, and its content belongs to
/// the identity of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct InputPath(PathBuf);

/// Format of a path in a schema.
const PATH: &str = "path";

/// Format, in a schema, of text that is a path if it has a file ending, and a name otherwise.
pub const PATH_OR_NAME: &str = "path or name";

impl Deref for InputPath {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

impl AsRef<Path> for InputPath {
    fn as_ref(&self) -> &Path {
        self
    }
}

impl<P: Into<PathBuf>> From<P> for InputPath {
    fn from(path: P) -> Self {
        Self(path.into())
    }
}

impl JsonSchema for InputPath {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "InputPath".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "format": PATH })
    }
}

/// Step of a key into all entries of a table or list.
const ALL: &str = "*";

/// Deepest nesting of a key; a heuristic: beyond any existing one, since a schema may be recursive.
const DEPTH_MAX: usize = 16;

/// Calls `each` with the dotted key and the text of each path in `table`, the settings of a `T`.
pub fn visit<T: JsonSchema + 'static>(table: &mut Table, each: &mut dyn FnMut(&str, &mut String)) {
    for Key { steps, may_be_name } in keys::<T>().iter() {
        let Some((first, rest)) = steps.split_first() else { continue };
        let mut each = |key: &str, text: &mut String| {
            if !may_be_name || Path::new(text).extension().is_some() {
                each(key, text);
            }
        };
        if let Some(value) = table.get_mut(first) {
            descend(value, first, rest, &mut each);
        }
    }
}

/// Returns a copy of `settings` with each path replaced; `None` if TOML has no form for them.
pub fn map<T: Serialize + DeserializeOwned + JsonSchema + 'static>(
    settings: &T,
    mut replace: impl FnMut(&str) -> String,
) -> Option<T> {
    let Ok(Value::Table(mut table)) = tables::value(settings) else { return None };
    visit::<T>(&mut table, &mut |_, path| *path = replace(path));
    tables::read(table).ok()
}

/// Returns the paths of `settings` with their dotted keys.
pub fn list<T: Serialize + JsonSchema + 'static>(settings: &T) -> Vec<(String, PathBuf)> {
    let Ok(Value::Table(mut table)) = tables::value(settings) else { return Vec::new() };
    let mut paths = Vec::new();
    visit::<T>(&mut table, &mut |key, path| paths.push((key.into(), PathBuf::from(&*path))));
    paths
}

/// Key of a path in a schema.
struct Key {
    steps: Vec<String>,
    may_be_name: bool,
}

/// Returns the keys of the paths among the settings of a `T`.
fn keys<T: JsonSchema + 'static>() -> Arc<[Key]> {
    // Kept, because they depend on the type alone and a schema takes half a megabyte.
    static KEYS: Mutex<BTreeMap<TypeId, Arc<[Key]>>> = Mutex::new(BTreeMap::new());
    let find = || {
        let schema = SchemaGenerator::default().into_root_schema_for::<T>().to_value();
        let mut keys = Vec::new();
        collect(&schema, &schema, &mut Vec::new(), &mut keys);
        keys.into()
    };
    let mut known = KEYS.lock().unwrap_or_else(PoisonError::into_inner);
    Arc::clone(known.entry(TypeId::of::<T>()).or_insert_with(find))
}

/// Adds the paths of `schema`, which is part of `root` and is found under `steps`.
fn collect(root: &Json, schema: &Json, steps: &mut Vec<String>, keys: &mut Vec<Key>) {
    if steps.len() > DEPTH_MAX {
        return;
    }
    if let Some(path) = schema["$ref"].as_str().and_then(|path| path.strip_prefix("#/")) {
        let target = path.split('/').fold(root, |at, name| &at[name]);
        return collect(root, target, steps, keys);
    }
    if let Some(format @ (PATH | PATH_OR_NAME)) = schema["format"].as_str() {
        keys.push(Key { steps: steps.clone(), may_be_name: format == PATH_OR_NAME });
    }
    for option in ["anyOf", "oneOf", "allOf"].iter().filter_map(|name| schema[name].as_array()) {
        option.iter().for_each(|option| collect(root, option, steps, keys));
    }
    let named = schema["properties"].as_object().into_iter().flatten();
    let named = named.map(|(name, inner)| (name.as_str(), inner));
    let all = ["additionalProperties", "items"].map(|name| (ALL, &schema[name]));
    for (step, inner) in named.chain(all.into_iter().filter(|(_, inner)| inner.is_object())) {
        steps.push(step.into());
        collect(root, inner, steps, keys);
        steps.pop();
    }
}

/// Calls `each` with the texts under `steps` of `value`, whose own key is `key`.
fn descend(
    value: &mut Value,
    key: &str,
    steps: &[String],
    each: &mut dyn FnMut(&str, &mut String),
) {
    let Some((step, rest)) = steps.split_first() else {
        if let Value::String(text) = value {
            each(key, text);
        }
        return;
    };
    match value {
        Value::Table(table) => {
            for (name, inner) in table.iter_mut().filter(|(name, _)| step == ALL || step == *name) {
                descend(inner, &format!("{key}.{name}"), rest, each);
            }
        }
        Value::Array(values) if step == ALL => {
            for (i, inner) in values.iter_mut().enumerate() {
                descend(inner, &format!("{key}[{i}]"), rest, each);
            }
        }
        _ => {}
    }
}

/// Returns `path` relative to `folder`, both absolute.
pub fn relative(path: &Path, folder: &Path) -> PathBuf {
    let shared = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(path.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(JsonSchema)]
    #[expect(dead_code, reason = "only its schema is used")]
    struct Scene {
        mesh: Option<InputPath>,
        views: BTreeMap<String, View>,
        more: Vec<View>,
        #[schemars(extend("format" = PATH_OR_NAME))]
        arm: String,
        name: String,
    }

    #[derive(JsonSchema)]
    #[expect(dead_code, reason = "only its schema is used")]
    struct View {
        file: InputPath,
    }

    fn found(text: &str) -> Vec<String> {
        let mut keys = Vec::new();
        let mut table = text.parse().unwrap();
        visit::<Scene>(&mut table, &mut |key, text| keys.push(format!("{key}={text}")));
        keys.sort();
        keys
    }

    #[test]
    fn paths_are_found_by_type_in_tables_lists_and_options() {
        let text = "mesh = 'a.obj'\nname = 'b.obj'\narm = 'pa10'\nmore = [{ file = 'c.ply' }]\n\
                    [views.'left.upper']\nfile = 'd.ply'\n";
        assert_eq!(
            found(text),
            ["mesh=a.obj", "more[0].file=c.ply", "views.left.upper.file=d.ply"]
        );
        assert_eq!(found("arm = 'my.urdf'\nmesh = 3"), ["arm=my.urdf"]);
        assert!(found("views = 'none'").is_empty());
    }

    #[test]
    fn a_visit_can_replace_paths() {
        let mut table: Table = "mesh = 'a.obj'".parse().unwrap();
        visit::<Scene>(&mut table, &mut |_, text| *text = format!("/models/{text}"));
        assert_eq!(table["mesh"].as_str(), Some("/models/a.obj"));
    }
}
