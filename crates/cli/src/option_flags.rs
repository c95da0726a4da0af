//! Flags made from the options of a method: names, forms, helps and defaults come from its table.

use std::fmt;
use std::path::Path;

use clap::builder::ValueParser;
use clap::{Arg, ArgAction, ArgMatches};
use gp_solver::{Field, Fields};
use serde::de::DeserializeOwned;

use crate::args::ConfigArgs;
use crate::failure::Failure;
use report::Report;

/// The flags of the options `O` that were given, with their texts.
#[derive(Clone)]
pub(crate) struct OptionFlags<O: Fields> {
    given: Vec<(&'static Field<O>, String)>,
}

impl<O: Fields> fmt::Debug for OptionFlags<O> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.given.iter().map(|(field, text)| (field.name, text))).finish()
    }
}

impl<O: Fields> OptionFlags<O> {
    /// The options in force: defaults, below the configuration file, below the flags.
    pub(crate) fn options(&self, config: &ConfigArgs) -> Result<O, Failure>
    where
        O: DeserializeOwned,
    {
        let mut options: O = config.load()?;
        for field in self.given.iter().flat_map(|(field, _)| field.replaces) {
            // A rule on the command line replaces whatever rule the file has.
            if let Some(other) = O::field(field) {
                (other.reset)(&mut options);
            }
        }
        let is_value = |(field, text): &&(&Field<O>, String)| {
            !is_file(field.name, text) && !is_auto(field, text)
        };
        for (field, text) in self.given.iter().filter(is_value) {
            (field.set)(&mut options, text)
                .map_err(|e| Failure::usage(format!("{}: {e}", flag(field.name))))?;
        }
        Ok(options)
    }

    /// What a library says of the options: of a flag, or of the file the option comes from.
    pub(crate) fn refused(&self, config: &ConfigArgs, error: impl fmt::Display) -> Failure {
        let said = error.to_string();
        let named = O::FIELDS.iter().find(|field| said.contains(&format!("`{}`", field.name)));
        let is_flag = match named {
            Some(field) => self.given.iter().any(|(given, _)| given.name == field.name),
            None => !self.given.is_empty(),
        };
        match &config.config {
            Some(file) if !is_flag => Failure::input(file, said),
            _ => Failure::usage(in_flags::<O>(&said)),
        }
    }

    /// Whether the word that stands for what the command chooses was given.
    pub(crate) fn is_chosen(&self, name: &str) -> bool {
        self.given.iter().any(|(field, text)| field.name == name && is_auto(field, text))
    }

    /// The file given in place of a value, for options that take one.
    pub(crate) fn file(&self, name: &str) -> Option<&Path> {
        let given =
            self.given.iter().find(|(field, text)| field.name == name && is_file(field.name, text));
        given.map(|(_, text)| Path::new(text))
    }
}

/// Options that take a file of this extension in place of a value; the command reads it.
const FILE_VALUES: [(&str, &str); 2] = [("layout", "obj"), ("symmetry", "ron")];

/// The word with which the command is asked to choose the nets of its levels after it has read its input.
const AUTO: &str = "auto";

/// Whether an option is the list of nets of a method, which the command can choose.
fn is_nets<O>(field: &Field<O>) -> bool {
    field.name == "levels" && field.separator.is_some()
}

fn is_auto<O>(field: &Field<O>, text: &str) -> bool {
    is_nets(field) && text.trim() == AUTO
}

fn is_file(name: &str, text: &str) -> bool {
    let extension = exchange::extension_of(Path::new(text));
    FILE_VALUES.iter().any(|(field, of)| *field == name && *of == extension)
}

/// Lists options as they are in force, but for those named, which the caller tells of itself.
pub(crate) fn list<O: Fields>(report: &mut Report, options: &O, but: &[&str]) {
    for field in O::FIELDS.iter().filter(|field| !but.contains(&field.name)) {
        if let Some(value) = (field.get)(options) {
            report.option(&field.name.replace('_', " "), value);
        }
    }
}

/// What a library says of fields in backticks, said of flags.
pub(crate) fn in_flags<O: Fields>(message: &str) -> String {
    O::FIELDS.iter().fold(message.to_owned(), |text, field| {
        text.replace(&format!("`{}`", field.name), &flag(field.name))
    })
}

/// What a library says of `file`, in flags.
pub(crate) fn refused<O: Fields>(file: &Path, error: impl fmt::Display) -> Failure {
    Failure::input(file, in_flags::<O>(&error.to_string()))
}

/// A value with the file it names put in its place: the control points of `relation curve=FILE`.
fn from_file(name: &str, text: &str) -> Result<String, String> {
    let Some(path) = text.strip_prefix("curve=").filter(|_| name == "relation").map(Path::new)
    else {
        return Ok(text.to_owned());
    };
    if path.extension().is_none_or(|e| e != "ron") {
        return Ok(text.to_owned());
    }
    let points: Vec<(f64, f64)> =
        exchange::read_ron(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let points: Vec<String> = points.iter().map(|(h, k)| format!("{h},{k}")).collect();
    Ok(format!("curve={}", points.join(";")))
}

fn flag(name: &str) -> String {
    format!("--{}", name.replace('_', "-"))
}

fn arg<O: Fields>(field: &'static Field<O>, defaults: &O) -> Arg {
    let mut help = field.help();
    if let Some((_, extension)) = FILE_VALUES.iter().find(|(name, _)| *name == field.name) {
        help.push_str(&format!(", or the name of a file .{extension}"));
    }
    if is_nets(field) {
        help.push_str(&format!("; {AUTO}: nets that suit the input"));
    }
    if let Some(default) = (field.get)(defaults).filter(|_| !field.is_switch) {
        help.push_str(&format!(" [default: {default}]"));
    }
    let check = move |text: &str| -> Result<String, String> {
        if is_file(field.name, text) || is_auto(field, text) {
            return Ok(text.to_owned());
        }
        let text = from_file(field.name, text)?;
        (field.set)(&mut O::default(), &text).map(|()| text)
    };
    let arg = Arg::new(field.name)
        .long(field.name.replace('_', "-"))
        .help(help)
        .value_parser(ValueParser::new(check));
    let is_rare = field.doc.iter().any(|line| line.to_lowercase().contains("rarely needed"));
    let arg = arg.hide_short_help(is_rare);
    if field.is_switch {
        // `--flag` or `--flag=false`; the action is named, since clap's own for a flag without a
        // value would say false where it is not given.
        let arg = arg.num_args(0..=1).require_equals(true).default_missing_value("true");
        return arg.action(ArgAction::Set).hide_possible_values(true).value_name("BOOL");
    }
    let action = if field.separator.is_some() { ArgAction::Append } else { ArgAction::Set };
    arg.value_name(field.form).action(action).allow_hyphen_values(true)
}

impl<O: Fields> clap::Args for OptionFlags<O> {
    fn augment_args(command: clap::Command) -> clap::Command {
        let defaults = O::default();
        O::FIELDS.iter().fold(command, |command, field| command.arg(arg(field, &defaults)))
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl<O: Fields> clap::FromArgMatches for OptionFlags<O> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let text = |field: &Field<O>| {
            let words: Vec<&str> =
                matches.get_many::<String>(field.name)?.map(String::as_str).collect();
            let between = field.separator.map(String::from).unwrap_or_default();
            Some(words.join(&between))
        };
        let given = O::FIELDS.iter().filter_map(|field| Some((field, text(field)?)));
        Ok(Self { given: given.collect() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
