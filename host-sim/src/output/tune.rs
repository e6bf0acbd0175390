//! The answer of `vsj tune` as text, CSV and plots.

use anyhow::Result;

use crate::output::cells::{line, optional};
use crate::output::figure;
use crate::output::files::Files;
use paper::figure::Figure;
use simulation::spring_error::Parameter;
use simulation::tune::{Margins, Trade, Tuning, Worst};

/// Settings, their performance, and the responses under some model errors.
pub fn text(tuning: &Tuning, plant: &str) -> String {
    let mut text = String::new();
    let Tuning { limit_v, proportional_integral, fast, trade } = tuning;
    line(&mut text, &format!("Slowest step of the ideal stair, up to {limit_v} V:"));
    let worst =
        |worst: &Worst| format!("t97 {} s, overshoot {:.2} %", optional(worst.t97_s, 3), worst.overshoot_percent);
    match proportional_integral {
        None => line(
            &mut text,
            "proportional-integral: no gains meet the overshoot limit and the stability margins on every step",
        ),
        Some(gains) => {
            let Margins { gain, phase_deg, greatest_sensitivity } = gains.margins;
            let or_none =
                |margin: Option<f64>, unit: &str| margin.map_or("unlimited".to_owned(), |it| format!("{it:.1}{unit}"));
            line(&mut text, &format!("proportional-integral: {}", worst(&gains.worst)));
            line(
                &mut text,
                &format!(
                    "  margins: gain {}, phase {}, largest sensitivity {greatest_sensitivity:.2}",
                    or_none(gain, ""),
                    or_none(phase_deg, " degrees")
                ),
            );
            let (kp, ki) = (gains.proportional, gains.integral_per_s);
            line(
                &mut text,
                &format!("  vsj stair --plant {plant} --limit-v {limit_v} --input step --kp {kp} --ki {ki}"),
            );
        }
    }
    line(&mut text, &format!("fast: {}", worst(&fast.worst)));
    let approach_s = fast.approach_s;
    line(
        &mut text,
        &format!(
            "  vsj stair --plant {plant} --limit-v {limit_v} --input step --controller fast --approach-s {approach_s}"
        ),
    );
    line(&mut text, "\nOn a spring that differs from its model; each step is measured from its own start:");
    line(&mut text, "                       | proportional-integral |         fast");
    line(&mut text, "spring's         error |     t97   overshoot   |     t97   overshoot");
    line(&mut text, "                   [%] |     [s]         [%]   |     [s]         [%]");
    for row in trade.iter().filter(|row| [-0.5, -0.2, 0.0, 0.2, 0.5].contains(&row.error)) {
        let of = |worst: Option<Worst>| match worst {
            None => format!("{:>7}   {:>9}", "-", "-"),
            Some(worst) => format!("{:>7}   {:>9.2}", optional(worst.t97_s, 3), worst.overshoot_percent),
        };
        line(
            &mut text,
            &format!(
                "{:<14} {:>7.0} | {}   | {}",
                row.parameter.name(),
                100.0 * row.error,
                of(row.proportional_integral),
                of(row.fast)
            ),
        );
    }
    text
}

/// Adds trade.csv, t97.svg and overshoot.svg.
///
/// # Errors
/// Returns the errors of [`Files::add`].
pub fn write(files: &mut Files, tuning: &Tuning) -> Result<()> {
    files.add("trade.csv", |out| {
        writeln!(
            out,
            "# worst step of the ideal stair on a spring that differs from its model; empty: 97 % is not reached"
        )?;
        writeln!(out, "parameter,error,pi_t97_s,pi_overshoot_percent,fast_t97_s,fast_overshoot_percent")?;
        for Trade { parameter, error, proportional_integral, fast } in &tuning.trade {
            write!(out, "{},{error}", parameter.name())?;
            for worst in [proportional_integral, fast] {
                let t97 = worst.and_then(|worst| worst.t97_s).map_or_else(String::new, |t97| format!("{t97:.4}"));
                let overshoot = worst.map_or_else(String::new, |worst| format!("{:.3}", worst.overshoot_percent));
                write!(out, ",{t97},{overshoot}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    })?;
    type Value = fn(&Worst) -> Option<f64>;
    let figures: [(&str, &str, &str, Value); 2] = [
        ("t97.svg", "Time to 97 % on a spring that differs from its model", "t97 of the slowest step [s]", |worst| {
            worst.t97_s
        }),
        ("overshoot.svg", "Overshoot on a spring that differs from its model", "largest overshoot [%]", |worst| {
            Some(worst.overshoot_percent)
        }),
    ];
    for (name, title, y, value) in figures {
        let mut figure = Figure::new(title, "model error: parameter of the spring relative to the model [%]", y);
        for parameter in Parameter::ALL {
            let rows = || tuning.trade.iter().filter(move |row| row.parameter == parameter);
            let fast = rows().filter_map(|row| Some((100.0 * row.error, value(&row.fast?)?)));
            figure = figure.curve(&format!("fast, {}", parameter.name()), fast, false);
        }
        for parameter in Parameter::ALL {
            let rows = || tuning.trade.iter().filter(move |row| row.parameter == parameter);
            let gains: Vec<(f64, f64)> =
                rows().filter_map(|row| Some((100.0 * row.error, value(&row.proportional_integral?)?))).collect();
            if !gains.is_empty() {
                figure = figure.curve(&format!("PI, {}", parameter.name()), gains, true);
            }
        }
        let svg = figure::svg(&figure);
        files.add(name, |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(())
}
