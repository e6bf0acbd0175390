//! Execution of a script on a host, without clock and board: the reference for the run on the emulated board.

use firmware::control::{Control, Sensors, Tick, Untimed};
use firmware::settings::SUPERVISION;
use link::WireModel;
use model::{OutOfRange, Volts};

use crate::digest::Digest;
use crate::script::Script;

/// Runs `script` and calls `each` after every tick. Injected faults have no effect here, except for those that the script
/// itself expresses in commands and interlock.
///
/// # Errors
/// [`OutOfRange`] if the settings of the script are invalid, which the tests exclude.
pub fn simulate(script: Script, each: impl FnMut(&mut Control, &Tick)) -> Result<Digest, OutOfRange> {
    simulate_with(script, None, |_| None, each)
}

/// Runs `script` as [`simulate`] does, with the identified `model` if there is one; `measured` returns the sensor reading
/// before each tick, as equivalent static voltage.
///
/// # Errors
/// [`OutOfRange`] if the model is invalid.
pub fn simulate_with(
    mut script: Script,
    model: Option<&WireModel>,
    mut measured: impl FnMut(u32) -> Option<Volts>,
    mut each: impl FnMut(&mut Control, &Tick),
) -> Result<Digest, OutOfRange> {
    let settings = script.settings();
    let mut control = Control::new(settings, &SUPERVISION, None)?;
    if let Some(model) = model {
        control.use_model(settings, model)?;
    }
    let mut digest = Digest::default();
    let mut number = 0;
    while let Some(step) = script.step(number) {
        let measured = measured(number);
        let sensors = Sensors { interlock_closed: step.interlock_closed, measured, ..Sensors::default() };
        let tick = control.tick(&step.command, &sensors, &mut Untimed);
        digest.add(&tick);
        each(&mut control, &tick);
        number += 1;
    }
    Ok(digest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::supervisor::{Fault, State};

    /// A random run that is never armed would be the same on any target.
    #[test]
    fn a_random_run_visits_every_state_often() {
        for seed in [1, 2, 3] {
            let (mut armed, mut disarmed, mut ramping, mut faulted, mut limited) = (0u32, 0u32, 0u32, 0u32, 0u32);
            simulate(Script::random(seed), |control, tick| {
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
