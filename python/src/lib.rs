//! The compiled part of the Python package `vsj`: records and arrays come in, reports as JSON and arrays go out.
//!
//! `vsj/__init__.py` makes data classes of them. Every long computation runs without the interpreter's lock.
//!
//! | module | what it is |
//! | --- | --- |
//! | `error` | the library's errors as exceptions |
//! | `table` | columns as Python hands them over |
//! | `records` | the options of a record, and its rows |
//! | `interrupt` | computations that Ctrl-C ends |
//! | `link` | a running MCU over its serial link |
//! | `analysis` | identification, diagnosis, plan |
//! | `controller` | the controller's tick, and the spring alone |
//! | `display` | numbers as the command shows them |

mod analysis;
mod controller;
mod display;
mod error;
mod interrupt;
mod link;
mod records;
mod table;

/// The compiled part of the package `vsj`.
#[pyo3::pymodule]
mod _vsj {
    #[pymodule_export]
    use crate::analysis::{diagnose, identify, plan};
    #[pymodule_export]
    use crate::controller::{Controller, predict, simulate};
    #[pymodule_export]
    use crate::display::{number, with_interval};
    #[pymodule_export]
    use crate::error::{BadInput, LinkError};
    #[pymodule_export]
    use crate::link::Port;
    #[pymodule_export]
    use crate::records::with_unit;

    /// The style sheet of the command's report pages.
    #[pymodule_export]
    const PAGE_STYLE: &str = include_str!("../../host-sim/src/output/page/page.css");
}
