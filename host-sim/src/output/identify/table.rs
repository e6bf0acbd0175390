//! The rows of the table of quantities, for the terminal and for the page.

use identify::dimension::with_interval;
use identify::nominal::report::{InputLaw, Quantity, Report};
use simulation::units::{Units, quotient};

use crate::output::diagnosis::number::number;

/// A quantity as it is shown: name, value with unit, interval.
pub(super) type Line = [String; 3];

/// All quantities in the user's units.
pub(super) fn quantities(report: &Report, units: &Units) -> Vec<Line> {
    let line = |name: String, quantity: &Quantity, size: f64, unit: &str| {
        let (value, interval) = with_interval([quantity.value / size, quantity.low / size, quantity.high / size]);
        [name, format!("{value} {unit}").trim_end().to_owned(), interval]
    };
    let (nominal, reading, time) = (&report.nominal, report.unit.as_str(), &units.time);
    let per_voltage = quotient(reading, &units.voltage.name);
    let mut lines = vec![line("gain".into(), &nominal.gain, 1.0 / units.voltage.si, &per_voltage)];
    if let [only] = report.start.as_slice() {
        lines.push(line("zero".into(), &only.zero, 1.0, reading));
    }
    if report.order > 0 {
        lines.push(line("instantaneous share".into(), &nominal.share, 1.0, ""));
    }
    lines.push(line("delay".into(), &nominal.delay_s, time.si, &time.name));
    for (lag, index) in nominal.tau_s.iter().zip(1..) {
        lines.push(line(format!("time constant {index}"), &lag.tau, time.si, &time.name));
        lines.push(line("  its weight".into(), &lag.weight, 1.0, ""));
    }
    for (oscillation, index) in report.oscillation.iter().zip(1..) {
        lines.push(line(format!("oscillation {index}"), &oscillation.freq_hz, 1.0, "Hz"));
        lines.push(line("  its damping ratio".into(), &oscillation.zeta, 1.0, ""));
        lines.push(line("  its weight".into(), &oscillation.weight, 1.0, ""));
    }
    for start in &report.start {
        let of = if report.start.len() > 1 { format!(" of {}", start.record) } else { String::new() };
        if report.start.len() > 1 {
            lines.push(line(format!("zero{of}"), &start.zero, 1.0, reading));
        }
        if report.order > 0 {
            lines.push(line(format!("start{of}, above settled"), &start.offset, 1.0, reading));
        }
    }
    let noise = &report.noise;
    lines.push(["noise, standard deviation".into(), format!("{} {reading}", number(noise.sigma)), String::new()]);
    lines.push(["  correlation of neighbours".into(), format!("{:.2}", noise.autocorrelation), String::new()]);
    lines
}

/// The held-out errors by order, with a mark at the chosen one.
pub(super) fn orders(report: &Report) -> Vec<Line> {
    let with_static = std::iter::once((0, report.static_held_out_rmse));
    let others = report.linear.iter().map(|linear| (linear.order, linear.held_out_rmse));
    let nominal = match report.undriven_order {
        0 => "nominal".to_owned(),
        count => format!("nominal, {count} of its poles not driven"),
    };
    let mark = |order| if order == report.order + report.undriven_order { nominal.clone() } else { String::new() };
    with_static.chain(others).map(|(order, error)| [order.to_string(), number(error), mark(order)]).collect()
}

/// What was identified, in one sentence.
pub(super) fn sentence(report: &Report) -> String {
    let lags = match report.nominal.tau_s.len() {
        0 => String::new(),
        1 => "one time constant".into(),
        many => format!("{many} time constants"),
    };
    let oscillations = match report.oscillation.len() {
        0 => "",
        1 => "one oscillation",
        _ => "two oscillations",
    };
    let parts: Vec<&str> = [lags.as_str(), oscillations].into_iter().filter(|part| !part.is_empty()).collect();
    let dynamics = if parts.is_empty() { "a gain without dynamics".to_owned() } else { parts.join(" and ") };
    let law = match report.input_law {
        InputLaw::Linear => "",
        InputLaw::Even => ", driven by the magnitude of the voltage",
        InputLaw::Square => ", driven by the square of the voltage",
    };
    format!("{} readings show {dynamics}{law}.", report.rows)
}
