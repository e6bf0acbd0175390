//! The answer of `vsj tune` as text, CSV and plots.

use anyhow::Result;

use crate::output::bound::{errors, needed as needed_text};
use crate::output::cells::{line, optional, tidy};
use crate::output::figure;
use crate::output::files::Files;
use paper::figure::Figure;
use simulation::spring_error::Parameter;
use simulation::tune::{Margins, Trade, Tuning, Uncertainty, Within, Worst};

/// Settings, their performance, and the responses under some model errors.
pub fn text(tuning: &Tuning, plant: &str) -> String {
    let mut text = String::new();
    let Tuning { limit_v, proportional_integral, fast, trade, uncertainty } = tuning;
    line(&mut text, &format!("Slowest step of the ideal stair, up to {limit_v} V:"));
    let worst = |worst: &Worst| {
        let reached = worst.t97_s.map_or("a step ends before its 97 %".to_owned(), |t97| format!("t97 {t97:.3} s"));
        format!("{reached}, overshoot {:.2} %", worst.overshoot_percent)
    };
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
    uncertainty.iter().for_each(|uncertainty| text += &within_errors(uncertainty));
    text
}

/// The controllers on a spring that is known to within errors.
fn within_errors(uncertainty: &Uncertainty) -> String {
    let Uncertainty { spring_error, controllers, within_s, overshoot_percent, needed, .. } = uncertainty;
    let mut text = format!("\nOn a spring that is known to within errors: {}.\n", errors(spring_error));
    line(&mut text, "Not exceeded on 95 % of these springs, and at all ends of the errors (guaranteed):");
    line(&mut text, "           |          nominal          |       worst at 95 %       |        guaranteed");
    line(&mut text, "controller |     t97   kept  overshoot |     t97   kept  overshoot |     t97   kept  overshoot");
    line(&mut text, "           |     [s]    [s]        [%] |     [s]    [s]        [%] |     [s]    [s]        [%]");
    for Within { controller, nominal, worst_95, guaranteed } in controllers {
        let cells = [nominal, worst_95, guaranteed].map(|worst| {
            let [t97, kept] = [worst.t97_s, worst.kept97_s].map(|time_s| optional(time_s, 3));
            format!("{t97:>7} {kept:>6} {:>10.2}", worst.overshoot_percent)
        });
        line(&mut text, &format!("{controller:<10} | {}", cells.join(" | ")));
    }
    line(&mut text, "Kept: time after which the stiffness stays above 97 %, what `vsj bound` is a bound of.");
    line(
        &mut text,
        &format!(
            "\nWhatever the controller, without a sensor and with at most {} % of overshoot:",
            tidy(*overshoot_percent)
        ),
    );
    text + &match needed {
        Some(it) => needed_text(it, *within_s),
        None => "how well the spring has to be known is computed for linear springs only\n".to_owned(),
    }
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
    let figures: [(&str, &str, &str, Value, &str); 2] = [
        (
            "t97.svg",
            "Time to 97 % on a spring that differs from its model",
            "t97 of the slowest step [s]",
            |worst| worst.t97_s,
            "97 % not reached",
        ),
        (
            "overshoot.svg",
            "Overshoot on a spring that differs from its model",
            "largest overshoot [%]",
            |worst| Some(worst.overshoot_percent),
            "unstable",
        ),
    ];
    for (name, title, y, value, why) in figures {
        let mut figure = Figure::new(title, "model error: spring relative to its model [%]", y);
        for parameter in Parameter::ALL {
            let rows = tuning.trade.iter().filter(|row| row.parameter == parameter);
            let fast = rows.map(|row| (100.0 * row.error, row.fast.and_then(|fast| value(&fast))));
            let (points, end) = until(fast, why);
            figure = figure.curve(&format!("fast, {}{end}", parameter.name()), points, false);
        }
        for parameter in Parameter::ALL {
            let rows = tuning.trade.iter().filter(|row| row.parameter == parameter);
            let gains = rows.map(|row| (100.0 * row.error, row.proportional_integral.and_then(|gains| value(&gains))));
            let (points, end) = until(gains, why);
            if !points.is_empty() {
                figure = figure.curve(&format!("PI, {}{end}", parameter.name()), points, true);
            }
        }
        let svg = figure::svg(&figure);
        files.add(name, |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(())
}

/// The points of a curve that have a value, and words on where it ends early; `why` says what is lacking there.
fn until(rows: impl Iterator<Item = (f64, Option<f64>)>, why: &str) -> (Vec<(f64, f64)>, String) {
    let rows: Vec<(f64, Option<f64>)> = rows.collect();
    let points: Vec<(f64, f64)> = rows.iter().filter_map(|&(error, value)| Some((error, value?))).collect();
    let mut words = String::new();
    if let [(first, _), .., (last, _)] = points.as_slice() {
        let mut ends = Vec::new();
        if rows.iter().any(|(error, _)| error < first) {
            ends.push(format!("below {first:.0} %"));
        }
        if rows.iter().any(|(error, _)| error > last) {
            ends.push(format!("above {last:.0} %"));
        }
        if !ends.is_empty() {
            words = format!(" ({}: {why})", ends.join(" and "));
        }
    }
    (points, words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_that_ends_early_says_where_and_why() {
        let all = |from: i32, to: i32| {
            let has = move |error: i32| (from..=to).contains(&error).then_some(1.0);
            until((-5..=5).map(move |error| (f64::from(10 * error), has(error))), "97 % not reached")
        };
        assert_eq!(all(-5, 5), ((-5..=5).map(|error| (f64::from(10 * error), 1.0)).collect(), String::new()));
        assert_eq!(all(-5, 4).1, " (above 40 %: 97 % not reached)");
        assert_eq!(all(-3, 3).1, " (below -30 % and above 30 %: 97 % not reached)");
    }
}
