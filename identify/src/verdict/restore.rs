//! A diagnosis in the file's units: s, V, and the reading's own unit. Its sentences are in the user's units from the start; the
//! points of its models and the laws of its noise stay in the coordinates of the search.

use std::iter;

use simulation::record::Record;

use crate::answer::{Finding, Parameter, Quality, Report, Suspect};
use crate::dimension::Dimension;
use crate::fit::engine::Fit;
use crate::record::data::Data;
use crate::record::normalisation::Normalisation;
use crate::record::scales::Scales;
use crate::verdict::diagnosis::Diagnosis;

impl Diagnosis {
    /// Returns the diagnosis in the units of the records that it was made from, each with its own coordinates, which differ in
    /// the start of time only.
    pub(crate) fn restored(mut self, records: &[Record], normalisations: &[Normalisation]) -> Self {
        let scales = &normalisations[0].scales;
        report(&mut self.report, scales);
        data(&mut self.data, records, normalisations);
        differences(&mut self.zero_offsets, scales);
        for residual in [&mut self.baseline, &mut self.extended].map(|fit: &mut Fit| &mut fit.residual) {
            differences(residual, scales);
        }
        differences(&mut self.held_out_in_place, scales);
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
    let law_range_v = &mut report.extended.law_range_v;
    *law_range_v = law_range_v.map(|range| range.map(|end| scales.restored(Dimension::Voltage, end)));
    report.noise.sigma = size(report.noise.sigma);
    for Finding { parameters, rmse_before, rmse_after, .. } in &mut report.findings {
        parameters.iter_mut().for_each(|(_, it)| parameter(it, scales));
        (*rmse_before, *rmse_after) = (size(*rmse_before), size(*rmse_after));
    }
    for Suspect { parameters, rmse_before, rmse_after, .. } in &mut report.suspects {
        parameters.iter_mut().for_each(|(_, it)| parameter(it, scales));
        (*rmse_before, *rmse_after) = (size(*rmse_before), size(*rmse_after));
    }
}

/// Converts a parameter to the file's units.
pub(crate) fn parameter(
    Parameter { value, low, high, unit, extrapolated_from_v, dimension, .. }: &mut Parameter,
    scales: &Scales,
) {
    let ends = [*low, *high].map(|end| scales.restored(*dimension, end));
    *value = scales.restored(*dimension, *value);
    (*low, *high) = if scales.size(*dimension) < 0.0 { (ends[1], ends[0]) } else { (ends[0], ends[1]) };
    *unit = dimension.unit(&scales.units);
    *extrapolated_from_v = extrapolated_from_v.map(|range| range.map(|end| scales.restored(Dimension::Voltage, end)));
}

/// Times, voltages and readings are those of the files, to the bit; times of a further record follow those of the one before it.
fn data(data: &mut Data, records: &[Record], normalisations: &[Normalisation]) {
    let scales = &normalisations[0].scales;
    for (part, of) in data.parts.iter_mut().zip(normalisations) {
        part.shift_s = scales.second_s * part.shift_s + scales.start_s - of.scales.start_s;
    }
    let shifts = data.parts.iter().map(|part| part.shift_s).chain(iter::repeat(0.0));
    let rows = || {
        let with_shift = records.iter().zip(shifts.clone());
        with_shift.flat_map(|(record, shift_s)| record.rows.iter().map(move |row| (row, shift_s)))
    };
    let rows = || rows().filter_map(|(row, shift_s)| Some((row, shift_s, row.measured?)));
    data.time_s = rows().map(|(row, shift_s, _)| row.time_s + shift_s).collect();
    data.voltage_v = rows().map(|(row, ..)| row.voltage_v).collect();
    data.reading = rows().map(|(.., reading)| reading).collect();
    data.unreported_v.iter_mut().flatten().for_each(|change| *change *= scales.reading.abs());
    data.command = data.command.scaled(scales.second_s, scales.volt_v);
    data.full_scale_v *= scales.volt_v;
    data.largest_v *= scales.volt_v;
    data.origin_v *= scales.volt_v;
    data.sample_s *= scales.second_s;
    data.record_sample_s *= scales.second_s;
}
