//! Columns as Python hands them over, copied so that no other thread can change them.

use numpy::PyReadonlyArray1;
use numpy::datetime::Timedelta;
use numpy::datetime::units::Nanoseconds;
use pyo3::prelude::*;
use simulation::record::columns::Column;

/// A column as Python hands it over.
#[derive(FromPyObject)]
pub(crate) enum Cells<'py> {
    /// Numbers; NaN is a missing reading.
    Numbers(PyReadonlyArray1<'py, f64>),
    /// Durations in ns; the smallest number is a missing one.
    Durations(PyReadonlyArray1<'py, Timedelta<Nanoseconds>>),
    /// Texts, such as time stamps.
    Texts(Vec<String>),
}

impl Cells<'_> {
    pub(crate) fn copied(self) -> Column {
        match self {
            Self::Numbers(numbers) => Column::Numbers(numbers.as_array().to_vec()),
            Self::Durations(durations) => {
                Column::Durations(durations.as_array().iter().map(|it| seconds((*it).into())).collect())
            }
            Self::Texts(texts) => Column::Texts(texts),
        }
    }
}

fn seconds(nanoseconds: i64) -> f64 {
    if nanoseconds == i64::MIN { f64::NAN } else { nanoseconds as f64 / 1e9 }
}
