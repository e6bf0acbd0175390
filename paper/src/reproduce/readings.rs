//! Printed numbers that were measured, compared with what other measured numbers predict.
//!
//! A number is an outlier if it remains one after Bonferroni's correction for the numbers of its table (5 % false
//! alarms a table).

use anyhow::{Context, Result};
use model::Plant;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use crate::beam::experiment::{in_line, lines, voltages};
use crate::beam::readings::{Reading, table1 as readings};
use crate::beam::regression::{FALSE_ALARM, Fit};
use crate::beam::slip::tips;
use crate::reproduce::inputs::Inputs;
use crate::reproduce::models::free;
use crate::reproduce::outcome::Outcome;
use crate::table3 as printed;
use simulation::experiment::reference_at;
use simulation::schedule::Schedule;

/// Slope through the origin of one voltage of Table 1, in uN/mm, from all of its readings.
pub(crate) fn slope(inputs: &Inputs<'_>) -> Result<Outcome> {
    let voltage = inputs.number("voltage_v")?;
    let of_voltage: Vec<Reading> = readings()?.into_iter().filter(|r| r.voltage_v == voltage).collect();
    let fit = lines(&of_voltage, &[voltage])?;
    let error = 1.0 / fit.standard_errors_from(0, fit.coefficients[0] + 1.0);
    let mut evidence = format!("the readings give {:.2} with a standard error of {error:.2}", fit.coefficients[0]);
    let single = of_voltage.iter().map(|r| r.force_un / r.displacement_mm);
    let (least, most) = single.fold((f64::INFINITY, 0.0f64), |(least, most), one| (least.min(one), most.max(one)));
    // Any line through the origin has a weighted mean of these as its slope.
    evidence += &format!("; one by one, {least:.2} to {most:.2}");
    for (index, reading) in of_voltage.iter().enumerate() {
        let mut others = of_voltage.clone();
        others.remove(index);
        let without = lines(&others, &[voltage])?.coefficients[0];
        if (without - fit.coefficients[0]).abs() > error / 2.0 {
            evidence += &format!("; {without:.2} without the reading at {} mm", reading.displacement_mm);
        }
    }
    Ok(Outcome { standard_error: Some(error), evidence: Some(evidence), ..Outcome::exact(fit.coefficients[0]) })
}

/// A reading of Table 1 in uN, predicted from all others by lines through the origin with one scatter.
pub(crate) fn table1(inputs: &Inputs<'_>) -> Result<Outcome> {
    let (voltage, displacement) = (inputs.number("voltage_v")?, inputs.number("displacement_mm")?);
    let all = readings()?;
    let index = all
        .iter()
        .position(|r| r.voltage_v == voltage && r.displacement_mm == displacement)
        .context("Table 1 has no such reading")?;
    let fit = lines(&all, &voltages(&all))?;
    let expected = fit.readings[index].expected;
    // The prediction interval holds one further reading with 95 %; widened, it holds all readings of the table.
    let half = (expected.high - expected.value) * bonferroni_factor(&fit, all.len())?;
    let evidence = format!(
        "the line through the other readings, which gives {:.1} +- {half:.1}; by chance a reading falls so far off once in \
         {:.0}",
        expected.value,
        1.0 / fit.readings[index].chance
    );
    Ok(predicted(expected.value, half, evidence))
}

/// A measured number predicted to lie within `half` of `value`.
fn predicted(value: f64, half: f64, evidence: String) -> Outcome {
    Outcome { expected: Some((value - half, value + half)), evidence: Some(evidence), ..Outcome::exact(value) }
}

/// Ratio of the interval that holds `numbers` numbers to that of a single one, both with 95 %.
fn bonferroni_factor(fit: &Fit, numbers: usize) -> Result<f64> {
    let student = StudentsT::new(0.0, 1.0, (fit.degrees_of_freedom - 1) as f64)?;
    Ok(student.inverse_cdf(1.0 - 0.5 * FALSE_ALARM / numbers as f64) / student.inverse_cdf(0.975))
}

