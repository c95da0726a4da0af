//! Options of a method as a table: one place from which flags, keys of configuration files, lines
//! of reports and keyword arguments are made.
//!
//! [`options!`](crate::options) writes a struct of options together with its defaults and its
//! [`Field`]s. Every field's type is an [`OptionValue`]: it can be read from a word and printed
//! as one, and what it prints is what it reads.

use std::fmt;
use std::ops::Deref;

use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One option of the options `O`.
#[derive(Clone, Copy)]
pub struct Field<O: 'static> {
    /// Lower snake case: the key in configuration files; a flag has hyphens in its place.
    pub name: &'static str,
    /// The form of a value, such as `N`, `UxV` or `free|fixed`.
    pub form: &'static str,
    /// The lines of the doc comment.
    pub doc: &'static [&'static str],
    /// Whether the mere name means `true`.
    pub is_switch: bool,
    /// What stands between the values of a list.
    pub separator: Option<char>,
    /// Fields that are set back to their defaults where this one is given anew.
    pub replaces: &'static [&'static str],
    /// The value as text; `None` where there is no value.
    pub get: fn(&O) -> Option<String>,
    /// Reads a value; the error is a sentence about the text.
    pub set: fn(&mut O, &str) -> Result<(), String>,
    /// Sets the value back to its default.
    pub reset: fn(&mut O),
}

impl<O> Field<O> {
    /// The first paragraph of the doc comment on one line, without a full stop at its end.
    #[must_use]
    pub fn help(&self) -> String {
        let lines = self.doc.iter().map(|line| line.trim()).take_while(|line| !line.is_empty());
        let text = lines.collect::<Vec<_>>().join(" ");
        text.strip_suffix('.').map_or(text.clone(), str::to_owned)
    }
}

impl<O> fmt::Debug for Field<O> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Field").field("name", &self.name).field("form", &self.form).finish()
    }
}

/// Options with a table of their fields; written by [`options!`](crate::options).
pub trait Fields: Default + Sized + 'static {
    /// Every field in the order of the struct.
    const FIELDS: &'static [Field<Self>];

    /// The field of this name, with underscores or hyphens.
    #[must_use]
    fn field(name: &str) -> Option<&'static Field<Self>> {
        let same = |a: char, b: char| a == b || (a == '_' && b == '-');
        let is_named = |f: &&Field<Self>| {
            f.name.len() == name.len() && f.name.chars().zip(name.chars()).all(|(a, b)| same(a, b))
        };
        Self::FIELDS.iter().find(is_named)
    }
}

/// A value of an option: a word on the command line and in configuration files.
pub trait OptionValue: Sized {
    /// What a value looks like, for help texts.
    const FORM: &'static str;
    /// Whether the mere name of the option means a value.
    const IS_SWITCH: bool = false;
    /// What stands between the values of a list.
    const SEPARATOR: Option<char> = None;

    /// Reads a value.
    ///
    /// # Errors
    /// A sentence about the text: what it should have been.
    fn read(text: &str) -> Result<Self, String>;

    /// The value as [`read`](Self::read) takes it; `None` where there is none.
    fn print(&self) -> Option<String>;
}

impl OptionValue for f64 {
    const FORM: &'static str = "X";

    fn read(text: &str) -> Result<Self, String> {
        text.trim().parse().map_err(|_| format!("`{text}` is not a number"))
    }

    fn print(&self) -> Option<String> {
        Some(self.to_string())
    }
}

impl OptionValue for usize {
    const FORM: &'static str = "N";

    fn read(text: &str) -> Result<Self, String> {
        text.trim().parse().map_err(|_| format!("`{text}` is not a whole number from 0 up"))
    }

    fn print(&self) -> Option<String> {
        Some(self.to_string())
    }
}

impl OptionValue for bool {
    const FORM: &'static str = "true|false";
    const IS_SWITCH: bool = true;

