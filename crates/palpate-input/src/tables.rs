//! Settings from TOML tables and back.
//!
//! There is one reader, and the writer is behind a pointer (`dyn`), so that a type is compiled once
//! and not for each reader and writer of a format.

use erased_serde::Serialize;
use serde::de::value::{StrDeserializer, StringDeserializer};
use serde::de::{
    self, DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, IntoDeserializer, MapAccess,
    SeqAccess, Unexpected, VariantAccess, Visitor,
};
use std::cell::RefCell;
use std::fmt;
use toml::{Table, Value, ser};

/// Place and reason of a value that cannot be read.
pub struct Mismatch {
    /// Dotted key; `.` for the whole table.
    pub key: String,
    /// Reason, in the words of serde.
    pub message: String,
}

/// Reads a value from a table.
///
/// # Errors
/// The first key whose value does not fit.
pub fn read<T: DeserializeOwned>(table: Table) -> Result<T, Mismatch> {
    let place = Place::default();
    T::deserialize(Reader { value: Value::Table(table), place: &place, depth: 0 }).map_err(
        |Reason(message)| {
            let key = place.0.take().concat();
            let key = key.strip_prefix('.').unwrap_or(&key);
            Mismatch { key: if key.is_empty() { ".".into() } else { key.into() }, message }
        },
    )
}

/// Returns a value as the text of a TOML file.
///
/// # Errors
/// If TOML has no form for it.
pub fn text(value: &dyn Serialize) -> Result<String, ser::Error> {
    toml::to_string(value)
}

/// Returns a value as a TOML value.
///
/// # Errors
/// If TOML has no form for it.
pub fn value(value: &dyn Serialize) -> Result<Value, ser::Error> {
    Value::try_from(value)
}

/// Reason of a mismatch.
#[derive(Debug)]
struct Reason(String);

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Reason {}

impl de::Error for Reason {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

/// Steps to the value that is being read, `.key` or `[index]`; after an error those to its place.
#[derive(Default)]
struct Place(RefCell<Vec<String>>);

/// Reader of a value that is `depth` steps deep.
struct Reader<'a> {
    value: Value,
    place: &'a Place,
    depth: usize,
}

impl Reader<'_> {
    /// Returns the type of the value for a message.
    fn unexpected(&self) -> Unexpected<'_> {
        match &self.value {
            Value::String(text) => Unexpected::Str(text),
            Value::Integer(number) => Unexpected::Signed(*number),
            Value::Float(number) => Unexpected::Float(*number),
            Value::Boolean(is_true) => Unexpected::Bool(*is_true),
            Value::Datetime(_) => Unexpected::Other("datetime"),
            Value::Array(_) => Unexpected::Seq,
            Value::Table(_) => Unexpected::Map,
        }
    }
}

/// Values of a list or a table, `depth` steps deep.
struct Inner<'a, I> {
    rest: I,
    /// Value of the last key.
    value: Option<(String, Value)>,
    count: usize,
    place: &'a Place,
    depth: usize,
}

impl<'a, I: ExactSizeIterator> Inner<'a, I> {
    fn new(rest: I, place: &'a Place, depth: usize) -> Self {
        Self { rest, value: None, count: 0, place, depth }
    }

    /// Reads `value` at `step`.
    fn read<'de, S: DeserializeSeed<'de>>(
        &self,
        step: String,
        value: Value,
        seed: S,
    ) -> Result<S::Value, Reason> {
        self.enter(step);
        seed.deserialize(Reader { value, place: self.place, depth: self.depth + 1 })
    }

    fn enter(&self, step: String) {
        let mut steps = self.place.0.borrow_mut();
        steps.truncate(self.depth);
        steps.push(step);
    }

    /// Returns `read`, unless values are left.
    fn ended<T>(self, read: T, expected: &str) -> Result<T, Reason> {
        self.place.0.borrow_mut().truncate(self.depth);
        match self.rest.len() {
            0 => Ok(read),
            left => Err(de::Error::invalid_length(self.count + left, &expected)),
        }
    }
}

