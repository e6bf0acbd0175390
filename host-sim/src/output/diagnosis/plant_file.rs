//! The extended spring as the text of a plant file, with comments on where the record shows it.

use anyhow::Result;
use identify::Diagnosis;

use crate::output::diagnosis::text;

/// The plant file of a diagnosis of `record`.
///
/// # Errors
/// If the spring cannot be serialised.
pub(super) fn text(diagnosis: &Diagnosis, record: &str) -> Result<String> {
    let Diagnosis { report, plant, data, .. } = diagnosis;
    let comments = std::iter::once(format!("Identified from {}", record.replace(['\n', '\r'], " ")))
        .chain(text::limits_of_curves(report, data.scales()));
    let comments: String = comments.map(|comment| format!("# {comment}\n")).collect();
    Ok(comments + &plant.to_toml()?)
}