    fn read(text: &str) -> Result<Self, String> {
        text.trim().parse().map_err(|_| format!("`{text}` is neither true nor false"))
    }

    fn print(&self) -> Option<String> {
        Some(self.to_string())
    }
}

impl OptionValue for String {
    const FORM: &'static str = "TEXT";

    fn read(text: &str) -> Result<Self, String> {
        Ok(text.to_owned())
    }

    fn print(&self) -> Option<String> {
        Some(self.clone())
    }
}

impl<T: OptionValue> OptionValue for Option<T> {
    const FORM: &'static str = T::FORM;
    const IS_SWITCH: bool = T::IS_SWITCH;
    const SEPARATOR: Option<char> = T::SEPARATOR;

    fn read(text: &str) -> Result<Self, String> {
        T::read(text).map(Some)
    }

    fn print(&self) -> Option<String> {
        self.as_ref().and_then(T::print)
    }
}

/// Values of a list of this kind.
pub trait ListItem: OptionValue {
    /// What stands between two of them: no part of a value.
    const BETWEEN: char;
    /// What a list looks like.
    const LIST_FORM: &'static str;
}

impl ListItem for f64 {
    const BETWEEN: char = ',';
    const LIST_FORM: &'static str = "X,...";
}

/// Several values: one word with the values between separators, a flag that may be repeated, and
/// in configuration files such a word or a list of words.
///
/// # Example
/// ```
/// use gp_solver::{Counts, List, OptionValue};
/// let levels = List::<Counts>::read("13x10,25x18")?;
/// assert_eq!((levels.len(), levels[1]), (2, Counts { u: 25, v: 18 }));
/// assert_eq!(levels.print().as_deref(), Some("13x10,25x18"));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct List<T>(pub Vec<T>);

impl<T> Default for List<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Deref for List<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T> From<Vec<T>> for List<T> {
    fn from(values: Vec<T>) -> Self {
        Self(values)
    }
}

impl<T> FromIterator<T> for List<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

impl<T: ListItem> OptionValue for List<T> {
    const FORM: &'static str = T::LIST_FORM;
    const SEPARATOR: Option<char> = Some(T::BETWEEN);

    fn read(text: &str) -> Result<Self, String> {
        text.split(T::BETWEEN).map(T::read).collect()
    }

    fn print(&self) -> Option<String> {
        let words: Option<Vec<String>> = self.0.iter().map(T::print).collect();
        words.filter(|w| !w.is_empty()).map(|w| w.join(T::BETWEEN.encode_utf8(&mut [0; 4])))
    }
}

impl<T: ListItem> Serialize for List<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().filter_map(T::print))
    }
}

impl<'de, T: ListItem> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Words<T>(std::marker::PhantomData<T>);
        impl<'de, T: ListItem> Visitor<'de> for Words<T> {
            type Value = List<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a text of the form {} or a list of texts", T::LIST_FORM)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<List<T>, E> {
                List::read(text).map_err(E::custom)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut words: A) -> Result<List<T>, A::Error> {
                let mut list = Vec::new();
                while let Some(word) = words.next_element::<String>()? {
                    list.push(T::read(&word).map_err(A::Error::custom)?);
                }
                Ok(List(list))
            }
        }
        deserializer.deserialize_any(Words(std::marker::PhantomData))
    }
}

/// Two positive counts, written `25x18`: along u, then along v.
///
/// # Example
/// ```
/// use gp_solver::{Counts, OptionValue};
/// assert_eq!(Counts::read("25x18"), Ok(Counts { u: 25, v: 18 }));
/// assert_eq!(Counts { u: 25, v: 18 }.print().as_deref(), Some("25x18"));
/// assert!(Counts::read("25").unwrap_err().contains("UxV"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Along u.
    pub u: usize,
    /// Along v.
    pub v: usize,
}

impl OptionValue for Counts {
    const FORM: &'static str = "UxV";

