//! Tests of the planner in closed loop with a spring of double precision.
//!
//! Of a spring by other code and other noise: `tests/tests/firmware_isolation.rs`.

use std::vec::Vec;

use link::isolation::Off;
use model::adaptation::{Parameters, Phase, Settings, settled_within};
use model::isolation::Causes;
use model::{Plant, device};

use super::handover::Handover;
use super::{Alone, Change, Planner, Terms};
use crate::isolation::tests::{Rig, settings};

/// Tick in which the spring becomes stiffer by a tenth.
const CHANGES: u64 = 12_000;

fn terms(settings: &device::Settings, rig: &Rig) -> Terms {
    Terms::new(settings, settings.control.amplifier, &rig.terms)
}

/// Runs on to `to`, and returns the changes with their ticks.
fn run(rig: &mut Rig, alone: &mut Alone, from: u64, to: u64) -> Vec<(u64, Change)> {
    let mut changes = Vec::new();
    rig.run(from, to, |rig, tick, done, _| {
        let change = alone.after_tick(&mut rig.control, &mut rig.isolation, done);
        changes.extend(change.map(|change| (tick, change)));
    });
    changes
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn the_model_follows_the_gain_and_goes_back_when_it_is_switched_off() {
    let settings = settings(Causes::NONE);
    let mut rig = Rig::new(&settings);
    let mut alone = Alone::new(terms(&settings, &rig));
    let before = run(&mut rig, &mut alone, 0, CHANGES);
    assert!(
        before.iter().all(|(_, change)| change.parameters == Parameters::STORED),
        "nothing to adapt to: {before:?}"
    );
    let before = alone.planner().report();
    assert_eq!((before.exchanges, before.exchange_tick, before.phase()), (0, 0, Some(Phase::Watching)));
    assert_eq!((before.ratios, before.stored), ([1.0; 3], [Plant::PAPER.time_constant_s, Plant::PAPER.share]));

    rig.gain = 1.1;
    let changes = run(&mut rig, &mut alone, CHANGES, 120_000);
    let phases: Vec<Phase> = changes.iter().map(|(_, change)| change.phase).collect();
    assert!(phases.contains(&Phase::Moving) && phases.contains(&Phase::Trial), "{phases:?}");
    let gains = || changes.iter().map(|(_, change)| change.parameters.gain);
    let Parameters { time_constant, share, gain } = changes.last().unwrap().1.parameters;
    assert!((gain - 1.1).abs() < 0.005 && (time_constant, share) == (1.0, 1.0), "{gain} {time_constant} {share}");
    let report = alone.planner().report();
    assert_eq!(report.ratios, [1.0, 1.0, gain]);
    let moves = gains().filter(|gain| *gain != 1.0).count();
    assert!(report.exchanges as usize >= moves && moves > 5, "{} exchanges, {moves} moves", report.exchanges);
    // The parameters change in the tick in which they are exchanged, at the end of a block.
    let last = changes.windows(2).rfind(|pair| pair[0].1.parameters != pair[1].1.parameters).unwrap()[1].0;
    assert!(report.exchange_tick >= last && report.exchange_tick % 128 == last % 128, "{report:?} {last}");

    let off = alone.planner().switch(false).expect("a change");
    assert_eq!((off.phase, off.parameters.gain), (Phase::Returning, gain));
    assert_eq!(alone.planner().switch(false), None, "it is off already");
    let back = run(&mut rig, &mut alone, 120_000, 170_000).last().unwrap().1;
    assert_eq!((back.phase, back.parameters), (Phase::Off, Parameters::STORED));
    let later = alone.planner().report();
    assert!(later.exchanges > report.exchanges && later.exchange_tick > report.exchange_tick, "{later:?}");
    assert_eq!(alone.planner().switch(true).map(|change| change.phase), Some(Phase::Watching));
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn without_a_bank_or_without_settings_nothing_is_planned_and_the_report_says_why() {
    let with = settings(Causes::NONE);
    let blind = device::Settings { control: model::Settings { feedback: None, ..with.control }, ..with };
    let without = device::Settings { adaptation: None, ..with };
    let beyond = device::Settings { adaptation: Some(Settings { gain: 0.9, ..Settings::TYPICAL }), ..with };
    for (settings, why) in [(blind, Off::NoSensor), (without, Off::Settings), (beyond, Off::OutOfRange)] {
        let mut rig = Rig::new(&settings);
        let mut alone = Alone::new(terms(&settings, &rig));
        rig.gain = 1.1;
        assert_eq!(run(&mut rig, &mut alone, 0, 40_000), []);
        assert_eq!(alone.planner().switch(false), None);
        assert_eq!((alone.planner().report().why_off(), alone.planner().next().is_none()), (Some(why), true));
    }
    assert_eq!(Alone::new(Terms::NONE).planner().report().why_off(), Some(Off::NoSensor));
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn an_exchange_waits_for_a_loop_that_is_settled_and_moves_no_code() {
    let settings = settings(Causes::NONE);
    let mut rig = Rig::new(&settings);
    let mut alone = Alone::new(terms(&settings, &rig));
    let tolerance_v = settled_within(rig.terms.bank().unwrap().range_v).to_f64();
    rig.gain = 1.1;
    let (mut last, mut exchanges, mut largest_v) = (None, 0, 0.0f64);
    rig.run(0, 120_000, |rig, _, done, _| {
        let applied_v = done.output.applied.to_f64();
        let exchanged = alone.planner().report().exchanges;
        if exchanged != exchanges {
            exchanges = exchanged;
            largest_v = largest_v.max((applied_v - last.unwrap_or(applied_v)).abs());
        }
        last = Some(applied_v);
        let error_v = (done.output.target.to_f64() - done.output.stiffness.to_f64()).abs();
        alone.after_tick(&mut rig.control, &mut rig.isolation, done);
        let now = alone.planner().report().exchanges;
        assert!(now == exchanges || error_v <= tolerance_v, "an exchange at an error of {error_v} V");
    });
    assert!(exchanges > 5 && largest_v < 3.0, "{exchanges} exchanges, {largest_v} V");
}

/// A planner that is in time, or always late by one block, as a log that stalls makes it: plans that it made, and exchanges that it took
/// for done.
fn handed_over(in_time: bool) -> (u32, u32) {
    let settings = settings(Causes::NONE);
    let mut rig = Rig::new(&settings);
    rig.gain = 1.1;
    let (mut planner, mut handover) = (Planner::new(terms(&settings, &rig)), Handover::EMPTY);
    let (mut late, mut plans) = (None, 0);
    rig.run(0, 40_000, |rig, tick, done, _| {
        if rig.isolation.ends_block(done) {
            handover.end_block(&mut rig.control, &mut rig.isolation, done, tick);
            if !in_time {
                handover.put(late.as_ref());
            }
            let (seen, tick) = handover.take().unwrap();
            planner.plan(&seen, tick);
            late = planner.next().copied();
            if in_time {
                handover.put(late.as_ref());
            }
            plans += u32::from(late.is_some());
        }
    });
    (plans, planner.report().exchanges)
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_plan_that_comes_after_the_end_of_its_block_is_dropped() {
    let (plans, exchanges) = handed_over(false);
    assert!(plans > 5, "{plans}");
    assert_eq!(exchanges, 0, "what runs is not what the planner takes for it");
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_plan_that_comes_before_the_end_of_its_block_is_exchanged_there() {
    let (plans, exchanges) = handed_over(true);
    assert!(exchanges > 5 && exchanges <= plans, "{exchanges} of {plans}");
}
