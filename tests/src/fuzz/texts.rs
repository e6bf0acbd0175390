//! Files that options name: a diagnosis for a plan, and the columns of a record.

use identify::plan::Basis;
use simulation::csv_table::text::Source;
use simulation::record::columns_file;

use super::check_error;

/// A diagnosis for `vsj plan`: it is read, with or without its experiment, or refused in one line.
pub(super) fn plan(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let read = Basis::from_json("file", &text).and_then(|basis| basis.experiment("file").map(drop));
    if let Err(error) = read {
        check_error(&error, "file");
    }
}

/// A file for `--columns`: it is read or refused in one line.
pub(super) fn columns(bytes: &[u8]) {
    let read = Source::new("file", bytes).utf_8();
    if let Err(error) = read.and_then(|text| columns_file::parse("file", &text)) {
        check_error(&error, "file");
    }
}
