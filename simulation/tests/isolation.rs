//! The fixed-point bank against its reference, over springs that change while the controller runs.

use model::isolation::{self, Cause, Verdict};
use model::{Config, Input, SampleTime, ScaledStiffness, Settings, State, Validate, Volts};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use simulation::isolation::reference::Bank;
use simulation::plant_file::PlantFile;
use simulation::spring_error::{DifferingSpring, Parameter, SpringError};

/// Runs both banks for 150 s; after 30 s the spring has the error. Every decision of both is compared. Returns the last verdict, the
/// size and its standard deviation.
fn both(error: SpringError, offset_v: f64) -> (Verdict, (f64, f64)) {
    let config: Config = Settings::PAPER.validate().unwrap().quantize();
    let settings = isolation::Settings::PAPER;
    let bank = settings.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap().quantize();
    let (mut state, mut fixed, mut reference) =
        (State::default(), isolation::State::default(), Bank::new(settings, 1000.0));
    let nominal = DifferingSpring::new(&PlantFile::from(model::Plant::PAPER), &SpringError::default());
    let faulty = DifferingSpring::new(&PlantFile::from(model::Plant::PAPER), &error);
    let (mut spring, mut other) = (nominal.spring(), faulty.spring());
    let mut at = spring.at_rest();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut compared = 0;
    for tick in 0..150_000u32 {
        if tick == 30_000 {
            std::mem::swap(&mut spring, &mut other);
        }
        let target = [100.0, 400.0, 200.0, 500.0, 0.0, 300.0, 50.0][(tick / 7000) as usize % 7];
        let output = config.tick(&mut state, Input { target: Volts::new(target).unwrap(), measured: None });
        spring.apply(&mut at, output.applied.to_f64());
        let noise: f64 = StandardNormal.sample(&mut random);
        let (gain, offset) = if tick < 30_000 { (1.0, 0.0) } else { (faulty.gain, offset_v) };
        let reading = Volts::new(gain * spring.stiffness(&at) + offset + noise).unwrap();
        spring.hold(&mut at, 1e-3);
        let before = fixed.decisions();
        bank.tick(&mut fixed, output.applied, output.stiffness, Some(ScaledStiffness(reading.0)));
        reference.tick(output.applied.to_f64(), output.stiffness.to_f64(), Some(reading.to_f64()));
        if fixed.decisions() != before {
            compared += 1;
            assert_eq!(fixed.decisions(), reference.rounds, "tick {tick}");
            assert_eq!(fixed.verdict(), reference.verdict, "tick {tick}");
            let (none, least) = fixed.report().energies();
            assert!((none / reference.none - 1.0).abs() < 0.01, "tick {tick}: {none} {}", reference.none);
            // What is left is the small difference of large sums.
            let tolerance = 0.02 * reference.least + 1e-6 * reference.none + 5.0;
            assert!((least - reference.least).abs() < tolerance, "tick {tick}: {least} {}", reference.least);
        }
    }
    assert_eq!(compared == 0, fixed.verdict() == Verdict::Quiet);
    let (size, deviation) = fixed.report().size();
    (fixed.verdict(), (size, deviation))
}

#[test]
fn a_spring_without_a_fault_is_quiet() {
    assert_eq!(both(SpringError::default(), 0.0).0, Verdict::Quiet);
}

#[test]
fn a_gain_a_share_a_time_constant_and_an_offset_are_named_with_their_sizes() {
    for (parameter, by, cause, size) in [
        (Parameter::Gain, 0.03, Cause::GainError, 0.03),
        (Parameter::Share, 0.3, Cause::InstantaneousShare, 0.3 / 11.0),
        (Parameter::TimeConstant, -0.1, Cause::TimeConstant, f64::ln(0.9)),
    ] {
        let (verdict, (found, deviation)) = both(SpringError::default().with(parameter, by), 0.0);
        assert_eq!(verdict, Verdict::Named(cause), "{parameter:?}");
        // The signature is linear in the size.
        assert!((found - size).abs() < 0.05 * size.abs() + 3.0 * deviation, "{parameter:?}: {found} {size}");
    }
    let (verdict, (found, _)) = both(SpringError::default(), 4.0);
    assert_eq!(verdict, Verdict::Named(Cause::ReadingOffset));
    assert!((found - 4.0).abs() < 0.1, "{found}");
}
