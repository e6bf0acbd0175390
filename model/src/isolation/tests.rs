mod faults;

use super::*;
use crate::units::SampleTime;
use crate::validated::Validate;
use random_numbers::Xorshift32;
use std::vec::Vec;

fn config(rate_hz: f64) -> Config {
    let interval_s = f64::max(1e-3, 1.0 / rate_hz);
    let settings = Settings { interval_s, ..Settings::PAPER };
    settings.validate(SampleTime::from_rate(rate_hz).unwrap()).unwrap().quantize()
}

/// Returns a digest continued over further values: the FNV-1a hash, a value at a time.
fn continued(digest: u64, values: &[i64]) -> u64 {
    values.iter().fold(digest, |digest, &value| (digest ^ value as u64).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn a_setting_out_of_range_is_rejected_by_name() {
    let time = SampleTime::from_rate(1000.0).unwrap();
    let paper = Settings::PAPER;
    let mut short = paper;
    short.plant.time_constant_s = 0.2;
    for (settings, field) in [
        (short, "plant.time_constant_s"),
        (Settings { noise_v: 0.0, ..paper }, "noise_v"),
        (Settings { interval_s: 1.0, ..paper }, "interval_s"),
        (Settings { noise_correlation_s: -1.0, ..paper }, "noise_correlation_s"),
        (Settings { range_v: f64::NAN, ..paper }, "range_v"),
        (Settings { alarm_nats: 1.0, ..paper }, "alarm_nats"),
        (Settings { margin_nats: 0.0, ..paper }, "margin_nats"),
        (Settings { tolerance: Tolerance { gain: 0.3, ..Tolerance::NONE }, ..paper }, "tolerance.gain"),
    ] {
        assert_eq!(settings.validate(time).unwrap_err().field, field);
    }
}

/// Whatever the rate is, a block is at most half of the spring's time constant, and at least twice the time between two readings.
#[test]
fn spring_and_sensor_fit_the_length_of_a_block() {
    for (rate_hz, block_s) in [(1000.0, 0.128), (10_000.0, 0.1024)] {
        let rejected = |time_constants: f64, intervals: f64| {
            let mut settings = Settings { interval_s: intervals * block_s, ..Settings::PAPER };
            settings.plant.time_constant_s = time_constants * block_s;
            settings.validate(SampleTime::from_rate(rate_hz).unwrap()).err().map(|error| error.field)
        };
        assert_eq!(rejected(2.01, 0.49), None, "{rate_hz} Hz");
        assert_eq!(rejected(1.99, 0.49), Some("plant.time_constant_s"), "{rate_hz} Hz");
        assert_eq!(rejected(2.01, 0.51), Some("interval_s"), "{rate_hz} Hz");
    }
}

#[test]
fn the_noise_of_a_block_is_that_of_a_mean_of_correlated_readings() {
    let white = Settings::PAPER.block_noise(0.128);
    assert!((white.0 - 1.0 / 128f64.sqrt()).abs() < 1e-12 && white.1 == 0.0);
    assert_eq!(Settings { noise_correlation_s: -0.0, ..Settings::PAPER }.block_noise(0.128), white);
    // Correlated over far more than a block: the mean is as noisy as a reading, and neighbours agree.
    let slow = Settings { noise_correlation_s: 10.0, ..Settings::PAPER }.block_noise(0.128);
    assert!((slow.0 - 1.0).abs() < 0.01 && (0.98..1.0).contains(&slow.1), "{slow:?}");
}

/// With overflow checks, as all tests.
#[test]
fn no_input_overflows_and_garbage_is_not_named() {
    let ticks = if cfg!(miri) { 1500 } else { 400_000u32 };
    for rate_hz in [100.0, 1000.0, 10_000.0] {
        let (config, mut state, mut numbers) = (config(rate_hz), State::default(), Xorshift32::new(7));
        let mut any = |wild: bool| {
            let value = numbers.draw() as i32;
            if wild { value } else { value >> 4 }
        };
        for tick in 0..ticks {
            // Stretches of values of the whole range of a signal, and of ordinary ones.
            let wild = tick & 0x8000 == 0;
            let applied = Volts(Signal::from_bits(any(wild)));
            let model = ScaledStiffness(Signal::from_bits(any(wild)));
            let reading = (tick % 7 != 0).then(|| ScaledStiffness(Signal::from_bits(any(wild))));
            config.tick(&mut state, applied, model, reading);
            assert!(!matches!(state.verdict(), Verdict::Named(_)), "{:?}", state.verdict());
        }
        if !cfg!(miri) {
            assert_eq!(state.verdict(), Verdict::Unknown);
            assert!(state.decisions() > 10);
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_stuck_sensor_is_named_and_an_acknowledged_alarm_comes_again() {
    let (config, mut state, mut numbers) = (config(1000.0), State::default(), Xorshift32::new(7));
    let mut alarms = 0;
    for tick in 0..80_000u32 {
        let volts = [100, 300, 0, 200][(tick / 6000) as usize % 4];
        let level = Signal::from_num(volts);
        let noise = Signal::from_bits((numbers.draw() & 0x3f_ffff) as i32 - 0x1f_ffff);
        let reading = if tick < 20_000 { level + noise } else { Signal::from_num(150) };
        config.tick(&mut state, Volts(level), ScaledStiffness(level), Some(ScaledStiffness(reading)));
        if tick < 20_000 {
            assert_eq!(state.verdict(), Verdict::Quiet);
        }
        if tick == 50_000 {
            assert_eq!(state.verdict(), Verdict::Named(Cause::StuckSensor));
            assert!((100..400).contains(&state.since_blocks()), "{}", state.since_blocks());
            state.acknowledge();
            assert_eq!((state.verdict(), state.since_blocks()), (Verdict::Quiet, 0));
            alarms += 1;
        }
    }
    assert_eq!((state.verdict(), alarms), (Verdict::Named(Cause::StuckSensor), 1));
}

/// The mean of a block is that of the readings that have come, so that the fault of a sensor that is silent for 20 s is the same one.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_gap_in_the_readings_is_a_part_of_the_time_since_the_fault_began() {
    let (config, mut numbers) = (config(1000.0), Xorshift32::new(7));
    let (mut whole, mut gap) = (State::default(), State::default());
    for tick in 0..60_000u32 {
        let level = Signal::from_num([100, 300, 0, 200][(tick / 6000) as usize % 4]);
        let noise = Signal::from_bits((numbers.draw() & 0x3f_ffff) as i32 - 0x1f_ffff);
        let offset = if tick < 20_000 { Signal::ZERO } else { Signal::from_num(20) };
        let reading = Some(ScaledStiffness(level + noise + offset));
        config.tick(&mut whole, Volts(level), ScaledStiffness(level), reading);
        let heard = !(30_000..50_000).contains(&tick);
        config.tick(&mut gap, Volts(level), ScaledStiffness(level), reading.filter(|_| heard));
    }
    assert!(whole.since_blocks() > 300, "{}", whole.since_blocks());
    assert_eq!(gap.since_blocks(), whole.since_blocks());
}

/// 0.128 / 0.0128 is less than 10 in floating point.
#[test]
fn a_block_with_all_the_readings_that_its_interval_promises_is_used() {
    let settings = Settings { interval_s: 0.0128, ..Settings::PAPER };
    assert_eq!(settings.readings(0.128), 10);
    let short = Settings { interval_s: 0.001_000_000_01, ..Settings::PAPER };
    assert_eq!(short.readings(0.128), 128);
}

#[test]
fn missing_readings_leave_the_bank_quiet() {
    let (config, mut state) = (config(1000.0), State::default());
    for tick in 0..if cfg!(miri) { 2000 } else { 20_000u32 } {
        let volts = Signal::from_num((tick / 3000) * 100);
        config.tick(&mut state, Volts(volts), ScaledStiffness(volts), None);
    }
    assert_eq!(state.verdict(), Verdict::Quiet);
}

#[test]
fn numbers_of_verdicts_and_places_of_causes_agree() {
    assert!(Cause::ALL.iter().enumerate().all(|(place, cause)| *cause as usize == place));
    let verdict = Verdict::Ambiguous(Cause::Delay, Cause::SeriesLag);
    assert_eq!(verdict.code(), 4 << 8 | (Cause::SeriesLag as u16) << 4 | Cause::Delay as u16);
    assert_eq!([Verdict::Quiet, Verdict::Alarm, Verdict::Unknown].map(Verdict::code), [0, 256, 512]);
    let words = (0..5u16).map(|state| Verdict::from_code(state << 8).unwrap().name());
    assert!(words.eq(["quiet", "alarm", "unknown", "named", "ambiguous"]));
    let known = (0..=u16::MAX).filter_map(|code| Some((code, Verdict::from_code(code)?)));
    assert!(known.clone().all(|(code, verdict)| verdict.code() == code));
    assert_eq!(known.count(), 3 + 16 + 256);
    let set = Causes::NONE.with(Cause::Delay).with(Cause::StuckSensor);
    assert_eq!((set.bits(), Causes::from_bits(set.bits()).iter().count()), (1 << 10 | 1 << 15, 2));
    assert!(set.contains(Cause::Delay) && !set.contains(Cause::GainError) && !set.is_empty());
}

/// The size of each cause is in the unit that the cause is described with: the coefficient of its vector is per range and per block.
#[test]
fn a_size_is_in_the_unit_of_its_cause() {
    let blocks = f64::from(bank::MOST_BLOCKS);
    for (cause, unit) in [
        (Cause::GainError, 1.0),
        (Cause::Hysteresis, 700.0),
        (Cause::AmplifierSlew, 0.128 / 700.0),
        (Cause::Delay, 0.128),
        (Cause::ReadingOffset, 1.0),
        (Cause::Drift, 1.0 / (0.128 * blocks)),
    ] {
        assert!((Settings::PAPER.unit(cause, 1000.0) / unit - 1.0).abs() < 1e-12, "{cause:?}");
    }
}

/// A finding holds the size in the unit of its cause, the 95 % interval that the noise and the error of the signature leave it, and the
/// part of the residual's energy that the cause explains: none if it leaves more than there was.
#[test]
fn a_finding_holds_size_interval_and_explained_part() {
    // 3/8 of 2^1; the information is 2^24 times 2^16 over 2^20.
    let size = decision::Size { numerator: 3 << 21, denominator: 1 << 24, exponent: 1, scale: 8 };
    let energies = (8 << 20, 2 << 20);
    let report = Report { verdict: Verdict::Named(Cause::Delay), since_blocks: 5, size, energies, blocks: 1 };
    assert_eq!((report.energies(), report.size()), ((8.0, 2.0), (0.75, 1.0 / 1024.0)));
    let finding = |report: Report| report.finding(&Settings::PAPER, 1000.0).unwrap();
    let Finding { cause, other, size, half_width, explained } = finding(report);
    assert_eq!((cause, other, size, explained), (Cause::Delay, None, 0.75 * 0.128, 0.75));
    // An energy of one variance above the noise, and six that are explained.
    let (of_excess, of_explained) = bank::SIGNATURE_ERRORS[Cause::Delay as usize];
    let noise = 1.96 * 1.96;
    let deviations = (noise + of_excess * of_excess + 6.0 * of_explained * of_explained).sqrt();
    assert!((half_width - deviations * 0.128 / 1024.0).abs() < 1e-9, "{half_width}");
    let linear = finding(Report { verdict: Verdict::Named(Cause::GainError), ..report });
    assert!((linear.half_width - 1.96 / 1024.0).abs() < 1e-12, "{linear:?}");
    assert_eq!(finding(Report { energies: (8 << 20, 9 << 20), ..report }).explained, 0.0);
}

/// A size on which the readings do not depend is no size of 0 that is known exactly: its interval is that of what is possible.
#[test]
fn a_size_that_is_not_determined_can_be_any() {
    // From 0 to 0.9, and from -0.7 to 4.
    for (cause, middle, half) in [(Cause::ChargeLeakage, 0.45, 0.45), (Cause::GainError, 1.65, 2.35)] {
        let verdict = Verdict::Named(cause);
        let report = Report { verdict, since_blocks: 5, energies: (8 << 20, 2 << 20), blocks: 1, ..Report::default() };
        let Finding { size, half_width, .. } = report.finding(&Settings::PAPER, 1000.0).unwrap();
        assert!((size - middle).abs() < 1e-12 && (half_width - half).abs() < 1e-12, "{cause:?}: {size} {half_width}");
    }
}

#[test]
fn two_ambiguous_causes_in_either_order_say_the_same() {
    let (one, other) =
        (Verdict::Ambiguous(Cause::Delay, Cause::SeriesLag), Verdict::Ambiguous(Cause::SeriesLag, Cause::Delay));
    assert!(one.is_like(other) && one.is_like(one));
    assert!(!one.is_like(Verdict::Ambiguous(Cause::Delay, Cause::Drift)) && !one.is_like(Verdict::Named(Cause::Delay)));
}

#[test]
fn signatures_of_the_size_of_the_range_fit_however_small_the_noise_is() {
    for (rate_hz, interval_s) in [(1000.0, 1e-3), (10_000.0, 1e-4)] {
        let settings = Settings { noise_v: 0.05, interval_s, ..Settings::PAPER };
        let config = settings.validate(SampleTime::from_rate(rate_hz).unwrap()).unwrap().quantize();
        // In standard deviations with 10 fraction bits.
        let whitened = (i64::from(config.range) * i64::from(config.whitening)) >> 32;
        assert!(whitened <= i64::from(LARGEST), "{rate_hz} Hz: {whitened}");
    }
}

/// Other rates, correlated noise, a model that is known to within a tolerance, readings that are missing and an acknowledged alarm: no
/// tick of it may change unnoticed.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn every_tick_is_the_same_to_the_bit() {
    let tolerance = Tolerance { time_constant: 0.005, share: 0.01, gain: 0.002 };
    let paper = Settings::PAPER;
    for (rate_hz, settings, digest) in [
        (100.0, Settings { interval_s: 0.01, ..paper }, 0x7f7c_c97e_fcbc_452e),
        (1000.0, paper, 0xbfcc_48b6_bae3_19ff),
        (1000.0, Settings { noise_correlation_s: 0.05, ..paper }, 0x74dd_4aee_4c94_0c2f),
        (1000.0, Settings { tolerance, interval_s: 2e-3, ..paper }, 0x961e_1359_f3fa_98e5),
        (2000.0, Settings { interval_s: 5e-4, ..paper }, 0xebbe_6d1f_282a_3b49),
        (10_000.0, Settings { tolerance, noise_correlation_s: 0.05, ..paper }, 0x151a_7da7_b892_0832),
    ] {
        let config = settings.validate(SampleTime::from_rate(rate_hz).unwrap()).unwrap().quantize();
        let (mut state, mut numbers, mut all) = (State::default(), Xorshift32::new(7), 0xcbf2_9ce4_8422_2325u64);
        let mut slow = 0i64;
        // 3200 blocks of 128 ticks: beyond the number at which the sums are halved.
        let (fault, gap, end) = (20_000, 150_000..170_000, 409_600u32);
        for tick in 0..end {
            let level = Signal::from_num([100, 300, 0, 650, 200][(tick / 4500) as usize % 5]);
            slow += (i64::from(level.to_bits()) - slow) >> 12;
            let model = Signal::from_bits((slow as i32 >> 1) + (level.to_bits() >> 1));
            let noise = Signal::from_bits((numbers.draw() & 0x3f_ffff) as i32 - 0x1f_ffff);
            let error = if tick < fault { 0 } else { model.to_bits() >> 5 };
            let heard = tick % 5 != 0 && !gap.contains(&tick);
            let reading = heard.then(|| ScaledStiffness(Signal::from_bits(model.to_bits() + error) + noise));
            config.tick(&mut state, Volts(level), ScaledStiffness(model), reading);
            // Between whitening and tests of a block of 128 ticks.
            if tick == 349_993 {
                state.acknowledge();
            }
            let Report { verdict, since_blocks, size, energies, .. } = state.report();
            let values = [
                i64::from(verdict.code()),
                i64::from(since_blocks),
                i64::from(size.numerator),
                i64::from(size.denominator),
                energies.0,
                energies.1,
                i64::from(state.decisions()),
                i64::from(state.mean_voltage().0.to_bits()),
            ];
            all = continued(all, &values);
        }
        assert_eq!(all, digest, "{rate_hz} Hz: {all:#x}");
    }
}

#[test]
fn counters_at_their_ends_stay_there() {
    let config = config(1000.0);
    let mut state = State { age: u32::MAX, since_decision: u32::MAX, ..State::at_rest() };
    // Between the level at which the sums restart and that of an alarm nothing resets them.
    state.tests.highest = config.restart;
    config.assess(&mut state);
    assert_eq!((state.age, state.since_decision), (u32::MAX, u32::MAX));
}

#[test]
fn readings_are_pinned_below_the_model_by_more_than_three_deviations() {
    let config = config(1000.0);
    for (residual, pinned) in [(config.pinned_below, false), (config.pinned_below - 1, true)] {
        let mut state = State::at_rest();
        state.tests.highest = config.restart;
        (state.means.pinned, state.means.residual) = (true, residual);
        config.assess(&mut state);
        assert_eq!(state.pinned, pinned, "{residual}");
    }
}

#[test]
fn each_cause_has_its_name_its_unit_and_its_bit() {
    let units = ["", "", "", "", "", "", "V", "V", "V", "s/V", "s", "s", "V", "1/s", "", ""];
    assert_eq!(Cause::ALL.map(Cause::unit), units);
    for (cause, number) in Cause::ALL.into_iter().zip(0..) {
        assert_eq!(Cause::named(cause.name()), Some(cause));
        let set = Causes::NONE.with(cause).with(cause);
        assert_eq!((set.bits(), set.contains(cause)), (1 << number, true));
    }
    assert_eq!(Cause::named("hum"), None);
}

#[test]
fn a_block_is_the_shortest_of_at_least_100_ms() {
    let ticks = [100.0, 1280.0, 1281.0, 10_000.0].map(bank::block_ticks);
    assert_eq!(ticks, [128, 128, 256, 1024]);
}

/// Noise of 1 V in 128 readings of a block, and a range of 700 V.
#[test]
fn scales_are_those_of_noise_and_range() {
    let config = config(1000.0);
    let sigma_v = 1.0 / 128f64.sqrt();
    let volts = |bits: i32| Signal::from_bits(bits).to_num::<f64>();
    assert!((volts(config.pinned_below) + 3.0 * sigma_v).abs() < 1e-6);
    // One deviation is 1024, after a jump of the range half of it, with 10 fraction bits.
    let whitened = f64::from(config.whitening) / 2f64.powi(32) * sigma_v * 2f64.powi(20);
    assert!((whitened - 1024.0).abs() < 1e-3, "{whitened}");
    let jumps = Signal::from_num(1.0);
    let jump = config.jump.times(jumps).to_num::<f64>();
    assert!((jump - 512.0 / 700.0).abs() < 1e-5, "{jump}");
}

#[test]
fn whitened_values_keep_24_bits_and_their_sign() {
    let config = config(1000.0);
    let mut state = State::at_rest();
    state.vectors[..4].copy_from_slice(&[i32::MIN, i32::MAX, 0, 1 << 20]);
    config.whiten(&mut state, 0);
    let whitened: Vec<i32> = state.whitened[..4].iter().map(|values| values[0]).collect();
    let deviation = 1024.0 * 128f64.sqrt();
    assert_eq!(whitened[..3], [-(1 << 24), (1 << 24) - 1, 0]);
    assert!((f64::from(whitened[3]) - deviation).abs() < 1.0, "{whitened:?}");
}

/// Both halves are whitened in two ticks, and no tick after them has work until the tests.
#[test]
fn the_ticks_between_the_parts_of_the_work_are_free() {
    let config = config(1000.0);
    let mut state = State::at_rest();
    state.means.usable = true;
    let next = |state: &mut State, step| {
        config.work(state, step);
        state.next
    };
    assert_eq!(next(&mut state, signatures::STEPS - 1), WHITEN);
    assert_eq!((next(&mut state, WHITEN), next(&mut state, WHITEN + 1)), (WHITEN + 1, TEST));
}

#[test]
fn the_sums_are_closed_in_the_tick_after_the_last_of_their_steps() {
    let config = config(1000.0);
    for (step, held, next) in [(CLOSE - 1, products::GROUP, CLOSE), (CLOSE, 0, IDLE)] {
        let mut state = State { held: products::GROUP, ..State::at_rest() };
        state.means.usable = true;
        config.work(&mut state, step);
        assert_eq!((state.held, state.next), (held, next));
    }
}

#[test]
fn with_the_sums_the_number_of_their_blocks_is_halved() {
    for halve in [false, true] {
        let mut state = State { blocks: 240, doubted: 10, held: 8, ..State::at_rest() };
        state.mode.halve = halve;
        config(1000.0).close(&mut state);
        let expected = if halve { (120, 5) } else { (240, 10) };
        assert_eq!(((state.blocks, state.doubted), state.held), (expected, 0));
    }
}

/// The products of a group are added when it is complete, and before that where the sums are halved or copied.
#[test]
fn a_group_is_added_when_it_is_complete_or_its_sums_are_needed() {
    let config = config(1000.0);
    let full = products::GROUP - 1;
    for (held, blocks, since_decision, added) in [
        (0, 100, 0, false),
        (full, 100, 0, true),
        (0, bank::MOST_BLOCKS - 2, 0, false),
        (0, bank::MOST_BLOCKS - 1, 0, true),
        (0, 100, bank::ROUND - 2, false),
        (0, 100, bank::ROUND - 1, true),
    ] {
        let mut state = State { held, blocks, since_decision, ..State::at_rest() };
        state.tests.highest = config.alarm;
        config.assess(&mut state);
        assert_eq!(state.next, if added { ADD } else { IDLE }, "{held} {blocks} {since_decision}");
    }
}

#[test]
fn a_sensor_is_released_only_after_it_was_pinned() {
    let config = config(1000.0);
    for was_pinned in [false, true] {
        let mut state = State { pinned: was_pinned, ..State::at_rest() };
        state.tests.highest = config.restart;
        config.assess(&mut state);
        assert_eq!(state.released, was_pinned);
    }
}

/// Of 100 blocks that leave `excess` more than their noise, and of which a cause explains 100.
#[test]
fn an_interval_grows_with_what_the_cause_leaves() {
    let mut grow = 0;
    for cause in Cause::ALL {
        let square = |excess: i64| {
            let of = Report::of(Verdict::Named(cause), 100, 0.125, 0);
            let energies = ((200 + excess) << 20, (100 + excess) << 20);
            let finding = Report { energies, ..of }.finding(&Settings::PAPER, 1000.0).unwrap();
            finding.half_width * finding.half_width
        };
        let [more, twice] = [50, 100].map(|excess| square(excess) - square(0));
        assert!((twice - 2.0 * more).abs() <= 1e-9 * twice.abs(), "{cause:?}: {more} {twice}");
        grow += u32::from(more > 0.0);
    }
    assert!(grow > 5, "{grow}");
}
