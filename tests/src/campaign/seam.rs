//! The one place that calls the diagnosis.

use anyhow::Result;
use host_sim::diagnose::Options;
use serde_json::Value;

use crate::hidden::Hidden;

/// What is asked to name the causes in a record: the diagnosis, or in tests of the campaign something that knows better.
pub type Diagnose<'a> = dyn Fn(&Hidden) -> Result<Value> + Sync + 'a;

/// The report of the diagnosis on a record, as `vsj diagnose --json` prints it.
///
/// # Errors
/// The record is refused.
pub fn diagnose(hidden: &Hidden) -> Result<Value> {
    Ok(serde_json::to_value(host_sim::diagnose::diagnose(&hidden.record(), &Options::default())?)?)
}
