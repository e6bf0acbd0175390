//! The one place that calls the diagnosis.

use anyhow::Result;
use identify::fit::simulator::Simulator;
use identify::record::data::Data;
use identify::{Options, examine};
use serde_json::Value;
use simulation::record::Record;

use crate::hidden::Hidden;

/// What is asked to name the causes in a record: the diagnosis, or in tests of the campaign something that knows better.
pub type Diagnose<'a> = dyn Fn(&Hidden) -> Result<Value> + Sync + 'a;

/// The report of the diagnosis on a record, as `vsj diagnose --json` prints it.
///
/// # Errors
/// The record is refused.
pub fn diagnose(hidden: &Hidden) -> Result<Value> {
    Ok(serde_json::to_value(identify::examine::diagnose(&hidden.record(), &Options::default())?)?)
}

/// What the model that the diagnosis makes of the first `rows` of a record foretells of all of it, in V, from the voltages
/// alone; and the causes that it named.
///
/// # Errors
/// As [`diagnose`].
pub fn foretell(hidden: &Hidden, rows: usize) -> Result<(Vec<f64>, Vec<&'static str>)> {
    let (whole, options) = (hidden.record(), Options::default());
    let first = Record { name: whole.name.clone(), rows: whole.rows[..rows].to_vec() };
    let learnt = examine(&first, &options, |_| ())?;
    // Some numbers of the model are parts of the full scale that it was learnt at.
    let data = Data { full_scale_v: learnt.data.full_scale_v, ..Data::new(&whole, options.input) };
    let mut foretold = Vec::new();
    Simulator::new(&data, &options.base).run(&learnt.extended.model, &mut foretold);
    // A bound that readings stopped at exactly is a finding, but no part of the model.
    let middle = learnt.data.reading.iter().sum::<f64>() / rows as f64;
    for limit in learnt
        .report
        .findings
        .iter()
        .filter_map(|finding| Some(finding.parameters.iter().find(|it| it.0 == "limit")?.1.value))
    {
        foretold.iter_mut().for_each(|y| *y = if limit > middle { y.min(limit) } else { y.max(limit) });
    }
    Ok((foretold, learnt.report.findings.iter().map(|finding| finding.cause).collect()))
}
