//! Type codes of chunks, identifiers of classes and numbers of units, as openNURBS documents them.

use crate::unit::LengthUnit;

/// Chunks whose value is the datum itself.
pub(super) const SHORT: u32 = 0x8000_0000;
/// Chunks that end with a checksum.
pub(super) const CHECKED: u32 = 0x8000;

pub(super) const COMMENT: u32 = 0x0000_0001;
pub(super) const END_OF_FILE: u32 = 0x0000_7FFF;
pub(super) const END_OF_TABLE: u32 = 0xFFFF_FFFF;
pub(super) const ANONYMOUS: u32 = 0x4000_8000;

pub(super) const PROPERTIES: u32 = 0x1000_0014;
pub(super) const LIBRARY_VERSION: u32 = 0xA000_0026;
pub(super) const SETTINGS: u32 = 0x1000_0015;
pub(super) const UNITS: u32 = 0x2000_8031;
pub(super) const LAYERS: u32 = 0x1000_0011;
pub(super) const LAYER: u32 = 0x2000_8050;
pub(super) const OBJECTS: u32 = 0x1000_0013;
pub(super) const OBJECT: u32 = 0x2000_8070;
pub(super) const OBJECT_TYPE: u32 = 0x8200_0071;
pub(super) const ATTRIBUTES: u32 = 0x0200_8072;
pub(super) const OBJECT_END: u32 = 0x8200_007F;

pub(super) const CLASS: u32 = 0x0002_7FFA;
pub(super) const CLASS_ID: u32 = 0x0002_FFFB;
pub(super) const CLASS_DATA: u32 = 0x0002_FFFC;
pub(super) const CLASS_END: u32 = 0x8002_7FFF;

/// Tables that a reader expects in this order between the settings and the layers.
pub(super) const BEFORE_LAYERS: [u32; 4] = [0x1000_0016, 0x1000_0025, 0x1000_0010, 0x1000_0023];
/// Tables between the layers and the objects.
pub(super) const BEFORE_OBJECTS: [u32; 6] =
    [0x1000_0018, 0x1000_0019, 0x1000_0020, 0x1000_0012, 0x1000_0022, 0x1000_0021];
/// The table after the objects; one of user data may follow, but never an empty one.
pub(super) const AFTER_OBJECTS: u32 = 0x1000_0026;

/// A class of openNURBS by the bytes of its identifier.
pub(super) type ClassId = [u8; 16];

/// Most classes of geometry differ in the first byte only.
const fn geometry(first: u8) -> ClassId {
    [
        first, 0xD4, 0xD7, 0x4E, 0x47, 0xE9, 0xD3, 0x11, 0xBF, 0xE5, 0x00, 0x10, 0x83, 0x01, 0x22,
        0xF0,
    ]
}

