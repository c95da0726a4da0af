//! Why a problem cannot be solved as it stands.

use std::fmt;

/// What makes it impossible to attempt a solve. Ending early is not an error but a
/// [`Status`](crate::Status).
///
/// # Example
/// ```
/// use gp_solver::{Closeness, Factorization, Problem, System};
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("target", vec![1.0, 2.0], vec![1.0, 1.0])); // of two unknowns
/// let fault = System::new(problem, Factorization::Auto).err().expect("there is only one");
/// assert_eq!(
///     fault.to_string(),
///     "block `target`, element 1 reads unknown 1, but there are only 1; \
///      correct its columns or make the problem larger"
/// );
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum SolverError {
    /// A slice of the wrong length.
    #[error("{what} has {found} values, expected {expected}; give one for each")]
    WrongLength { what: &'static str, expected: usize, found: usize },
    /// An element reads an unknown the problem does not have.
    #[error(
        "block `{block}`, element {element} reads unknown {column}, but there are only \
         {unknowns}; correct its columns or make the problem larger"
    )]
    ColumnOutOfRange { block: String, element: usize, column: usize, unknowns: usize },
    /// An element lists an unknown twice.
    #[error("block `{block}`, element {element} lists unknown {column} twice; add the two columns")]
    RepeatedColumn { block: String, element: usize, column: usize },
    /// An element of an energy block whose Hessian would not be square.
    #[error(
        "energy block `{block}`, element {element} has {rows} rows for {columns} columns; push \
         it with as many rows as columns"
    )]
    NotSquare { block: String, element: usize, rows: usize, columns: usize },
    /// An energy where rows are wanted.
    #[error("block `{block}` is an energy without rows; equations are made of residual blocks")]
    NoRows { block: String },
    /// NaN or infinity from a block.
    #[error(
        "{quantity} of row {row} of block `{block}` is {value} at the current iterate; \
             start elsewhere or guard the formula"
    )]
    NotFinite { block: String, row: usize, quantity: Quantity, value: f64 },
    /// NaN or infinity among the start values.
    #[error("unknown {variable} starts at {value}; give a finite start")]
    StartNotFinite { variable: usize, value: f64 },
    /// A caller ordering that is no permutation of the unknowns.
    #[error(
        "the ordering is no permutation: entry {entry} is {variable}, which is out of range \
             or occurs twice; list each of the {unknowns} unknowns once"
    )]
    NotAPermutation { entry: usize, variable: usize, unknowns: usize },
    /// A setting outside its range.
    #[error("option {name} is {value}; it must be {need}")]
    BadOption { name: &'static str, value: f64, need: &'static str },
    /// A matrix that should be positive definite is not.
    #[error(
        "the matrix is not positive definite: the pivot of unknown {variable} is not \
             positive; add a regulariser or an equation that fixes this unknown"
    )]
    NotPositiveDefinite { variable: usize },
    /// Entries outside the symmetric pattern a factorisation was made for.
    #[error("entry ({row}, {column}) lies outside a square matrix of size {size}")]
    EntryOutOfRange { row: usize, column: usize, size: usize },
    /// More stored values than 32-bit offsets can address.
    #[error("the normal matrix needs {entries} entries, more than 2^32; split the problem")]
    TooLarge { entries: usize },
    /// Out of memory within the sparse factorisation.
    #[error("out of memory while factorising a matrix of size {size}; use a coarser model")]
    OutOfMemory { size: usize },
    /// A group of unknowns that is not there.
    #[error("there is no group of unknowns `{name}`; there are: {groups}")]
    NoSuchGroup { name: String, groups: String },
    /// A block that is not there, or no longer.
    #[error(
        "the problem has no block number {block}; it was removed or belongs to another problem"
    )]
    NoSuchBlock { block: usize },
    /// A block that has no reference to be given anew.
    #[error("block `{block}` has no reference of {values} values; replace the block")]
    NoReference { block: String, values: usize },
    /// A block put in the place of one with other elements.
    #[error("block `{block}` has other elements than the one it is to replace; add it instead")]
    OtherElements { block: String },
    /// A block of a problem that is solved as a quadratic program.
    #[error(
        "block `{block}` is not quadratic, but its problem is solved exactly; give linear rows or a \
         quadratic energy that say so"
    )]
    NotQuadratic { block: String },
    /// A factorisation that is not compiled in.
    #[error("this problem needs a sparse factorisation; build gp-solver with its feature `sparse`")]
    NeedsSparse,
    /// A checkpoint that belongs to something else.
    #[error("the checkpoint belongs to {what}; resume with the input and options it was made with")]
    ForeignCheckpoint { what: String },
    /// A checkpoint of another problem or method.
    #[error(
        "the checkpoint does not fit: {what} is {found}, expected {expected}; resume with \
             the problem and options it was written with"
    )]
    CheckpointMismatch { what: &'static str, expected: usize, found: usize },
}

/// What a block returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A residual.
    Residual,
    /// A derivative with respect to the unknown of this number.
    Derivative(usize),
    /// An energy.
    Energy,
    /// An entry of a gradient.
    Gradient,
    /// An entry of a Hessian.
    Hessian,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Residual => f.write_str("the residual"),
            Self::Derivative(unknown) => write!(f, "the derivative by unknown {unknown}"),
            Self::Energy => f.write_str("the energy"),
            Self::Gradient => f.write_str("the gradient entry"),
            Self::Hessian => f.write_str("the Hessian row"),
        }
    }
}
