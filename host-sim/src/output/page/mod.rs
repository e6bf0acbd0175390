//! Parts of a report page: its frame, tables that fold on narrow screens, plots with a table of their values.

mod document;
mod figure;
mod table;

pub(super) use document::{document, prose};
pub(super) use figure::Figure;
pub(super) use table::{Row, Table};
