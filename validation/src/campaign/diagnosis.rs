//! Interface to the diagnosis: the only module of this crate that calls `identify`.

use anyhow::Result;
use identify::fit::simulator::Simulator;
use identify::plant::base::Base;
use identify::record::data::Data;
#[cfg(feature = "sensitivity")]
pub use identify::stats::thresholds::vary;
pub use identify::stats::thresholds::{Threshold, empirical::ALL as THRESHOLDS};
use identify::{Options, examine};
use serde_json::Value;
use simulation::plant_file::PlantFile;
use simulation::record::Record;

use crate::ground_truth::LabelledRecord;

/// A diagnosis of a record, as the JSON of `vsj diagnose`; tests of the campaign replace it by an oracle.
pub type Diagnose<'a> = dyn Fn(&LabelledRecord) -> Result<Value> + Sync + 'a;

/// Report of `identify` on a record, as `vsj diagnose --json` prints it.
///
/// # Errors
/// The record is rejected.
pub fn diagnose(hidden: &LabelledRecord) -> Result<Value> {
    Ok(serde_json::to_value(identify::examine::diagnose(&hidden.record(), &Options::default())?)?)
}

/// Report of `identify` on a record compared with a nominal spring, as JSON.
///
/// # Errors
/// The record or the spring is rejected.
pub fn compared_with(record: &Record, nominal: PlantFile) -> Result<Value> {
    let options = Options { base: Base::new(nominal)?, ..Options::default() };
    Ok(serde_json::to_value(identify::examine::diagnose(record, &options)?)?)
}

/// Prediction of a whole record, in V, from its voltages alone by the model identified on its first `rows` rows, and
/// the causes that were named.
///
/// # Errors
/// As [`diagnose`].
pub fn predict(hidden: &LabelledRecord, rows: usize) -> Result<(Vec<f64>, Vec<&'static str>)> {
    let (whole, options) = (hidden.record(), Options::default());
    let first = Record { name: whole.name.clone(), rows: whole.rows[..rows].to_vec() };
    let identified = examine(&first, &options, |_| ())?;
    // Some parameters of the model are relative to the full scale of the record that it was identified on.
    let data = Data { full_scale_v: identified.data.full_scale_v, ..Data::new(&whole, options.input) };
    let mut predicted = Vec::new();
    Simulator::new(&data, &options.base).run(&identified.extended.model, &mut predicted);
    // A limit that readings stopped at exactly is a finding, but not part of the model.
    let middle = identified.data.reading.iter().sum::<f64>() / rows as f64;
    for limit in identified
        .report
        .findings
        .iter()
        .filter_map(|finding| Some(finding.parameters.iter().find(|it| it.0 == "limit")?.1.value))
    {
        predicted.iter_mut().for_each(|y| *y = if limit > middle { y.min(limit) } else { y.max(limit) });
    }
    Ok((predicted, identified.report.findings.iter().map(|finding| finding.cause).collect()))
}
