//! A diagnosis in the file's units: s, V, and the reading's own unit. Its sentences are in the user's units from the start; the
//! points of its models and the laws of its noise stay in the coordinates of the search.

use simulation::record::Record;

use crate::answer::{Finding, Parameter, Quality, Report};
use crate::dimension::Dimension;
use crate::fit::engine::Fit;
use crate::record::data::Data;
use crate::record::normalisation::Normalisation;
use crate::record::scales::Scales;
use crate::verdict::diagnosis::Diagnosis;

impl Diagnosis {
    /// Returns the diagnosis in the units of the record that it was made from.
    pub(crate) fn restored(mut self, record: &Record, normalisation: &Normalisation) -> Self {
        let scales = &normalisation.scales;
        report(&mut self.report, scales);
        data(&mut self.data, record, scales);
        for residual in [&mut self.baseline, &mut self.extended].map(|fit: &mut Fit| &mut fit.residual) {
            differences(residual, scales);
        }
        self.held_out.iter_mut().for_each(|residual| differences(residual, scales));
        for ranked in &mut self.ranking {
            ranked.rmse = scales.restored(Dimension::ReadingSize, ranked.rmse);
            ranked.held_out_rmse = scales.restored(Dimension::ReadingSize, ranked.held_out_rmse);
        }
        self
    }
}

fn differences(residual: &mut [f64], scales: &Scales) {
    residual.iter_mut().for_each(|left| *left = scales.restored(Dimension::ReadingDifference, *left));
}

fn report(report: &mut Report, scales: &Scales) {
    let size = |value: f64| scales.restored(Dimension::ReadingSize, value);
    let quality = |quality: &mut Quality| {
        for value in [&mut quality.rmse, &mut quality.held_out_rmse, &mut quality.one_step_rmse] {
            *value = size(*value);
        }
    };
    quality(&mut report.baseline);
    quality(&mut report.extended.quality);
    report.noise.sigma = size(report.noise.sigma);
    for Finding { parameters, rmse_before, rmse_after, .. } in &mut report.findings {
        parameters.iter_mut().for_each(|(_, it)| parameter(it, scales));
        (*rmse_before, *rmse_after) = (size(*rmse_before), size(*rmse_after));
    }
}

fn parameter(Parameter { value, low, high, unit, dimension, .. }: &mut Parameter, scales: &Scales) {
    let ends = [*low, *high].map(|end| scales.restored(*dimension, end));
    *value = scales.restored(*dimension, *value);
    (*low, *high) = if scales.size(*dimension) < 0.0 { (ends[1], ends[0]) } else { (ends[0], ends[1]) };
    *unit = dimension.unit(&scales.units);
}

/// Times, voltages and readings are those of the file, to the bit.
fn data(data: &mut Data, record: &Record, scales: &Scales) {
    let rows = || record.rows.iter().filter_map(|row| Some((row, row.measured?)));
    data.time_s = rows().map(|(row, _)| row.time_s).collect();
    data.voltage_v = rows().map(|(row, _)| row.voltage_v).collect();
    data.reading = rows().map(|(_, reading)| reading).collect();
    data.command = data.command.scaled(scales.second_s, scales.volt_v);
    data.full_scale_v *= scales.volt_v;
    data.sample_s *= scales.second_s;
    data.record_sample_s *= scales.second_s;
}
