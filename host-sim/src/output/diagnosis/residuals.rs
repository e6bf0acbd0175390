//! Residuals as CSV, one row per reading. Several records are numbered from 1 in a further column; times are their own.

use std::io::Write;

use identify::dimension::Dimension;
use identify::verdict::diagnosis::Diagnosis;

/// Writes the table; voltages are in V, readings and residuals in the reading's unit.
///
/// # Errors
/// If `out` cannot be written.
pub(super) fn write(out: &mut dyn Write, diagnosis: &Diagnosis) -> std::io::Result<()> {
    let Diagnosis { data, baseline, extended, .. } = diagnosis;
    writeln!(
        out,
        "# residual = reading - simulation, before and after it was extended; readings and residuals in {}",
        diagnosis.data.scales().unit(Dimension::Reading)
    )?;
    let record = if data.is_joined() { ",record" } else { "" };
    writeln!(out, "time_s,voltage_v,reading,simulation,extended,residual_before,residual_after,held_out_fold{record}")?;
    let number = |value| data.scales().number(Dimension::Reading, value, 6);
    for row in 0..data.rows() {
        let (reading, before, after) = (data.reading[row], baseline.residual[row], extended.residual[row]);
        let (index, time_s) = data.place(row);
        write!(
            out,
            "{time_s},{},{reading},{},{},{},{},{}",
            data.voltage_v[row],
            number(reading - before),
            number(reading - after),
            number(before),
            number(after),
            // Counted from 1, as on the page.
            data.fold[row] + 1,
        )?;
        if data.is_joined() {
            write!(out, ",{}", index + 1)?;
        }
        writeln!(out)?;
    }
    Ok(())
}
