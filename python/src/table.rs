//! Columns as Python hands them over, copied so that no other thread can change them.

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use simulation::record::columns::Column;

/// A column as Python hands it over.
#[derive(FromPyObject)]
pub(crate) enum Cells<'py> {
    /// Numbers; NaN is a missing reading.
    Numbers(PyReadonlyArray1<'py, f64>),
    /// Texts, such as time stamps.
    Texts(Vec<String>),
}

impl Cells<'_> {
    pub(crate) fn copied(self) -> Column {
        match self {
            Self::Numbers(numbers) => Column::Numbers(numbers.as_array().to_vec()),
            Self::Texts(texts) => Column::Texts(texts),
        }
    }
}
