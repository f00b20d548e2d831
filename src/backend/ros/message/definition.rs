//! What a message type is called and made of.

/// A message type: its name and the text of its definition.
pub struct Definition {
    /// As in `sensor_msgs/msg/JointState`.
    pub name: &'static str,
    /// Its fields, one line each, in the language of `.msg` files.
    pub fields: &'static str,
    /// The definitions of the types that it names.
    pub parts: &'static [&'static Definition],
}

/// A type that is sent over topics.
pub trait Described {
    /// What it is called and made of.
    const DEFINITION: Definition;
}

impl Definition {
    /// The package, as in `sensor_msgs`.
    pub fn package(&self) -> &'static str {
        self.name.split('/').next().unwrap_or_default()
    }

    /// The name in its package, as in `JointState`.
    pub fn short_name(&self) -> &'static str {
        self.name.rsplit('/').next().unwrap_or_default()
    }

    /// The whole definition with those of all parts: a schema of encoding `ros2msg`.
    pub fn text(&self) -> String {
        let mut text = self.fields.to_owned();
        let mut told = Vec::new();
        self.append_parts(&mut text, &mut told);
        text
    }

    fn append_parts(&self, text: &mut String, told: &mut Vec<&'static str>) {
        for part in self.parts {
            if !told.contains(&part.name) {
                told.push(part.name);
                let rule = "=".repeat(80);
                let name = part.name.replace("/msg/", "/");
                *text += &format!("{rule}\nMSG: {name}\n{}", part.fields);
                part.append_parts(text, told);
            }
        }
    }
}
