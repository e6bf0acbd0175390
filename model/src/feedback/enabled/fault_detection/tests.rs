//! Each bound of the detection, met exactly and exceeded by one step of a signal.

use super::*;
use crate::units::ScaledStiffness;

const STEP: Signal = Signal::from_bits(1);

/// A sensor with 1 V of noise, hence `6 noise_v` of 6 V, read every tick, and the state of its detection.
#[derive(Clone)]
struct Bench {
    config: Config,
    state: State,
}

impl Bench {
    fn new() -> Self {
        let config = Config::new(&Feedback::TYPICAL, SampleTime::from_rate(1000.0).unwrap());
        Self { config, state: State::default() }
    }

    /// A bench whose sensor is trusted after readings of the model's stiffness, `at`, with one step of noise.
    fn trusted(at: Signal) -> Self {
        let mut bench = Self::new();
        let inward = if at < Signal::ZERO { STEP } else { -STEP };
        for reading in 1..=TRUSTED {
            assert_eq!(bench.sensor(), Sensor::Failed(Fault::Absent), "before reading {reading}");
            bench.read(if reading % 2 == 0 { at } else { at + inward }, at);
        }
        assert_eq!(bench.sensor(), Sensor::Trusted);
        bench
    }

    fn sensor(&self) -> Sensor {
        self.state.sensor()
    }

    fn read(&mut self, stiffness: Signal, model: Signal) -> Option<Signal> {
        self.read_at_age(stiffness, model, 0)
    }

    fn read_at_age(&mut self, stiffness: Signal, model: Signal, age: u16) -> Option<Signal> {
        let reading = Reading { stiffness: ScaledStiffness(stiffness), age };
        self.config.evaluate(&mut self.state, Some(Sample { reading, model, mismatch: stiffness - model }))
    }

    /// Whether the next reading would be accepted.
    fn accepts(&self, stiffness: Signal, model: Signal) -> bool {
        self.clone().read(stiffness, model).is_some()
    }
}

fn volts(volts: f64) -> Signal {
    Signal::from_num(volts)
}

#[test]
fn readings_at_the_ends_of_the_sensor_range_are_good_and_four_beyond_are_a_fault() {
    for (end, outward) in [(volts(1000.0), STEP), (volts(-50.0), -STEP)] {
        let mut bench = Bench::trusted(end);
        assert_eq!(bench.read(end, end), Some(Signal::ZERO));
        for count in 1..=REJECTED {
            assert_eq!(bench.sensor(), Sensor::Trusted, "after {} readings", count - 1);
            assert_eq!(bench.read(end + outward, end), None);
        }
        assert_eq!(bench.sensor(), Sensor::Failed(Fault::OutOfRange));
    }
}

#[test]
fn at_rest_the_gate_is_six_standard_deviations() {
    let (bench, at) = (Bench::trusted(volts(100.0)), volts(100.0));
    let low_passed = upper(bench.state.mismatch);
    for (gate, outward) in [(volts(6.0), STEP), (volts(-6.0), -STEP)] {
        assert!(bench.accepts(at + low_passed + gate, at));
        assert!(!bench.accepts(at + low_passed + gate + outward, at));
    }
}

/// The gate lies about the mismatch that the accepted readings have had, and moves with it and with the model.
#[test]
fn the_gate_follows_the_mismatch_of_the_accepted_readings_and_a_jump_of_the_model() {
    let at = volts(100.0);
    let mut bench = Bench::trusted(at);
    let accepts = |bench: &Bench| [-8.0, -4.0, 4.0, 8.0].map(|mismatch| bench.accepts(at + volts(mismatch), at));
    assert_eq!(accepts(&bench), [false, true, true, false]);
    for reading in 0..20 {
        assert!(bench.read(at + volts(4.0) + Signal::from_bits(reading % 2), at).is_some());
    }
    assert_eq!(accepts(&bench), [false, false, true, true]);
    bench.state.shift(volts(-8.0));
    assert_eq!(accepts(&bench), [true, true, false, false]);
}

/// The model has just moved by 100 V, which widens the gate to 206 V: what remains is the bound of an abrupt change.
#[test]
fn while_the_model_moves_only_abrupt_changes_back_and_forth_are_rejected() {
    let mut bench = Bench::trusted(Signal::ZERO);
    let at = volts(100.0);
    bench.config.track_model(&mut bench.state, at);
    let most = bench.config.largest_change(&bench.state.envelope);
    // 9 noise_v, and a mode of 5 Hz over 100 V changes by 2 pi 5 Hz 1 ms 100 V.
    assert!((most.to_num::<f64>() - 9.0 - core::f64::consts::TAU * 0.5).abs() < 0.02, "{most}");
    let from = at + bench.state.last.max(upper(bench.state.mismatch));
    assert!(bench.accepts(from + most, at));
    assert!(!bench.accepts(from + most + STEP, at));
    // A spring that is late may jump once: the second reading at the new level is no change.
    assert_eq!(bench.read(at + volts(60.0), at), None);
    assert_eq!(bench.read(at + volts(60.0) + STEP, at), Some(volts(60.0) + STEP));
    // And back: four in a row are a fault.
    let mut back_and_forth = (0..8).map(|k| {
        bench.read(at + volts(if k % 2 == 0 { -60.0 } else { 60.0 }), at);
        bench.sensor()
    });
    assert!(back_and_forth.any(|sensor| sensor == Sensor::Failed(Fault::Jumping)));
}

