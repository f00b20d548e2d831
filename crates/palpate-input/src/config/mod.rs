//! Configuration: defaults → file → `--set key=value` → validation, with errors that name the
//! place.

mod error;
mod rules;

pub use error::{ConfigError, Origin};
pub use rules::{Rules, Validate};

use crate::{files, format, paths, shipped, tables};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Text of a file, with the place of each of its keys.
struct Source {
    path: PathBuf,
    /// Key under which the file was included; empty for the outermost.
    prefix: String,
    document: toml_edit::Document<String>,
}

/// Largest nesting depth of a key that is set; a heuristic: beyond any existing one, since nested
/// tables are traversed by recursion.
const DEPTH_MAX: usize = 16;

/// Whether a setting has its default, and need not be written.
pub fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Placeholder that is not a valid name of any setting.
const UNKNOWN: &str = "\u{0}";

/// A configuration during loading.
pub struct Loader {
    table: Table,
    sources: Vec<Source>,
    /// Keys set on the command line, with their text as typed.
    sets: Vec<(String, String)>,
    /// Keys as given, and as read.
    read_as: Vec<[String; 2]>,
    /// Folder of the shipped files; `None` for that of the environment.
    home: Option<PathBuf>,
}

impl Loader {
    /// Reads `path`.
    ///
    /// # Errors
    /// If it cannot be read or is not TOML.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = files::text(path, files::TEXT_MAX);
        Self::from_text(path, text.map_err(|cause| ConfigError::unreadable(path, &cause))?)
    }

    /// Creates a loader from `text`, the contents of `path`.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn from_text(path: &Path, text: String) -> Result<Self, ConfigError> {
        let (table, document) = parse(path, text)?;
        let source = Source { path: path.into(), prefix: String::new(), document };
        Ok(Self { table, sources: vec![source], sets: Vec::new(), read_as: Vec::new(), home: None })
    }

    /// Sets the folder of the files that [`include`](Self::include) finds by name; default: that of
    /// [`shipped::HOME`].
    pub fn with_home(self, home: &Path) -> Self {
        Self { home: Some(home.into()), ..self }
    }

    /// Reads the dotted key `given` as `present`, if it has a value; messages name it as given.
    ///
    /// # Errors
    /// If both have a value, unless `--set` gives `given`: it then replaces the other value, or
    /// values of the table.
    pub fn read_as(&mut self, given: &str, present: &str) -> Result<(), ConfigError> {
        if !self.has_value(given) {
            return Ok(());
        }
        let set: Vec<[String; 2]> = (self.sets.iter())
            .filter_map(|(key, _)| Some([key.clone(), format!("{present}{}", below(key, given)?)]))
            .collect();
        match self.has_value(present) {
            true if set.is_empty() => {
                let message = format!("also given by its present name `{present}`; keep one");
                return Err(ConfigError::invalid(self.origin(given), given.into(), None, message));
            }
            true => self.read_as.extend(set),
            false => self.read_as.push([given.into(), present.into()]),
        }
        match (self.take(given), self.table_mut(present)) {
            (Some(Value::Table(values)), Some(table)) => table.extend(values),
            (Some(value), _) => self.insert(present, value),
            (None, _) => {}
        }
        Ok(())
    }

    /// Removes the dotted key of an optional table that is `false`.
    pub fn take_false(&mut self, key: &str) {
        if self.value(key) == Some(&Value::Boolean(false)) {
            self.take(key);
        }
    }

    /// Returns the key under which `key` was given.
    fn given(&self, key: &str) -> String {
        self.read_as.iter().rev().fold(key.to_owned(), |key, [given, present]| {
            below(&key, present).map(|rest| format!("{given}{rest}")).unwrap_or(key)
        })
    }

    /// Whether there is a value under the dotted key.
    pub fn has_value(&self, key: &str) -> bool {
        self.value(key).is_some()
    }

    /// Whether the file itself, or an assignment so far, contains the key.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Removes the dotted key from the table and returns its value.
    pub fn take(&mut self, key: &str) -> Option<Value> {
        let (tables, last) = split(key);
        self.table_mut(tables)?.remove(last)
    }

    /// Inserts `value` under the dotted key, unless it has a value or leads through one.
    pub fn set_default(&mut self, key: &str, value: Value) {
        let mut parts = steps(key).peekable();
        let mut table = &mut self.table;
        while let Some(part) = parts.next() {
            let is_last = parts.peek().is_none();
            let inner = if is_last { value.clone() } else { Value::Table(Table::new()) };
            match table.entry(part).or_insert(inner) {
                Value::Table(inner) if !is_last => table = inner,
                _ => return,
            }
        }
    }

    /// Inserts `value` under the dotted key, whose table exists.
    fn insert(&mut self, key: &str, value: Value) {
        let (tables, last) = split(key);
        if let Some(table) = self.table_mut(tables) {
            table.insert(last.into(), value);
        }
    }

    /// Returns the error that `key` may not have this value.
    pub fn not_allowed(&self, key: &str, value: &str, allowed: &str) -> ConfigError {
        ConfigError::not_allowed(self.origin(key), self.given(key), value.into(), allowed.into())
    }

    /// Returns the error that the file is `found`, and not of the requested kind.
    pub fn wrong_kind(&self, found: &'static str, remedy: &'static str) -> ConfigError {
        let path = self.sources.first().map(|source| source.path.clone()).unwrap_or_default();
        let origin = Origin::File { path, line: None };
        let message = format!("this is {found}; {remedy}");
        ConfigError { allowed: Some(remedy.into()), ..ConfigError::new(origin, message) }
    }

    /// Replaces `key` by the table in the file that it names, if it names a file. A plain name
    /// without such a file is that of a shipped file in `folder`.
    ///
    /// # Errors
    /// If the file cannot be read or is not TOML.
    pub fn include(&mut self, key: &str, folder: Option<&str>) -> Result<(), ConfigError> {
        let Some(Value::String(name)) = self.table.get(key) else { return Ok(()) };
        let mut path = self.located(key, Path::new(name));
        let folder = folder.filter(|_| shipped::is_plain(Path::new(name)) && !path.is_file());
        if let Some(folder) = folder {
            path = shipped::find(Path::new(name), folder, self.home.as_deref()).unwrap_or(path);
        }
        let text = files::text(&path, files::TEXT_MAX).map_err(|cause| {
            let mut allowed = format!("a readable file ({}: {cause})", path.display());
            if let Some(folder) = folder {
                let names = shipped::names(folder, self.home.as_deref());
                let remedy = shipped::remedy(name, &names);
                allowed += &format!(", or a name in {folder}/ ({}){remedy}", names.join(", "));
            }
            self.not_allowed(key, &format!("\"{name}\""), &allowed)
        })?;
        let (table, document) = parse(&path, text)?;
        self.table.insert(key.into(), Value::Table(table));
        // The values under the key now come from the file.
        self.sets.retain(|(set, _)| set != key);
        self.sources.push(Source { path, prefix: format!("{key}."), document });
        Ok(())
    }

    /// Applies `key=value` as typed after `--set`; a value that is not TOML is read as text.
    ///
    /// # Errors
    /// If it is not of that form, or its key leads through something that is not a table.
    pub fn set(&mut self, text: &str) -> Result<(), ConfigError> {
        let refused = || ConfigError::assignment(text);
        let (key, value) = text.split_once('=').ok_or_else(refused)?;
        let (key, value) = (key.trim(), value.trim());
        let value = toml::from_str::<Table>(&format!("value = {value}"))
            .ok()
            .and_then(|mut table| table.remove("value").filter(|_| table.is_empty()))
            .unwrap_or_else(|| Value::String(value.into()));
        let mut parts: Vec<&str> = key.split('.').collect();
        let last = parts.pop().filter(|last| !last.is_empty()).ok_or_else(refused)?;
        if parts.len() > DEPTH_MAX {
            return Err(refused());
        }
        let mut table = &mut self.table;
        for part in parts {
            let entry = table.entry(part).or_insert_with(|| Value::Table(Table::new()));
            table = entry.as_table_mut().ok_or_else(refused)?;
        }
        table.insert(last.into(), value);
        self.sets.push((key.into(), text.into()));
        Ok(())
    }

    /// Calls [`resolve_path`](Self::resolve_path) if the value of `key` ends with `ending`.
    pub fn resolve_path_ending(&mut self, key: &str, ending: &str) {
        let is_file = |value: &Value| value.as_str().is_some_and(|name| name.ends_with(ending));
        if self.value(key).is_some_and(is_file) {
            self.resolve_path(key);
        }
    }

    /// Makes the path under the dotted `key` absolute: one from a file is relative to that file's
    /// folder, one from `--set` to the current folder; where there is none, to the shipped files.
    pub fn resolve_path(&mut self, key: &str) {
        let Some(Value::String(name)) = self.value(key) else { return };
        let text = self.resolved(key, name);
        self.insert(key, Value::String(text));
    }

    /// Makes all paths among the settings of a `T` absolute, as [`resolve_path`] does.
    ///
    /// [`resolve_path`]: Self::resolve_path
    fn resolve_paths<T: JsonSchema + 'static>(&mut self) {
        let mut table = std::mem::take(&mut self.table);
        paths::visit::<T>(&mut table, &mut |key, text| *text = self.resolved(key, text));
        self.table = table;
    }

    /// Returns the absolute path `name` under `key`; an empty name stays empty.
    fn resolved(&self, key: &str, name: &str) -> String {
        if name.is_empty() {
            return String::new();
        }
        let path = self.located(key, Path::new(name));
        let path = std::path::absolute(&path).unwrap_or(path);
        tidy(&path).to_string_lossy().into_owned()
    }

    /// Returns the table under the dotted `key`, the outermost if it is empty.
    pub fn table_mut(&mut self, key: &str) -> Option<&mut Table> {
        let mut parts = steps(key);
        parts.try_fold(&mut self.table, |table, part| table.get_mut(part)?.as_table_mut())
    }

    /// Fills in defaults, makes all paths absolute and validates everything.
    ///
    /// # Errors
    /// The first invalid value, with its origin.
    pub fn finish<T: DeserializeOwned + JsonSchema + Validate + 'static>(
        mut self,
    ) -> Result<T, ConfigError> {
        self.resolve_paths::<T>();
        let config: T = tables::read(self.table.clone())
            .map_err(|error| self.explain::<T>(&error.key, &error.message))?;
        let mut rules = Rules::default();
        config.check(&mut rules);
        match rules.violation {
            None => Ok(config),
            Some((key, value, allowed)) => {
                let key = self.given(&key);
                Err(ConfigError::not_allowed(self.origin(&key), key, value, allowed))
            }
        }
    }

    fn explain<T: DeserializeOwned + Validate>(&self, path: &str, message: &str) -> ConfigError {
        let mut names = message.split('`').skip(1).step_by(2).map(String::from);
        if message.starts_with("unknown field") {
            let unknown = names.next().unwrap_or_default();
            let allowed: Vec<String> = names.collect();
            let key = join(path.rsplit_once('.').map_or(".", |(parent, _)| parent), &unknown);
            let key = self.given(&key);
            let nearest = format::nearest(key.rsplit('.').next().unwrap_or(&key), &allowed);
            let nearest = nearest.map_or(String::new(), |key| format!(", did you mean `{key}`?"));
            let allowed = allowed.join(", ");
            let message = format!("unknown key `{key}`{nearest}; allowed here: {allowed}");
            let error = ConfigError::new(self.origin(&key), message);
            return ConfigError { key: Some(key), allowed: Some(allowed), ..error };
        }
        if let (true, Some(missing)) = (message.starts_with("missing field"), names.next()) {
            let key = self.given(&join(path, &missing));
            let error = ConfigError::new(self.origin(&key), format!("`{key}` is missing"));
            return ConfigError { key: Some(key), ..error };
        }
        let key = String::from(path);
        let value = self.value(&key).map(|value| value.to_string());
        let allowed = self.range::<T>(&key, message).or_else(|| format::allowed(message));
        let choices = match message.starts_with("unknown variant") {
            true => allowed.clone(),
            false if allowed.is_none() => self.choices::<T>(&key),
            false => None,
        };
        let word = self.value(&key).and_then(Value::as_str).unwrap_or_default();
        let names: Vec<String> =
            choices.iter().flat_map(|names| names.split(", ")).map(String::from).collect();
        let hint = format::did_you_mean(word, &names);
        let text = match allowed.or(choices) {
            Some(allowed) => format!("allowed is {allowed}{hint}"),
            None => message.to_owned(),
        };
        let key = self.given(&key);
        ConfigError::invalid(self.origin(&key), key, value, text)
    }

    /// Returns the allowed names of `key`, found by parsing an invalid one.
    fn choices<T: DeserializeOwned>(&self, key: &str) -> Option<String> {
        let table = self.with_value(key, Value::String(UNKNOWN.into()))?;
        let error = tables::read::<T>(table).err()?;
        format::allowed(&error.message).filter(|_| error.key == key)
    }

    /// Returns the allowed numbers of `key` by its rule, if its parser's error `message` is about a
    /// number; found by checking a valid one.
    fn range<T: DeserializeOwned + Validate>(&self, key: &str, message: &str) -> Option<String> {
        let (kind, number) = match message.rsplit_once("expected ")?.1 {
            "u8" | "u16" | "u32" | "u64" | "usize" => ("a whole number", Value::Integer(1)),
            "f32" | "f64" => ("a number", Value::Float(1.0)),
            _ => return None,
        };
        let config = tables::read::<T>(self.with_value(key, number)?).ok()?;
        let range = Rules::allowed_values(&config).remove(key)?;
        Some(format!("{kind} from {range}"))
    }

    /// Returns the table with another value under the dotted `key`.
    fn with_value(&self, key: &str, other: Value) -> Option<Table> {
        let mut table = self.table.clone();
        let mut parts = steps(key);
        let mut value = table.get_mut(parts.next()?)?;
        for part in parts {
            value = match part.parse::<usize>() {
                Ok(index) => value.as_array_mut()?.get_mut(index)?,
                Err(_) => value.as_table_mut()?.get_mut(part)?,
            };
        }
        *value = other;
        Some(table)
    }

    /// Returns the value under the dotted `key`.
    pub fn value(&self, key: &str) -> Option<&Value> {
        let mut parts = steps(key);
        let mut value = self.table.get(parts.next()?)?;
        for part in parts {
            value = match part.parse::<usize>() {
                Ok(index) => value.as_array()?.get(index)?,
                Err(_) => value.as_table()?.get(part)?,
            };
        }
        Some(value)
    }

    /// Returns the path `name` relative to the origin of `key`, or that of a shipped file if there
    /// is no other.
    fn located(&self, key: &str, name: &Path) -> PathBuf {
        let beside = match self.origin(key) {
            Origin::File { path, .. } => {
                path.parent().map_or_else(|| name.into(), |folder| folder.join(name))
            }
            Origin::Set(_) => name.into(),
        };
        match beside.exists() {
            true => beside,
            false => shipped::locate(name, self.home.as_deref()).unwrap_or(beside),
        }
    }

    /// Whether no file contains `key`, so that it can only come from `--set`.
    fn in_no_file(&self, key: &str) -> bool {
        self.sources.iter().all(|source| {
            let inner = key.strip_prefix(source.prefix.as_str()).unwrap_or(key);
            steps(inner).next().is_none_or(|first| !source.document.as_table().contains_key(first))
        })
    }

    fn origin(&self, key: &str) -> Origin {
        let key = &*self.given(key);
        let under = |set: &str| below(key, set).is_some();
        let over = |set: &str| set.strip_prefix(key).is_some_and(|rest| rest.starts_with('.'));
        let unknown = |set: &str| over(set) && self.in_no_file(key);
        if let Some((_, text)) = self.sets.iter().rev().find(|(set, _)| under(set) || unknown(set))
        {
            return Origin::Set(text.clone());
        }
        let inner = self.sources.iter().rev().find_map(|source| {
            key.strip_prefix(source.prefix.as_str()).map(|inner| (source, inner))
        });
        let Some((source, inner)) = inner else {
            return Origin::File { path: PathBuf::new(), line: None };
        };
        Origin::File { path: source.path.clone(), line: line_of(&source.document, inner) }
    }
}

