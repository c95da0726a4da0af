//! What a run may take of the machine, and what it would take.

use std::fmt;

/// Memory a reader may use besides [`BYTES_PER_FILE_BYTE`] times its file.
const READING_BYTES: u64 = 64 << 20;
/// Memory a reader may use per byte of its file.
const BYTES_PER_FILE_BYTE: u64 = 16;
/// Bytes of a vertex or a face while it is read: three coordinates, or a list of corners.
const BYTES_PER_VERTEX: u64 = 24;
/// Of the memory of a reader one part in so many is for the model.
const MODEL_SHARE: u64 = 2;
/// Share of the memory a run may ask for.
const MEMORY_SHARE: f64 = 0.8;
/// Core seconds a run may ask for per thread: an hour.
const SECONDS: u64 = 3600;

/// What a run may take.
///
/// An *evaluation* is the unit of work in estimates: one microsecond of one core, about what a point
/// of a surface with its derivatives takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Memory in bytes.
    pub bytes: u64,
    /// Vertices of all meshes of a file or a result.
    pub vertices: u64,
    /// Faces of all meshes of a file or a result.
    pub faces: u64,
    /// Evaluations, see above.
    pub evaluations: u64,
    /// Threads.
    pub threads: usize,
}

impl Budget {
    /// The most threads that are ever started: more only cost memory.
    pub const MOST_THREADS: usize = 1024;

    /// Of a run on a machine with so many bytes of memory, on so many threads: four fifths of the
    /// memory, an hour of time, and as many vertices and faces as ids can count.
    ///
    /// # Example
    /// ```
    /// use geom_core::{Budget, Cost};
    /// let laptop = Budget::of_machine(16 << 30, 8);
    /// let modest = Cost { bytes: 2 << 30, evaluations: 1_000_000, ..Cost::default() };
    /// assert!(laptop.check(modest, "panels").is_ok());
    /// let error = laptop.check(Cost { bytes: 100 << 30, ..modest }, "panels").unwrap_err();
    /// assert_eq!(
    ///     error.to_string(),
    ///     "`panels` asks for about 107 GB of memory, and 14 GB are the limit on this machine; \
    ///      ask for less"
    /// );
    /// ```
    #[must_use]
    pub fn of_machine(memory: u64, threads: usize) -> Self {
        let threads = threads.clamp(1, Self::MOST_THREADS);
        Self {
            bytes: (memory as f64 * MEMORY_SHARE) as u64,
            vertices: u64::from(u32::MAX / 2),
            faces: u64::from(u32::MAX / 2),
            evaluations: SECONDS * 1_000_000 * threads as u64,
            threads,
        }
    }

    /// Of reading a file of so many bytes: 64 MiB and 16 times the file, and the vertices and faces
    /// that fit into what its [model](Self::model_bytes) may take, at 24 bytes each.
    #[must_use]
    pub fn of_file(bytes: u64) -> Self {
        let bytes = READING_BYTES.saturating_add(bytes.saturating_mul(BYTES_PER_FILE_BYTE));
        let count = (bytes / MODEL_SHARE / BYTES_PER_VERTEX).min(u64::from(u32::MAX / 2));
        Self { bytes, vertices: count, faces: count, evaluations: bytes, threads: 1 }
    }

    /// What the model of a file may take: half of the memory. The text and the tables on the way to
    /// it take the other.
    ///
    /// # Example
    /// ```
    /// use geom_core::Budget;
    /// assert_eq!(Budget::of_file(1 << 20).model_bytes(), (32 << 20) + 8 * (1 << 20));
    /// ```
    #[must_use]
    pub fn model_bytes(&self) -> usize {
        usize::try_from(self.bytes / MODEL_SHARE).unwrap_or(usize::MAX)
    }