#[test]
fn identical_readings_are_stuck_earlier_once_the_model_has_moved_by_more_than_six_standard_deviations() {
    let mut bench = Bench::trusted(Signal::ZERO);
    let reading = volts(0.5);
    for _ in 1..IDENTICAL {
        bench.read(reading, Signal::ZERO);
    }
    for (model, expected) in [
        (volts(6.0), Sensor::Trusted),
        (volts(-6.0), Sensor::Trusted),
        (volts(6.0) + STEP, Sensor::Failed(Fault::Stuck)),
        (volts(-6.0) - STEP, Sensor::Failed(Fault::Stuck)),
    ] {
        let mut bench = bench.clone();
        bench.read(reading, model);
        assert_eq!(bench.sensor(), expected, "the model has moved by {model} V");
    }
}

#[test]
fn a_hundred_identical_readings_at_rest_are_stuck_and_noise_is_needed_to_recover() {
    let mut bench = Bench::trusted(Signal::ZERO);
    let reading = volts(0.5);
    for count in 1..IDENTICAL_AT_REST {
        assert_eq!(bench.read(reading, Signal::ZERO), Some(reading), "reading {count}");
    }
    bench.read(reading, Signal::ZERO);
    assert_eq!(bench.sensor(), Sensor::Failed(Fault::Stuck));
    // Eight identical readings keep it stuck, although the model rests; fewer do not.
    for _ in 0..20 {
        for value in [0.25, 0.5] {
            (0..IDENTICAL).for_each(|_| _ = bench.read(volts(value), Signal::ZERO));
        }
        assert_eq!(bench.sensor(), Sensor::Failed(Fault::Stuck));
    }
    for _ in 0..20 {
        for value in [0.25, 0.5] {
            (1..IDENTICAL).for_each(|_| _ = bench.read(volts(value), Signal::ZERO));
        }
    }
    assert_eq!(bench.sensor(), Sensor::Trusted);
}

#[test]
fn silence_is_a_fault_after_the_oldest_age_and_four_intervals() {
    let trusted = Bench::trusted(Signal::ZERO);
    let oldest = 10;
    for (fault, age) in [(Fault::Absent, None), (Fault::Stale, Some(oldest + 1))] {
        let mut bench = trusted.clone();
        for tick in 0..=u32::from(oldest) + MISSED_INTERVALS {
            assert_eq!(bench.sensor(), Sensor::Trusted, "{fault:?} after {tick} ticks");
            match age {
                None => _ = bench.config.evaluate(&mut bench.state, None),
                Some(age) => _ = bench.read_at_age(STEP, Signal::ZERO, age),
            }
        }
        assert_eq!(bench.sensor(), Sensor::Failed(fault));
    }
}

#[test]
fn a_sample_counts_once_however_often_it_is_passed_while_it_ages() {
    let mut bench = Bench::trusted(Signal::ZERO);
    assert_eq!(bench.read_at_age(volts(1.0), Signal::ZERO, 0), Some(volts(1.0)));
    for age in 1..10 {
        assert_eq!(bench.read_at_age(volts(1.0), Signal::ZERO, age), None, "the same sample at age {age}");
    }
    // The sample that was taken one tick after it is a new one.
    assert_eq!(bench.read_at_age(volts(1.5), Signal::ZERO, 9), Some(volts(1.5)));
}

#[test]
fn more_than_one_outlier_in_five_readings_is_a_fault() {
    let sensor = |good: u16| {
        let mut bench = Bench::trusted(Signal::ZERO);
        for round in 0..40i32 {
            bench.read(volts(20.0) + Signal::from_bits(round), Signal::ZERO);
            (0..good).for_each(|k| _ = bench.read(Signal::from_bits(i32::from(k % 2)), Signal::ZERO));
        }
        bench.sensor()
    };
    assert_eq!(sensor(GOOD_PER_REJECTED), Sensor::Trusted);
    assert_ne!(sensor(GOOD_PER_REJECTED - 1), Sensor::Trusted);
}

#[test]
fn every_state_of_the_sensor_has_a_name_of_its_own() {
    let faults = [Fault::Absent, Fault::Stale, Fault::Stuck, Fault::Jumping, Fault::OutOfRange];
    let names = ["absent", "stale", "stuck", "jumping", "out-of-range"];
    assert_eq!(faults.map(|fault| Sensor::Failed(fault).name()), names);
    assert_eq!(Sensor::Trusted.name(), "trusted");
}

/// After 65 535 good readings, after 49.7 days without one.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn counters_stay_at_their_ends() {
    let mut bench = Bench::trusted(Signal::ZERO);
    for reading in 0..70_000 {
        let noise = Signal::from_bits(reading % 2);
        assert_eq!(bench.read(noise, Signal::ZERO), Some(noise), "reading {reading}");
    }
    assert_eq!(bench.state.good, u16::MAX);
    bench.state.since = u32::MAX - 1;
    for _ in 0..3 {
        bench.config.evaluate(&mut bench.state, None);
        assert_eq!((bench.state.since, bench.sensor()), (u32::MAX, Sensor::Failed(Fault::Absent)));
    }
    for reading in 0..70_000 {
        bench.read(volts(0.5), Signal::ZERO);
        assert!(reading < 100 || bench.sensor() == Sensor::Failed(Fault::Stuck), "reading {reading}");
    }
    assert_eq!(bench.state.identical, u16::MAX);
}
