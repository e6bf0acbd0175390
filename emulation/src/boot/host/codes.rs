//! The DAC codes of a run, and those of the host for the same orders.

use anyhow::{Context, Result, bail};
use firmware::control::{Control, Sensors, Untimed};
use firmware::settings::SUPERVISION;
use link::{Command, Desired, Request};
use model::{Volts, supervisor};
use xtask::variant::Variant;

use super::answers::Answer;
use crate::boot::events::{Event, Events};
use crate::boot::schedule::Schedule;
use crate::variant;

/// Time in us, code and enable of a tick.
pub(super) type Written = (f64, u16, bool);

/// Time, code and enable of every tick. The enable is switched off before the code is written, and on after it.
pub(super) fn written(ticking: &Events) -> Result<Vec<Written>> {
    let mut written: Vec<Written> = Vec::new();
    let mut enabled = false;
    for Event(us, what, value) in &ticking.0 {
        match what.as_str() {
            "dac" => written.push((*us, u16::try_from(value.as_u64().context("a code")?)?, enabled)),
            "enable" => {
                enabled = value == "on";
                if let (true, Some(last)) = (enabled, written.last_mut()) {
                    last.2 = true;
                }
            }
            _ => {}
        }
    }
    Ok(written)
}

/// An error unless the orders' codes of the host are those that were `written`.
pub(super) fn equal(on_host: &[(u16, bool)], written: &[Written]) -> Result<()> {
    for (tick, ((code, enabled), (us, host_code, host_enabled))) in on_host.iter().zip(written).enumerate() {
        if (*code, *enabled) != (*host_code, *host_enabled) {
            bail!(
                "tick {tick} at {us:.0} us writes {host_code}, enabled {host_enabled}; on the host it is {code}, {enabled}"
            );
        }
    }
    Ok(())
}

/// Number of ticks with voltage.
pub(super) fn driven(drives: &[(u16, bool)]) -> usize {
    drives.iter().filter(|(code, enabled)| *enabled && *code > 0).count()
}

/// Number of ticks whose code is between zero and the highest one of a variant: those at an end are the same for any model.
pub(super) fn inside(drives: &[(u16, bool)], variant: Variant) -> usize {
    let highest = (1u16 << variant::settings(variant).amplifier.dac_bits) - 1;
    drives.iter().filter(|(code, enabled)| *enabled && (1..highest).contains(code)).count()
}

/// Number of ticks in which two runs differ.
pub(super) fn differ(one: &[(u16, bool)], other: &[(u16, bool)]) -> usize {
    one.iter().zip(other).filter(|(one, other)| one != other).count()
}

/// What each tick was ordered by the requests of `schedule` that are answered.
pub(super) fn orders(schedule: &Schedule, answers: &[Answer], written: &[Written]) -> Result<Vec<Command>> {
    let mut orders = vec![Command::default(); written.len()];
    for (us, sequence, _) in answers {
        let (_, request) = schedule.0.get(usize::from(sequence.0)).context("an answer to no request")?;
        // The last answers may leave after the last tick of the run.
        let Some(next) = written.iter().position(|(at, ..)| at > us) else { continue };
        let tick = match request {
            // Followed before it is answered. All other requests are answered first, and the next tick processes them.
            Request::Arm | Request::Set(_) => next.checked_sub(1).context("an answer before the first tick")?,
            _ => next,
        };
        orders[tick] = match request {
            Request::Arm => Command { heard: true, arming: Some(supervisor::Command::Arm), target: Some(Volts::ZERO) },
            Request::Set(Desired::ScaledVolts(volts)) => {
                Command { heard: true, arming: None, target: Some(Volts::new(*volts)?) }
            }
            // A sign of life is in the session's frames only.
            Request::Hello => Command::default(),
            _ => Command { heard: true, ..Command::default() },
        };
    }
    Ok(orders)
}

/// The controller of `variant`.
pub(super) fn control(variant: Variant) -> Result<Control> {
    Ok(Control::new(&variant::settings(variant), &SUPERVISION, None)?)
}

/// Code and enable of every tick, as this machine has them.
pub(super) fn drives(mut control: Control, orders: &[Command]) -> Vec<(u16, bool)> {
    let sensors = Sensors { interlock_closed: true, ..Sensors::default() };
    let drive = |orders| control.tick(orders, &sensors, &mut Untimed).drive;
    orders.iter().map(drive).map(|drive| (drive.code().0, drive.enabled())).collect()
}