    /// Refuses a cost that exceeds the budget, in the name of the option that asks for it.
    ///
    /// # Errors
    /// [`BudgetError`] for the first of bytes, evaluations, vertices and faces that does.
    pub fn check(&self, cost: Cost, option: &'static str) -> Result<(), BudgetError> {
        let per_second = 1_000_000 * self.threads.max(1) as u64;
        let [needs, most] = [cost.evaluations, self.evaluations].map(|e| e / per_second);
        let all = [
            (cost.bytes, self.bytes, Amount::Bytes(cost.bytes), Amount::Bytes(self.bytes)),
            (cost.evaluations, self.evaluations, Amount::Seconds(needs), Amount::Seconds(most)),
            (
                cost.vertices,
                self.vertices,
                Amount::Vertices(cost.vertices),
                Amount::Vertices(self.vertices),
            ),
            (cost.faces, self.faces, Amount::Faces(cost.faces), Amount::Faces(self.faces)),
        ];
        match all.into_iter().find(|(needs, most, ..)| needs > most) {
            Some((.., needs, most)) => Err(BudgetError { option, needs, most }),
            None => Ok(()),
        }
    }
}

/// What a run would take, estimated from its options before it starts: to a factor of two or three.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Memory in bytes.
    pub bytes: u64,
    /// Vertices of the result.
    pub vertices: u64,
    /// Faces of the result.
    pub faces: u64,
    /// Evaluations, see [`Budget`].
    pub evaluations: u64,
}

/// An amount in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Amount {
    /// Bytes of memory.
    Bytes(u64),
    /// Seconds.
    Seconds(u64),
    /// Vertices.
    Vertices(u64),
    /// Faces.
    Faces(u64),
}

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Bytes(b) if b >= 10_000_000_000 => write!(f, "{:.0} GB", b as f64 / 1e9),
            Self::Bytes(b) => write!(f, "{:.2} GB", b as f64 / 1e9),
            Self::Seconds(s) if s >= 7200 => write!(f, "{:.0} hours", s as f64 / 3600.0),
            Self::Seconds(s) => write!(f, "{:.0} minutes", (s as f64 / 60.0).ceil()),
            Self::Vertices(n) => write!(f, "{n} vertices"),
            Self::Faces(n) => write!(f, "{n} faces"),
        }
    }
}

/// A run that would exceed its budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{option}` asks for about {needs}{}, and {most} are the limit on this machine; ask for less",
    self.of()
)]
pub struct BudgetError {
    /// The option that asks for so much.
    pub option: &'static str,
    /// What it needs.
    pub needs: Amount,
    /// What there is.
    pub most: Amount,
}

impl BudgetError {
    fn of(&self) -> &'static str {
        match self.needs {
            Amount::Bytes(_) => " of memory",
            Amount::Seconds(_) => " of work",
            Amount::Vertices(_) | Amount::Faces(_) => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_amount_is_refused_in_its_own_words() {
        let budget = Budget {
            bytes: 1 << 30,
            vertices: 10,
            faces: 20,
            evaluations: 600_000_000,
            threads: 1,
        };
        let message = |cost| budget.check(cost, "levels").unwrap_err().to_string();
        let none = Cost::default();
        assert!(budget.check(none, "levels").is_ok());
        assert_eq!(
            message(Cost { evaluations: 86_400_000_000, ..none }),
            "`levels` asks for about 24 hours of work, and 10 minutes are the limit on this machine; ask for less"
        );
        assert!(
            message(Cost { bytes: 2 << 30, ..none }).contains("2.15 GB of memory, and 1.07 GB")
        );
        assert!(message(Cost { vertices: 11, ..none }).contains("11 vertices, and 10 vertices"));
        assert!(message(Cost { faces: 21, ..none }).contains("21 faces"));
    }

    #[test]
    fn nothing_overflows() {
        let budget = Budget::of_machine(u64::MAX, usize::MAX);
        assert_eq!(budget.threads, Budget::MOST_THREADS);
        let file = Budget::of_file(u64::MAX);
        assert_eq!((file.bytes, file.vertices), (u64::MAX, u64::from(u32::MAX / 2)));
        assert_eq!(file.model_bytes(), usize::MAX / 2);
        assert!(file.check(Cost { vertices: u64::MAX, ..Cost::default() }, "input").is_err());
    }
}