    fn read(text: &str) -> Result<Self, String> {
        let parts = text.split_once(['x', 'X']);
        let counts =
            parts.and_then(|(u, v)| Some((u.trim().parse().ok()?, v.trim().parse().ok()?)));
        match counts {
            Some((u, v)) if u > 0 && v > 0 => Ok(Self { u, v }),
            _ => Err(format!(
                "`{text}` is not of the form UxV with two positive counts, as in 25x18"
            )),
        }
    }

    fn print(&self) -> Option<String> {
        Some(self.to_string())
    }
}

impl ListItem for Counts {
    const BETWEEN: char = ',';
    const LIST_FORM: &'static str = "UxV,...";
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.u, self.v)
    }
}

/// Implements `Serialize` and `Deserialize` of [`OptionValue`]s as texts.
#[macro_export]
macro_rules! serde_as_text {
    ($($type:ty),* $(,)?) => { $(
        impl ::serde::Serialize for $type {
            fn serialize<S: ::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let text = $crate::OptionValue::print(self).unwrap_or_default();
                serializer.serialize_str(&text)
            }
        }
        impl<'de> ::serde::Deserialize<'de> for $type {
            fn deserialize<D: ::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = <String as ::serde::Deserialize>::deserialize(deserializer)?;
                <$type as $crate::OptionValue>::read(&text).map_err(::serde::de::Error::custom)
            }
        }
    )* };
}

serde_as_text!(Counts);

/// Makes an enum without payload an [`OptionValue`]: each variant with its word in lower snake
/// case, which is read with hyphens too and printed with hyphens. Pair it with serde's
/// `rename_all = "snake_case"`, so that configuration files use the same words.
///
/// ```
/// use gp_solver::{OptionValue, choices};
/// #[derive(Debug, PartialEq)]
/// enum Border { Free, HeldFast }
/// choices!(Border { Free = "free", HeldFast = "held_fast" });
/// assert_eq!(Border::FORM, "free|held-fast".replace('-', "_"));
/// assert_eq!(Border::read("held-fast"), Ok(Border::HeldFast));
/// assert_eq!(Border::HeldFast.print().as_deref(), Some("held-fast"));
/// assert!(Border::read("loose").unwrap_err().contains("free"));
/// ```
#[macro_export]
macro_rules! choices {
    ($type:ident { $first:ident = $word:literal $(, $variant:ident = $more:literal)* $(,)? }) => {
        impl $crate::OptionValue for $type {
            const FORM: &'static str = concat!($word $(, "|", $more)*);

            fn read(text: &str) -> Result<Self, String> {
                match text.trim().replace('-', "_").as_str() {
                    $word => Ok(Self::$first),
                    $($more => Ok(Self::$variant),)*
                    _ => Err(format!(
                        "`{text}` is none of {}",
                        [$word $(, $more)*].join(", ").replace('_', "-")
                    )),
                }
            }

            fn print(&self) -> Option<String> {
                let word = match self {
                    Self::$first => $word,
                    $(Self::$variant => $more,)*
                };
                Some(word.replace('_', "-"))
            }
        }
    };
}

