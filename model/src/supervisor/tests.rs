//! Tests of every transition between the states.

mod any_order;
mod every_pair;
mod misses;
mod monitors;
mod silence;
mod states;

use super::*;
use crate::amplifier::Limits;
use crate::units::{SampleTime, ScaledStiffness, Signal};

const RATE_HZ: f64 = 1000.0;

fn config() -> Config {
    Settings::DEFAULT.validate(SampleTime::from_rate(RATE_HZ).unwrap()).unwrap().quantize()
}

fn volts(value: f64) -> Volts {
    Volts::new(value).unwrap()
}

/// No fault, a frame of the host in this tick, and a target of 300 V.
fn good() -> Inputs {
    Inputs { ticks_since_host: 0, interlock_closed: true, target: volts(300.0), ..Inputs::default() }
}

fn arm() -> Inputs {
    Inputs { command: Some(Command::Arm), ..good() }
}

fn disarm() -> Inputs {
    Inputs { command: Some(Command::Disarm), ..good() }
}

fn output(applied_v: f64) -> Output {
    let applied = volts(applied_v);
    Output {
        target: applied,
        voltage: applied,
        code: DacCode(1755),
        applied,
        stiffness: ScaledStiffness::default(),
        limits: Limits::NONE,
        sensor: None,
    }
}

/// Both halves of a tick; the controller's output is always 300 V.
fn tick(supervisor: &mut Supervisor, inputs: Inputs) -> (Decision, Drive) {
    let decision = supervisor.decide(&inputs);
    let target = match decision {
        Decision::Start(target) | Decision::Pursue(target) => target,
        Decision::Rest => Volts::ZERO,
    };
    (decision, supervisor.release(&Output { target, ..output(300.0) }))
}

fn armed() -> Supervisor {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, arm()).0, Decision::Start(volts(300.0)));
    supervisor
}
