//! The answer of `vsj compare` as text.

use crate::output::cells::{line, tidy};
use crate::output::step_response;
use simulation::comparison::{AtLimit, Comparison};
use simulation::spring_error::{Parameter, SpringError};

/// One table per amplifier.
pub fn text(comparison: &Comparison) -> String {
    let mut text = String::new();
    if let Some(error) = comparison.spring_error {
        line(&mut text, &actual(error, comparison.sensor_noise_v));
        text.push('\n');
    }
    for AtLimit { limit_v, steps } in &comparison.limits {
        line(&mut text, &format!("up to {limit_v:<4} V |            | {}", step_response::NAMES));
        line(&mut text, &format!("    step [V] | controller | {}", step_response::UNITS));
        for step in steps {
            for (name, response) in step.each() {
                let (from_v, to_v) = (tidy(response.from_v), tidy(response.to_v));
                let columns = step_response::columns(response);
                line(&mut text, &format!("{from_v:>4} -> {to_v:<4} | {name:<10} | {columns}"));
            }
        }
        text.push('\n');
    }
    line(&mut text, step_response::shortest_possible(comparison.bound_from));
    if comparison.spring_error.is_some() {
        line(
            &mut text,
            "Each step is measured from the spring's stiffness at its start; the shortest possible time is this spring's.",
        );
    }
    text
}

/// What the controllers do not know of the spring, and the sensor.
fn actual(mut error: SpringError, sensor_noise_v: Option<f64>) -> String {
    let mut parts = Vec::new();
    for parameter in Parameter::ALL {
        let percent = 100.0 * *error.of(parameter);
        if percent != 0.0 {
            parts.push(format!("{} {percent:+} % off the model's", parameter.name()));
        }
    }
    if parts.is_empty() {
        parts.push("that of the model".to_owned());
    }
    let sensor = sensor_noise_v
        .map_or("no sensor".to_owned(), |noise_v| format!("a sensor with a noise of {} V", tidy(noise_v)));
    format!("Spring: {}; {sensor}", parts.join(", "))
}
