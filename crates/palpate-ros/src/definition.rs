//! Definitions of message types: their texts, and the macro that generates a struct and a
//! definition from one declaration.

/// A message type: its name and the text of its definition.
pub struct Definition {
    /// Full name, e.g. `sensor_msgs/msg/JointState`.
    pub name: &'static str,
    /// Fields, one line each, in the syntax of `.msg` files.
    pub fields: &'static str,
    /// Definitions of the message types of the fields.
    pub parts: &'static [&'static Definition],
}

/// A message type that is sent over topics.
pub trait HasDefinition {
    /// Name and fields.
    const DEFINITION: Definition;
}

/// Replacements that turn the macro's text into a ROS 2 definition.
const ROS2: &[(&str, &str)] = &[("r#", "")];

/// Separator before the definition of each part.
const RULE: &str =
    "================================================================================\nMSG: ";

impl Definition {
    /// Returns the package, e.g. `sensor_msgs`.
    pub fn package(&self) -> &'static str {
        self.name.split('/').next().unwrap_or_default()
    }

    /// Returns the name in its package, e.g. `JointState`.
    pub fn short_name(&self) -> &'static str {
        self.name.rsplit('/').next().unwrap_or_default()
    }

    /// Returns the full definition with those of all parts: a schema of encoding `ros2msg`.
    pub fn text(&self) -> String {
        Text::of(self, ROS2).as_str().into()
    }
}

/// Largest length of a text, bytes: that of the longest message and its parts, rounded up.
const LENGTH_MAX: usize = 8192;

/// A definition text that is assembled at compile time.
pub(super) struct Text {
    bytes: [u8; LENGTH_MAX],
    length: usize,
}

impl Text {
    const fn of(definition: &Definition, replaced: &[(&str, &str)]) -> Self {
        let mut text = Self { bytes: [0; LENGTH_MAX], length: 0 };
        text.push(definition.fields, replaced);
        text.push_parts(definition.parts, replaced);
        text
    }

    /// Appends the definitions of `parts` and of the types that they use, each once.
    const fn push_parts(&mut self, parts: &[&Definition], replaced: &[(&str, &str)]) {
        let mut i = 0;
        while i < parts.len() {
            let start = self.length;
            self.push(RULE, &[]);
            self.push(parts[i].name, &[("/msg/", "/")]);
            self.push("\n", &[]);
            let is_primitive =
                replaced.len() > 1 && begins(parts[i].name.as_bytes(), 0, b"builtin");
            if is_primitive || self.has_before(start) {
                self.length = start;
            } else {
                self.push(parts[i].fields, replaced);
                self.push_parts(parts[i].parts, replaced);
            }
            i += 1;
        }
    }

    /// Whether the text from `start` on also occurs before `start`.
    const fn has_before(&self, start: usize) -> bool {
        let (before, found) = self.bytes.split_at(start);
        let (found, _) = found.split_at(self.length - start);
        let mut at = 0;
        while at < start {
            if begins(before, at, found) {
                return true;
            }
            at += 1;
        }
        false
    }

    /// Appends `text` with the replacements `replaced`.
    const fn push(&mut self, text: &str, replaced: &[(&str, &str)]) {
        let text = text.as_bytes();
        let mut at = 0;
        'text: while at < text.len() {
            let mut i = 0;
            while i < replaced.len() {
                let (from, to) = replaced[i];
                if begins(text, at, from.as_bytes()) {
                    self.push(to, &[]);
                    at += from.len();
                    continue 'text;
                }
                i += 1;
            }
            self.bytes[self.length] = text[at];
            self.length += 1;
            at += 1;
        }
    }

    /// Returns the text.
    pub(super) const fn as_str(&self) -> &str {
        match std::str::from_utf8(self.bytes.split_at(self.length).0) {
            Ok(text) => text,
            Err(_) => panic!("the definition is not valid UTF-8"),
        }
    }
}

/// Whether `text` contains `what` at the byte `at`.
const fn begins(text: &[u8], at: usize, what: &[u8]) -> bool {
    let mut i = 0;
    while i < what.len() {
        if at + i >= text.len() || text[at + i] != what[i] {
            return false;
        }
        i += 1;
    }
    true
}

/// Generates a struct with its [`Definition`] from each declaration in the syntax of `.msg` files:
/// a package with a name and, in braces, constants as a text and fields with their types and
/// defaults. `serde` writes the fields in this order, so that a CDR serializer is compatible with
/// other implementations.
macro_rules! messages {
    ($(
        $(#[$meta:meta])*
        $package:ident / $name:ident {
            $($constants:literal)?
            $(
                $(#[$field_meta:meta])*
                $type:ident $(/ $part:ident)? $([$(<= $most:literal)? $($count:literal)?])?
                $field:ident $($default:literal)?,
            )*
        }
    )*) => {$(
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub struct $name {
            $(
                $(#[$field_meta])*
                pub $field: messages!(@type $type $(/ $part)? $([$(<= $most)? $($count)?])?),
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: messages!(@default $($default)?),)* }
            }
        }

        impl HasDefinition for $name {
            const DEFINITION: Definition = Definition {
                name: concat!(stringify!($package), "/msg/", stringify!($name)),
                fields: concat!($($constants,)? $(
                    stringify!($type), $("/", stringify!($part),)? $("[", $("<=", $most,)? $($count,)? "]",)?
                    " ", stringify!($field), $(" ", $default,)? "\n",
                )*),
                parts: &[$($(&$part::DEFINITION,)?)*],
            };
        }
    )*};
    (@default) => { Default::default() };
    (@default $number:literal) => { $number as f64 };
    (@type bool) => { bool };
    (@type byte) => { u8 };
    (@type int8) => { i8 };
    (@type uint8) => { u8 };
    (@type int16) => { i16 };
    (@type uint16) => { u16 };
    (@type int32) => { i32 };
    (@type uint32) => { u32 };
    (@type float32) => { f32 };
    (@type float64) => { f64 };
    (@type string) => { String };
    (@type $package:ident / $name:ident) => { $name };
    (@type $type:ident $(/ $part:ident)? []) => { Vec<messages!(@type $type $(/ $part)?)> };
    (@type $type:ident $(/ $part:ident)? [<= $most:literal]) => {
        Vec<messages!(@type $type $(/ $part)?)>
    };
    (@type $type:ident $(/ $part:ident)? [$count:literal]) => {
        [messages!(@type $type $(/ $part)?); $count]
    };
}

pub(super) use messages;
