//! The answer of `vsj adapt` as text.

use simulation::adaptation::{Answer, IN_TIME, MOST_OVERSHOOT_PERCENT, Made, Step};
use simulation::spring_error::Parameter;

use crate::output::cells::{line, optional, tidy};

/// One line for each step after the change.
pub fn text(answer: &Answer) -> String {
    let mut text = String::new();
    line(&mut text, &happened(answer));
    text.push('\n');
    line(
        &mut text,
        "                     | shortest | stored model   | adapted        | adapted, alone | running model / stored      |",
    );
    line(
        &mut text,
        "step            [V]  |  t97 [s] |  t97 [s] over% |  t97 [s] over% |  t97 [s] over% |    tau   share    gain     | adaptation",
    );
    answer.steps.iter().for_each(|step| line(&mut text, &row(step)));
    text.push('\n');
    let from = match answer.alone_in_time_from {
        Some(number) => format!("from step {number} on"),
        None => "not at the end".to_owned(),
    };
    line(
        &mut text,
        &format!(
            "Alone within {IN_TIME} of the shortest possible t97 and {MOST_OVERSHOOT_PERCENT} % of overshoot: {from}."
        ),
    );
    let cause = answer.cause.map_or(String::new(), |cause| format!(" {cause}"));
    line(
        &mut text,
        &format!(
            "Exchanges of the configuration: {}; largest deviation from the stored model {:.2} %; the bank says: {}{cause}.",
            answer.exchanges,
            100.0 * answer.largest_deviation,
            answer.verdict
        ),
    );
    line(
        &mut text,
        "Stored and adapted: with the sensor. Alone: with the parameters at the beginning of the step, without it.",
    );
    text
}

fn happened(answer: &Answer) -> String {
    let mut error = answer.happens.spring_error;
    let changes = Parameter::ALL.map(|parameter| (parameter.name(), 100.0 * *error.of(parameter)));
    let mut parts: Vec<String> =
        changes.into_iter().filter(|of| of.1 != 0.0).map(|(name, by)| format!("{name} {:+} %", tidy(by))).collect();
    if let Some(fault) = answer.happens.sensor_fault {
        parts.push(format!("the sensor fails: {}", format!("{fault:?}").to_lowercase()));
    }
    let what = if parts.is_empty() { "nothing".to_owned() } else { parts.join(", ") };
    format!("Before step 1: {what}. Sensor with a noise of {} V.", tidy(answer.sensor_noise_v))
}

fn row(step: &Step) -> String {
    let made = |made: &Made| {
        let mark = if made.in_time { ' ' } else { '!' };
        format!("{:>7}{mark} {:>6.2}", optional(made.t97_s, 3), made.overshoot_percent)
    };
    format!(
        "{:>4} {:>6} -> {:<6} | {:>8} | {} | {} | {} | {:.4}  {:.4}  {:.4}    | {}",
        step.number,
        tidy(step.from_v),
        tidy(step.to_v),
        optional(step.bound_t97_s, 3),
        made(&step.stored),
        made(&step.adapted),
        made(&step.alone),
        step.time_constant,
        step.share,
        step.gain,
        step.phase
    )
}