impl<'de> SeqAccess<'de> for Inner<'_, std::vec::IntoIter<Value>> {
    type Error = Reason;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Reason> {
        let Some(value) = self.rest.next() else {
            // What is missing is missing in the list.
            self.place.0.borrow_mut().truncate(self.depth);
            return Ok(None);
        };
        let step = format!("[{}]", self.count);
        self.count += 1;
        self.read(step, value, seed).map(Some)
    }
}

impl<'de> MapAccess<'de> for Inner<'_, toml::map::IntoIter<String, Value>> {
    type Error = Reason;

    fn next_key_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Reason> {
        let Some((key, value)) = self.rest.next() else {
            // What is missing is missing in the table.
            self.place.0.borrow_mut().truncate(self.depth);
            return Ok(None);
        };
        self.count += 1;
        self.enter(format!(".{key}"));
        let name: StrDeserializer<'_, Reason> = key.as_str().into_deserializer();
        let read = seed.deserialize(name)?;
        self.value = Some((key, value));
        Ok(Some(read))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, Reason> {
        let Some((key, value)) = self.value.take() else {
            return Err(de::Error::custom("a value without a key"));
        };
        self.read(format!(".{key}"), value, seed)
    }
}

/// Variant of an enumeration, with its value.
struct Variant<'a>(String, Reader<'a>);

impl<'de, 'a> EnumAccess<'de> for Variant<'a> {
    type Error = Reason;
    type Variant = Reader<'a>;

    fn variant_seed<S: DeserializeSeed<'de>>(
        self,
        seed: S,
    ) -> Result<(S::Value, Reader<'a>), Reason> {
        let name: StringDeserializer<Reason> = self.0.into_deserializer();
        Ok((seed.deserialize(name)?, self.1))
    }
}

impl<'de> VariantAccess<'de> for Reader<'_> {
    type Error = Reason;

    fn unit_variant(self) -> Result<(), Reason> {
        Err(de::Error::invalid_type(self.unexpected(), &"no value"))
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, Reason> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Reason> {
        self.deserialize_any(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Reason> {
        self.deserialize_any(visitor)
    }
}

impl<'de> Deserializer<'de> for Reader<'_> {
    type Error = Reason;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Reason> {
        let Reader { value, place, depth } = self;
        match value {
            Value::String(text) => visitor.visit_string(text),
            Value::Integer(number) => visitor.visit_i64(number),
            Value::Float(number) => visitor.visit_f64(number),
            Value::Boolean(is_true) => visitor.visit_bool(is_true),
            Value::Datetime(time) => visitor.visit_string(time.to_string()),
            Value::Array(items) => {
                let mut items = Inner::new(items.into_iter(), place, depth);
                let read = visitor.visit_seq(&mut items)?;
                items.ended(read, "fewer elements in array")
            }
            Value::Table(table) => {
                let mut entries = Inner::new(table.into_iter(), place, depth);
                let read = visitor.visit_map(&mut entries)?;
                entries.ended(read, "fewer elements in map")
            }
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Reason> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Reason> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Reason> {
        let Reader { value, place, depth } = self;
        match value {
            Value::String(name) => {
                let unit: StringDeserializer<Reason> = name.into_deserializer();
                visitor.visit_enum(unit)
            }
            Value::Table(table) => {
                let mut entries = table.into_iter();
                match (entries.next(), entries.next()) {
                    (Some((name, value)), None) => {
                        visitor.visit_enum(Variant(name, Reader { value, place, depth }))
                    }
                    _ => Err(de::Error::invalid_type(Unexpected::Map, &"a table with one key")),
                }
            }
            value => {
                let reader = Reader { value, place, depth };
                Err(de::Error::invalid_type(reader.unexpected(), &"a name"))
            }
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}
