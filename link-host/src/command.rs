//! Requests with the errors of the command `vsj link`, in its words, for every program that sends them.

use anyhow::{Context, Result};
use link::{Desired, Fault, Reason, Request, State, Status, WireVolts};
use simulation::bad_input;

use crate::client::Client;
use crate::failure::Failure;

impl Client {
    /// Sends a request that is answered with an acknowledgement. A stiffness out of reach is bad input; any other error is a
    /// failure. Both name the port.
    ///
    /// # Errors
    /// [`simulation::BadInput`] for a stiffness out of reach; [`Failure`] for any other.
    pub fn command(&mut self, request: Request) -> Result<(State, WireVolts)> {
        match self.order(request) {
            Ok(done) => Ok(done),
            Err(Failure::Refused(reason @ Reason::OutOfRange { .. })) => {
                bad_input!("{}: {}", self.name(), refusal(&request, &reason))
            }
            Err(failure) => Err(failure).with_context(|| self.name().to_owned()),
        }
    }
}

/// What to say of an MCU at the port `name` that has not confirmed that its output is disabled.
pub fn not_disarmed(name: &str, reason: &str, status: &Status) -> String {
    let limit_s = f64::from(status.silence_limit_ticks) / f64::from(status.rate_hz.max(1));
    format!(
        "{name}: not disarmed: {reason}; an armed MCU ramps its voltage down by itself {limit_s} s after it last heard of its host"
    )
}

/// Why the MCU has rejected the request, as text. The bounds of a range come without their unit, which is that of the request.
pub fn refusal(request: &Request, reason: &Reason) -> String {
    let unit = match (reason, request) {
        (Reason::OutOfRange { .. }, Request::Set(Desired::Pascal(_))) => " Pa",
        (Reason::OutOfRange { .. }, Request::Set(Desired::NewtonPerMetre(_))) => " N/m",
        (Reason::OutOfRange { .. }, _) => " V",
        _ => "",
    };
    format!("{reason}{unit}")
}

/// The desired stiffness: a finite number, in V of equivalent static voltage unless Pa or N/m follows, in any case.
///
/// # Errors
/// [`simulation::BadInput`] with the units that are known.
pub fn desired(text: &str) -> Result<Desired> {
    // The `e` of an exponent is no unit.
    let unit = text.trim_start_matches(|letter: char| letter.is_ascii_digit() || "+-.eE".contains(letter));
    let number = text[..text.len() - unit.len()].parse().ok().filter(|value: &f64| value.is_finite());
    match (number, unit.trim_start().to_lowercase().as_str()) {
        (Some(value), "" | "v") => Ok(Desired::ScaledVolts(value)),
        (Some(value), "pa") => Ok(Desired::Pascal(value)),
        (Some(value), "n/m") => Ok(Desired::NewtonPerMetre(value)),
        _ => bad_input!("`{text}` is no stiffness; expected a finite number, alone or with V, Pa or N/m"),
    }
}

/// The fault with a name or a number.
///
/// # Errors
/// [`simulation::BadInput`] with the names that are known.
pub fn fault(text: &str) -> Result<Fault> {
    let known = (1..=u8::MAX).map(Fault).filter(|fault| fault.name() != "unknown");
    if let Some(fault) = known.clone().find(|fault| fault.name() == text) {
        return Ok(fault);
    }
    match text.parse() {
        Ok(code) if code > 0 => Ok(Fault(code)),
        _ => {
            let names: Vec<_> = known.map(Fault::name).collect();
            bad_input!("{text} is not a fault; expected {} or a number of 1 to 255", names.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_of_a_refused_stiffness_have_the_unit_of_the_request() {
        let reason = Reason::OutOfRange { lowest: 0.0, highest: 700.0 };
        for (text, unit) in [("701", "V"), ("3e9Pa", "Pa"), ("9 N/m", "N/m")] {
            let request = Request::Set(desired(text).unwrap());
            assert_eq!(refusal(&request, &reason), format!("out of range: expected 0 to 700 {unit}"));
            assert_eq!(refusal(&request, &Reason::NotArmed), "not armed");
        }
    }
}
