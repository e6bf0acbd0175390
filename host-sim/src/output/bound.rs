//! The answer of `vsj bound` as text.

use crate::output::cells::{line, optional, tidy};
use simulation::robust_bound::{Answer, LARGEST_ERROR, Needed, OF_KNOWN};
use simulation::spring_error::{Parameter, SpringError};

/// The shortest times of all steps, and how well the spring has to be known.
pub fn text(answer: &Answer) -> String {
    let mut text = String::new();
    let slew = answer.slew_v_per_s.map_or(String::new(), |slew| format!(", {} V/s", tidy(slew)));
    line(
        &mut text,
        &format!(
            "Shortest time to reach and keep 97 % without a sensor, up to {} V{slew}, overshoot at most {} %:",
            tidy(answer.limit_v),
            tidy(answer.overshoot_percent)
        ),
    );
    line(&mut text, "    step [V] | spring known [s] | known to the errors [s] | nominal first [s]");
    for step in &answer.steps {
        line(
            &mut text,
            &format!(
                "{:>4} -> {:<4} | {:>16} | {:>23} | {:>17}",
                tidy(step.from_v),
                tidy(step.to_v),
                optional(step.known_s, 3),
                optional(step.t97_s, 3),
                optional(step.nominal_first_s, 3)
            ),
        );
    }
    line(
        &mut text,
        &format!(
            "Nominal first: the spring without errors stays above 97 % from {OF_KNOWN} times its own shortest time on."
        ),
    );
    line(&mut text, &format!("Errors: {}", errors(&answer.spring_error)));
    text.push('\n');
    text + &needed(&answer.needed, answer.within_s)
}

/// The errors to within which a spring is known.
pub(crate) fn errors(spring_error: &SpringError) -> String {
    let mut error = *spring_error;
    let of_response = 100.0 * error.share_of_response;
    let share = (of_response != 0.0).then(|| format!("share to +-{of_response:.3} % of the response"));
    let relative = Parameter::ALL
        .into_iter()
        .map(|parameter| (parameter.name(), 100.0 * *error.of(parameter)))
        .filter(|(_, percent)| *percent != 0.0)
        .map(|(name, percent)| format!("{name} to +-{percent:.3} %"));
    let known: Vec<String> = share.into_iter().chain(relative).collect();
    if known.is_empty() { "none".to_owned() } else { known.join(", ") }
}

/// How well the spring has to be known for a time in s.
pub(crate) fn needed(needed: &Needed, within_s: f64) -> String {
    let mut text =
        format!("For all steps in {} s the spring has to be known, each parameter alone, to\n", tidy(within_s));
    let (share, of) = match needed.share_of_response {
        Some(of_response) => (Some(of_response), " of the response"),
        None => (needed.share, ""),
    };
    let each = [(share, of), (needed.time_constant, ""), (needed.gain, "")];
    for (parameter, (needed, of)) in Parameter::ALL.into_iter().zip(each) {
        let needed = needed.map_or("impossible even if it is known exactly".to_owned(), |needed| {
            let or_more = if needed + LARGEST_ERROR.1 < LARGEST_ERROR.0 { "" } else { " or more" };
            format!("+-{:.1} %{of}{or_more}", 100.0 * needed)
        });
        line(&mut text, &format!("  {:<14} {needed}", parameter.name()));
    }
    text
}
