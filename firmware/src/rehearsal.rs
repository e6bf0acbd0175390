//! A script without a clock and without a board: what the target is held against.

use link::WireModel;
use model::{OutOfRange, Volts};

use crate::control::{Control, Senses, Tick, Untimed};
use crate::digest::Digest;
use crate::script::Script;
use crate::settings::SUPERVISION;

/// Runs a script without a clock, as a host does; `each` hears of every tick. Mishaps are for the target only.
///
/// # Errors
/// Never: the settings are this crate's own.
pub fn rehearse(script: Script, each: impl FnMut(&Control, &Tick)) -> Result<Digest, OutOfRange> {
    rehearse_with(script, None, |_| None, each)
}

/// As [`rehearse`], with a model that was found; `measured` is what the board is told by the sensor before each tick.
///
/// # Errors
/// [`OutOfRange`] for a model that cannot be run.
pub fn rehearse_with(
    mut script: Script,
    found: Option<&WireModel>,
    mut measured: impl FnMut(u32) -> Option<Volts>,
    mut each: impl FnMut(&Control, &Tick),
) -> Result<Digest, OutOfRange> {
    let settings = script.settings();
    let mut control = Control::new(settings, &SUPERVISION, None)?;
    if let Some(found) = found {
        control.take_on(settings, found)?;
    }
    let mut digest = Digest::default();
    let mut number = 0;
    while let Some(step) = script.step(number) {
        let measured = measured(number);
        let senses = Senses { interlock_closed: step.interlock_closed, measured, ..Senses::default() };
        let tick = control.tick(&step.orders, &senses, &mut Untimed);
        digest.add(&tick);
        each(&control, &tick);
        number += 1;
    }
    Ok(digest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::supervisor::{Fault, State};

    /// A random run that never armed would agree with anything.
    #[test]
    fn a_random_run_sees_every_state_often() {
        for seed in [1, 2, 3] {
            let (mut armed, mut disarmed, mut ramping, mut faulted, mut limited) = (0u32, 0u32, 0u32, 0u32, 0u32);
            rehearse(Script::random(seed), |control, tick| {
                match control.supervisor().state() {
                    State::Armed if control.supervisor().ramping() => ramping += 1,
                    State::Armed => armed += 1,
                    State::Disarmed => disarmed += 1,
                    State::Faulted(Fault::Interlock) => faulted += 1,
                    State::Faulted(fault) => panic!("{fault:?}"),
                }
                limited += u32::from(tick.output.limits != model::Limits::NONE);
            })
            .unwrap();
            let seen = [armed, disarmed, ramping, faulted, limited];
            assert!(armed > 40_000 && seen.iter().all(|ticks| *ticks > 500), "{seed}: {seen:?}");
        }
    }
}
