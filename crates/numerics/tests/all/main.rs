//! The decompositions against each other and against closed forms.

mod algebra;
mod lanes;
mod numbers;