pub(super) const LINE_CURVE: ClassId = geometry(0xDB);
pub(super) const NURBS_CURVE: ClassId = geometry(0xDD);
pub(super) const NURBS_SURFACE: ClassId = geometry(0xDE);
pub(super) const PLANE_SURFACE: ClassId = geometry(0xDF);
pub(super) const POLY_CURVE: ClassId = geometry(0xE0);
pub(super) const MESH: ClassId = geometry(0xE4);
pub(super) const POLYLINE_CURVE: ClassId = geometry(0xE6);
pub(super) const BREP: ClassId = [
    0xC5, 0xDB, 0xB5, 0x60, 0x60, 0xE6, 0xD3, 0x11, 0xBF, 0xE4, 0x00, 0x10, 0x83, 0x01, 0x22, 0xF0,
];
pub(super) const POINT_CLOUD: ClassId = [
    0x47, 0xF3, 0x88, 0x24, 0xFA, 0xF8, 0xD3, 0x11, 0xBF, 0xEC, 0x00, 0x10, 0x83, 0x01, 0x22, 0xF0,
];
pub(super) const POINT: ClassId = [
    0x1D, 0x1A, 0x10, 0xC3, 0x57, 0xF1, 0xD3, 0x11, 0xBF, 0xE7, 0x00, 0x10, 0x83, 0x01, 0x22, 0xF0,
];
pub(super) const ARC_CURVE: ClassId = [
    0x2A, 0xBE, 0x33, 0xCF, 0xB4, 0x09, 0xD4, 0x11, 0xBF, 0xFB, 0x00, 0x10, 0x83, 0x01, 0x22, 0xF0,
];
pub(super) const REV_SURFACE: ClassId = [
    0xD3, 0x20, 0x62, 0xA1, 0x3B, 0x16, 0xD4, 0x11, 0x80, 0x00, 0x00, 0x10, 0x83, 0x01, 0x22, 0xF0,
];
pub(super) const SUM_SURFACE: ClassId = [
    0x59, 0x53, 0xCD, 0xC4, 0x6D, 0x44, 0x90, 0x46, 0x9F, 0xF5, 0x29, 0x05, 0x97, 0x32, 0x47, 0x2B,
];
const EXTRUSION: ClassId = [
    0x75, 0x31, 0xF5, 0x36, 0xB8, 0x72, 0x47, 0x4D, 0xBF, 0x1F, 0xB4, 0xE6, 0xFC, 0x24, 0xF4, 0xB9,
];
const INSTANCE: ClassId = [
    0x38, 0xB6, 0xCF, 0xF9, 0xD4, 0xB9, 0x40, 0x43, 0x87, 0xE3, 0xC5, 0x6E, 0x78, 0x65, 0xD9, 0x6A,
];
const SUBD: ClassId = [
    0xD9, 0xA4, 0x9B, 0xF0, 0x5B, 0x45, 0xC3, 0x42, 0xBA, 0x3B, 0xE6, 0xCC, 0xAC, 0xEF, 0x85, 0x3B,
];
const TEXT_DOT: ClassId = [
    0x02, 0x83, 0x19, 0x74, 0xF4, 0xCD, 0x95, 0x4F, 0x96, 0x09, 0x6D, 0x68, 0x4F, 0x22, 0xAB, 0x37,
];
pub(super) const LAYER_CLASS: ClassId = [
    0x13, 0x98, 0x80, 0x95, 0x85, 0xE9, 0xD3, 0x11, 0xBF, 0xE5, 0x00, 0x10, 0x83, 0x01, 0x22, 0xF0,
];

/// What people call the objects of a class that is not read.
pub(super) fn class_name(class: &ClassId) -> &'static str {
    match *class {
        EXTRUSION => "extrusion",
        INSTANCE => "block instance",
        SUBD => "SubD",
        TEXT_DOT => "text dot",
        LINE_CURVE | NURBS_CURVE | ARC_CURVE | POLY_CURVE | POLYLINE_CURVE => "curve",
        _ => "other object",
    }
}

/// A unit of its own, with a name and a length in metres.
pub(super) const CUSTOM_UNIT: i32 = 11;
const UNIT_NUMBERS: [(LengthUnit, i32); 9] = [
    (LengthUnit::Millimetre, 2),
    (LengthUnit::Centimetre, 3),
    (LengthUnit::Metre, 4),
    (LengthUnit::Kilometre, 5),
    (LengthUnit::Inch, 8),
    (LengthUnit::Foot, 9),
    (LengthUnit::Mile, 10),
    (LengthUnit::Decimetre, 14),
    (LengthUnit::Yard, 19),
];

/// The unit of a number; none for a custom one and for those without a symbol here.
pub(super) fn numbered_unit(number: i32) -> Option<LengthUnit> {
    UNIT_NUMBERS.iter().find(|(_, n)| *n == number).map(|(unit, _)| unit.clone())
}

/// Units without a symbol of their own, with their lengths in metres.
pub(super) const RARE_UNITS: [(i32, &str, f64); 9] = [
    (1, "micron", 1e-6),
    (6, "microinch", 2.54e-8),
    (7, "mil", 2.54e-5),
    (12, "angstrom", 1e-10),
    (13, "nanometre", 1e-9),
    (15, "dekametre", 10.0),
    (16, "hectometre", 100.0),
    (17, "megametre", 1e6),
    (23, "nautical mile", 1852.0),
];

/// The number of a unit in a file.
pub(super) fn unit_number(unit: &LengthUnit) -> i32 {
    UNIT_NUMBERS.iter().find(|(known, _)| known == unit).map_or(CUSTOM_UNIT, |(_, n)| *n)
}
