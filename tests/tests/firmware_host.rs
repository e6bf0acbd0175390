//! The firmware's control tick with its supervisor gives the same codes as the host simulator, tick by tick.
//!
//! `cargo xtask proof` compares the emulated image with the same code, so that simulator, firmware on the host and
//! firmware on the MCU agree to the bit.

use firmware::settings::SETTINGS;
use simulation::experiment::Experiment;
use simulation::schedule::Schedule;
use test_bench::script::{STAIR_TICKS, Script};
use test_bench::simulation::simulate;

#[test]
fn codes_and_estimates_of_the_stair_equal_the_simulators() {
    let experiment = Experiment { name: "the stair".into(), schedule: Schedule::stair(), settings: SETTINGS };
    let run = experiment.run(|_, _| {}).unwrap();
    let mut tick = 0;
    simulate(Script::Stair, |_, firmware| {
        let simulator = run.with[tick];
        assert_eq!(firmware.drive.code(), simulator.code, "code at tick {tick}");
        assert_eq!(firmware.output.stiffness, simulator.stiffness, "estimate at tick {tick}");
        tick += 1;
    })
    .unwrap();
    assert_eq!(tick, STAIR_TICKS as usize);
}
