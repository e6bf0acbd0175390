//! Residuals as CSV, one row per reading.

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
    writeln!(out, "time_s,voltage_v,reading,simulation,extended,residual_before,residual_after,held_out_fold")?;
    for row in 0..data.rows() {
        let (reading, before, after) = (data.reading[row], baseline.residual[row], extended.residual[row]);
        writeln!(
            out,
            "{},{},{reading},{:.6},{:.6},{before:.6},{after:.6},{}",
            data.time_s[row],
            data.voltage_v[row],
            reading - before,
            reading - after,
            // Counted from 1, as on the page.
            data.fold[row] + 1,
        )?;
    }
    Ok(())
}