/// Writes a struct of options with public fields, its `Default`, and its table [`Fields`].
///
/// A field may be called otherwise in the table (`as "move"`), and may say which others it
/// replaces where it is given anew.
///
/// ```
/// use gp_solver::{Fields, options};
/// options! {
///     /// Settings of a run.
///     #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
///     #[serde(default, deny_unknown_fields)]
///     pub struct Options {
///         /// Steps per level at most.
///         iterations: usize = 10;
///         /// Number of molds.
///         molds: Option<usize> = None, replaces ["per_root"];
///         /// Molds per square root of the number of panels.
///         per_root: Option<f64> = Some(3.0), replaces ["molds"];
///     }
/// }
/// let mut options = Options::default();
/// (Options::field("iterations").unwrap().set)(&mut options, "40").unwrap();
/// assert_eq!(options.iterations, 40);
/// assert_eq!(Options::FIELDS[0].help(), "Steps per level at most");
/// assert_eq!((Options::FIELDS[1].get)(&options), None);
/// ```
#[macro_export]
macro_rules! options {
    (
        $(#[$meta:meta])*
        $vis:vis struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $field:ident $(as $key:literal)? : $type:ty = $default:expr
                    $(, replaces [$($other:literal),*])? ;
            )*
        }
    ) => {
        $(#[$meta])*
        $vis struct $name {
            $(
                $(#[doc = $doc])+
                $(#[serde(rename = $key)])?
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $name {
            /// Every option with its name, form, default and help.
            $vis const FIELDS: &'static [$crate::Field<Self>] = <Self as $crate::Fields>::FIELDS;
        }

        impl $crate::Fields for $name {
            const FIELDS: &'static [$crate::Field<Self>] = &[
                $($crate::Field {
                    name: $crate::options!(@name $field $($key)?),
                    form: <$type as $crate::OptionValue>::FORM,
                    doc: &[$($doc),+],
                    is_switch: <$type as $crate::OptionValue>::IS_SWITCH,
                    separator: <$type as $crate::OptionValue>::SEPARATOR,
                    replaces: &[$($($other),*)?],
                    get: |options| $crate::OptionValue::print(&options.$field),
                    set: |options, text| {
                        options.$field = <$type as $crate::OptionValue>::read(text)?;
                        Ok(())
                    },
                    reset: |options| options.$field = $default,
                }),*
            ];
        }
    };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $key:literal) => { $key };
}

#[cfg(test)]
mod tests {
    use super::*;

    options! {
        /// Made up.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        struct Made {
            /// Control nets, coarse to fine:
            /// one level each.
            ///
            /// More than a help text tells.
            levels: List<Counts> = List::default();
            /// A switch.
            even: bool = false;
            /// Points to move.
            moves as "move": Option<f64> = Some(1.5);
        }
    }

    #[test]
    fn a_table_has_names_forms_defaults_and_help() {
        let names: Vec<_> = Made::FIELDS.iter().map(|f| f.name).collect();
        assert_eq!(names, ["levels", "even", "move"]);
        assert_eq!(Made::FIELDS[0].help(), "Control nets, coarse to fine: one level each");
        assert_eq!(Made::FIELDS[0].form, "UxV,...");
        assert!(Made::FIELDS[1].is_switch && Made::FIELDS[0].separator == Some(','));
        let defaults: Vec<_> = Made::FIELDS.iter().map(|f| (f.get)(&Made::default())).collect();
        assert_eq!(defaults, [None, Some("false".into()), Some("1.5".into())]);
    }

    #[test]
    fn what_is_printed_is_read() {
        let mut made = Made::default();
        (Made::FIELDS[0].set)(&mut made, "10x8,14x10").unwrap();
        assert_eq!(made.levels.0, [Counts { u: 10, v: 8 }, Counts { u: 14, v: 10 }]);
        assert_eq!((Made::FIELDS[0].get)(&made).as_deref(), Some("10x8,14x10"));
        let wrong = (Made::FIELDS[0].set)(&mut made, "10x").unwrap_err();
        assert!(wrong.contains("25x18"), "{wrong}");
    }

    #[test]
    fn configuration_files_use_the_same_words() {
        let text = serde_json::to_string(&Made::default()).unwrap();
        assert_eq!(text, r#"{"levels":[],"even":false,"move":1.5}"#);
        for levels in [r#""10x8,14x10""#, r#"["10x8","14x10"]"#] {
            let made: Made = serde_json::from_str(&format!(r#"{{"levels":{levels}}}"#)).unwrap();
            assert_eq!(made.levels.len(), 2);
        }
        assert!(serde_json::from_str::<Made>(r#"{"level":"1x1"}"#).is_err());
    }
}
