//! A thing that can be put into something and taken out alone.

/// Puts something into a `T`, or takes it out.
type Set<T> = Box<dyn Fn(&mut T, bool)>;

/// A switch in a `T`.
pub struct Switch<T> {
    /// As in the scene's file.
    pub name: String,
    is_on: Box<dyn Fn(&T) -> bool>,
    set: Set<T>,
}

impl<T: 'static> Switch<T> {
    /// Read by `is_on`, moved by `set`.
    pub fn new(
        name: &str,
        is_on: impl Fn(&T) -> bool + 'static,
        set: impl Fn(&mut T, bool) + 'static,
    ) -> Self {
        Self { name: name.into(), is_on: Box::new(is_on), set: Box::new(set) }
    }

    /// Whether it is on.
    pub fn is_on(&self, of: &T) -> bool {
        (self.is_on)(of)
    }

    /// Puts in with its defaults what was not there, or takes it out.
    pub fn set(&self, of: &mut T, on: bool) {
        (self.set)(of, on);
    }

    /// The same switch of the larger `U` that keeps its `T` under `name`.
    pub fn within<U: 'static>(
        self,
        name: &str,
        get: fn(&U) -> &T,
        get_mut: fn(&mut U) -> &mut T,
    ) -> Switch<U> {
        let dotted = match (name, self.name.as_str()) {
            (name, "") => name.into(),
            ("", inner) => inner.into(),
            (name, inner) => format!("{name}.{inner}"),
        };
        let Self { is_on, set, .. } = self;
        Switch {
            name: dotted,
            is_on: Box::new(move |of| is_on(get(of))),
            set: Box::new(move |of, on| set(get_mut(of), on)),
        }
    }
}

impl<E: Default + 'static> Switch<Option<E>> {
    /// The whole of an optional table; its name is that under which it is kept.
    pub fn table() -> Self {
        Self::new("", Option::is_some, |table, on| match on {
            true => drop(table.get_or_insert_default()),
            false => *table = None,
        })
    }
}
