//! Residuals as CSV, one row per reading. Several records are numbered from 1 in a further column; times are their own.

use std::io::Write;

use identify::verdict::diagnosis::Diagnosis;

/// Writes the table; voltages, readings and residuals are in V.
///
/// # Errors
/// If `out` cannot be written.
pub(super) fn write(out: &mut dyn Write, diagnosis: &Diagnosis) -> std::io::Result<()> {
    let Diagnosis { data, baseline, extended, .. } = diagnosis;
    writeln!(
        out,
        "# residual = reading - simulation, before and after it was extended; all but time_s and the fold in V"
    )?;
    let record = if data.is_joined() { ",record" } else { "" };
    writeln!(out, "time_s,voltage_v,reading,simulation,extended,residual_before,residual_after,held_out_fold{record}")?;
    for row in 0..data.rows() {
        let (reading, before, after) = (data.reading[row], baseline.residual[row], extended.residual[row]);
        let (index, time_s) = data.place(row);
        write!(
            out,
            "{time_s},{},{reading},{:.6},{:.6},{before:.6},{after:.6},{}",
            data.voltage_v[row],
            reading - before,
            reading - after,
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
