//! The header: what elements follow, and how.

use crate::error::{ReadError, clip};

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Float32,
    Float64,
}

impl Number {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::Int8,
            "uchar" | "uint8" => Self::Uint8,
            "short" | "int16" => Self::Int16,
            "ushort" | "uint16" => Self::Uint16,
            "int" | "int32" => Self::Int32,
            "uint" | "uint32" => Self::Uint32,
            "float" | "float32" => Self::Float32,
            "double" | "float64" => Self::Float64,
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Int8 | Self::Uint8 => 1,
            Self::Int16 | Self::Uint16 => 2,
            Self::Int32 | Self::Uint32 | Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }
}

/// One property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) number: Number,
    /// The type of the length, if the property is a list.
    pub(super) length: Option<Number>,
}

/// A kind of element with its number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

/// The header of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) comments: Vec<String>,
    /// First byte and line after the header.
    pub(super) body: usize,
    pub(super) body_line: usize,
}

pub(super) fn read_header(bytes: &[u8]) -> Result<Header, ReadError> {
    let (mut at, mut number) = (0, 0);
    let mut next = || {
        let rest = &bytes[at..];
        let end = rest.iter().position(|b| *b == b'\n')?;
        at += end + 1;
        number += 1;
        Some((String::from_utf8_lossy(&rest[..end]).trim_end().to_owned(), number, at))
    };
    if next().is_none_or(|(line, ..)| !line.eq_ignore_ascii_case("ply")) {
        return Err(ReadError::text(1, "the file does not begin with `ply`", "export it again"));
    }
    let mut header = Header {
        encoding: Encoding::Ascii,
        elements: Vec::new(),
        comments: Vec::new(),
        body: 0,
        body_line: 0,
    };
    let mut has_format = false;
    while let Some((line, number, after)) = next() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let fault = |what: &str, mend: &str| {
            Err(ReadError::text(number, format!("{what} `{}`", clip(&line)), mend))
        };
        match words[..] {
            ["format", format, version] => {
                if version != "1.0" {
                    return fault("unknown version in", "write `format NAME 1.0`");
                }
                has_format = true;
                header.encoding = match format {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return fault("unknown", "use ascii or a binary format"),
                };
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return fault("no count in", "write `element NAME COUNT`");
                };
                if header.elements.iter().any(|e| e.name == name) {
                    return fault("declared before:", "give every kind of element once");
                }
                let element = Element { name: name.into(), count, properties: Vec::new() };
                header.elements.push(element);
            }
            ["property", ref property @ ..] => {
                let Some(property) = parse_property(property) else {
                    return fault("cannot understand", "write `property TYPE NAME`");
                };
                match header.elements.last_mut() {
                    Some(element) => element.properties.push(property),
                    None => return fault("no element before", "declare the element first"),
                }
            }
            ["end_header"] => {
                if !has_format {
                    return fault("no format before", "add `format ascii 1.0` or a binary format");
                }
                (header.body, header.body_line) = (after, number + 1);
                return Ok(header);
            }
            ["comment" | "obj_info", ..] => {
                header.comments.push(line.split_once(' ').map_or("", |(_, rest)| rest).to_owned());
            }
            [] => {}
            _ => return fault("cannot understand", "remove the line or export the file again"),
        }
    }
    Err(ReadError::text(number + 1, "the header has no `end_header`", "the file is truncated"))
}

fn parse_property(words: &[&str]) -> Option<Property> {
    match words {
        ["list", length, number, name] => {
            let length =
                Number::of(length).filter(|n| !matches!(n, Number::Float32 | Number::Float64));
            Some(Property {
                name: (*name).into(),
                number: Number::of(number)?,
                length: Some(length?),
            })
        }
        [number, name] => {
            Some(Property { name: (*name).into(), number: Number::of(number)?, length: None })
        }
        _ => None,
    }
}
