//! Readers and writers from the outside: formats, hostile files, round trips.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

mod formats;
mod glb;
mod guessing;
mod hostile_parts;
mod hostile_step;
mod mutations;
mod obj_freeform;
mod rhino;
mod round_trips;
mod sewing;
mod step;
mod step_faces;
mod table;