/// A displacement of section 4.1.4 in mm, predicted from Table 1 as force by slope, with the scatter of a force
/// reading.
pub(crate) fn tip_by_table1_mm(inputs: &Inputs<'_>) -> Result<Outcome> {
    let (voltage, force) = (inputs.number("voltage_v")?, inputs.number("force_un")?);
    let all = readings()?;
    let voltages = voltages(&all);
    let (_, fit, _) = in_line(&all, &voltages)?;
    let index = voltages.iter().position(|&v| v == voltage).context("Table 1 has no such voltage")?;
    let slope = fit.coefficients[index];
    // The widest prediction interval of Table 1.
    let spread = fit.readings.iter().map(|r| r.expected.high - r.expected.value).fold(0.0, f64::max);
    let half = spread * bonferroni_factor(&fit, tips()?.len())? / slope;
    let value = force / slope;
    let evidence =
        format!("{force} uN by the slope of Table 1 at {voltage} V, {slope:.2} uN/mm: {value:.3} +- {half:.3} mm");
    Ok(predicted(value, half, evidence))
}

/// A reading of Table 3 in V, predicted from the one before by the simulation without controller.
///
/// The scale of the differences between neighbours is their median absolute deviation.
pub(crate) fn table3(inputs: &Inputs<'_>) -> Result<Outcome> {
    let time = inputs.number("time_s")?;
    let rows = printed::rows()?;
    let simulated = reference_at(free(Plant::PAPER, None), &Schedule::stair(), rows.iter().map(|row| row.time_s));
    let off: Vec<f64> = rows.iter().zip(&simulated).map(|(row, simulated)| row.measured - simulated).collect();
    let jumps: Vec<f64> = off.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let index =
        rows.iter().position(|row| row.time_s == time).filter(|&index| index > 0).context("no row before it")?;

    let deviation = 1.4826 * median(jumps.iter().map(|jump| jump.abs()).collect());
    let half = Normal::standard().inverse_cdf(1.0 - 0.5 * FALSE_ALARM / jumps.len() as f64) * deviation;
    let value = simulated[index] + off[index - 1];
    let side = |off: f64| if off < 0.0 { "below" } else { "above" };
    let run = off[1..index].iter().rev().take_while(|earlier| side(**earlier) == side(off[index - 1])).count();
    let persists = off
        .get(index + 1)
        .is_some_and(|next| (next - off[index]).abs() <= half && (next - off[index - 1]).abs() > half);
    let evidence = format!(
        "from the reading before ({} at {} s) the spring's relaxation leads to {value:.0} +- {half:.0}; the jump of {:+.0} is \
         {:.1} times the usual scatter ({deviation:.0}) between neighbours. The {run} readings before lie {} the simulation, \
         the last by {:.0}; this one lies {:.0} {} it{}",
        rows[index - 1].measured,
        rows[index - 1].time_s,
        jumps[index - 1],
        (jumps[index - 1] / deviation).abs(),
        side(off[index - 1]),
        off[index - 1].abs(),
        off[index].abs(),
        side(off[index]),
        if persists { ", and the next goes on from there: what was measured shifted between the two" } else { "" },
    );
    Ok(Outcome { persists, ..predicted(value, half, evidence) })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

/// Largest error of the report's finite elements in section 4.1.4, in percent of the measured displacement.
pub(crate) fn largest_fem_error_percent() -> Result<Outcome> {
    let errors = tips()?.into_iter().map(|tip| (1e2 * (tip.fem_mm / tip.measured_mm - 1.0).abs(), tip));
    let (worst, tip) = errors.max_by(|one, other| one.0.total_cmp(&other.0)).context("no rows")?;
    let evidence = format!("at {} uN and {} V, the worst row of section 4.1.4", tip.force_un, tip.voltage_v);
    Ok(Outcome { evidence: Some(evidence), ..Outcome::exact(worst) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_odd_and_even_counts() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
    }
}