/// Joins `name` to the table at `path`, where `.` is the outermost.
fn join(path: &str, name: &str) -> String {
    if path == "." { name.into() } else { format!("{path}.{name}") }
}

/// Splits a dotted key into its table and its last part.
fn split(key: &str) -> (&str, &str) {
    key.rsplit_once('.').unwrap_or(("", key))
}

/// Returns the rest of `key` if it is `table` or lies below it.
fn below<'a>(key: &'a str, table: &str) -> Option<&'a str> {
    key.strip_prefix(table).filter(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}

/// Splits a dotted key into its parts; an index in brackets is a separate part.
fn steps(key: &str) -> impl Iterator<Item = &str> {
    key.split(['.', '[', ']']).filter(|part| !part.is_empty())
}

/// Returns the line of the innermost part of `key` that the document contains.
fn line_of(document: &toml_edit::Document<String>, key: &str) -> Option<usize> {
    let mut table: &dyn toml_edit::TableLike = document.as_table();
    let mut found = None;
    for part in steps(key) {
        let Some((name, item)) = table.get_key_value(part) else { break };
        found = name.span().or_else(|| item.span()).or(found);
        match item.as_table_like() {
            Some(inner) => table = inner,
            None => break,
        }
    }
    let before = document.raw().get(..found?.start)?;
    Some(before.matches('\n').count() + 1)
}

fn parse(path: &Path, text: String) -> Result<(Table, toml_edit::Document<String>), ConfigError> {
    let document = toml_edit::Document::parse(text.clone()).map_err(|error| {
        let line = error
            .span()
            .and_then(|span| text.get(..span.start))
            .map(|before| before.matches('\n').count() + 1);
        let origin = Origin::File { path: path.into(), line };
        ConfigError::syntax(origin, error.message().trim().replace('\n', ", "))
    })?;
    let table = toml::from_str(&text).map_err(|error| {
        let origin = Origin::File { path: path.into(), line: None };
        ConfigError::syntax(origin, error.message().into())
    })?;
    Ok((table, document))
}

/// Removes `.` and `folder/..` without accessing the file system.
fn tidy(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut tidy = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                tidy.pop();
            }
            part => tidy.push(part),
        }
    }
    tidy
}
