//! The library's errors as exceptions.

use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};

pyo3::create_exception!(
    vsj,
    BadInput,
    PyValueError,
    "Invalid input, as one line that names what was given and what was expected."
);

pyo3::create_exception!(
    vsj,
    LinkError,
    PyRuntimeError,
    "A request that the MCU refused or did not answer, as one line that names the port."
);

/// The exception for an error of the link: [`BadInput`] for invalid input, [`LinkError`] for every other.
pub(crate) fn link_exception(error: anyhow::Error) -> PyErr {
    let text = format!("{error:#}");
    if error.is::<simulation::BadInput>() { BadInput::new_err(text) } else { LinkError::new_err(text) }
}

/// The exception for an error: [`BadInput`] for invalid input, `RuntimeError` for every other.
pub(crate) fn exception(error: anyhow::Error) -> PyErr {
    let text = format!("{error:#}");
    if error.is::<simulation::BadInput>() { BadInput::new_err(text) } else { PyRuntimeError::new_err(text) }
}
