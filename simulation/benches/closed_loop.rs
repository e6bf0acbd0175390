//! Time of the closed loop over the stair experiment: 70 s at 1 kHz, 70 001 samples an iteration.
//!
//! - `fixed_tick`: the controller's tick as it runs in the MCU, with limits, slew and DAC code; `fast_tick` and `robust_tick`: with
//!   these controllers.
//! - `isolation_tick`: the tick and that of the isolation bank, with readings that are the model's.
//! - `reference_f64`: the exact solution in double precision.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use model::{
    Amplifier, Approach, Compensation, Input, Margin, SampleTime, Settings, State, Validate, Volts, isolation,
};
use simulation::experiment::continuous;
use simulation::reference::Moment;
use simulation::schedule::Schedule;

const SAMPLES: usize = 70_001;

fn closed_loop(criterion: &mut Criterion) {
    let schedule = Schedule::stair();
    let mut reader = schedule.reader();
    let targets: Vec<f64> = (0..SAMPLES).map(|tick| reader.at(tick as f64 / 1000.0)).collect();
    let volts: Vec<Volts> = targets.iter().map(|&target| Volts::new(target).expect("within range")).collect();
    let mut group = criterion.benchmark_group("closed_loop");

    let amplifier = Amplifier { slew_v_per_s: Some(100_000.0), ..Amplifier::PAPER };
    let mut outputs = vec![(0u16, 0i32); SAMPLES];
    for (name, compensation) in [
        ("fixed_tick", Settings::PAPER.compensation),
        ("fast_tick", Compensation::TimeOptimal(Approach::DEAD_BEAT)),
        ("robust_tick", Compensation::Robust(Margin::TYPICAL)),
    ] {
        let settings = Settings { amplifier, compensation, ..Settings::PAPER };
        let config = settings.validate().expect("valid settings").quantize();
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let config = black_box(&config);
                let mut state = State::default();
                for (output, &target) in outputs.iter_mut().zip(black_box(&volts)) {
                    let now = config.tick(&mut state, Input { target, ..Input::default() });
                    *output = (now.code.0, now.stiffness.0.to_bits());
                }
                black_box(&outputs);
            });
        });
    }

    let config = Settings { amplifier, ..Settings::PAPER }.validate().expect("valid settings").quantize();
    let time = SampleTime::from_rate(1000.0).expect("a rate");
    let bank = isolation::Settings::PAPER.validate(time).expect("valid settings").quantize();
    group.bench_function("isolation_tick", |bencher| {
        bencher.iter(|| {
            let (config, bank) = (black_box(&config), black_box(&bank));
            let (mut state, mut watching) = (State::default(), isolation::State::default());
            for (output, &target) in outputs.iter_mut().zip(black_box(&volts)) {
                let now = config.tick(&mut state, Input { target, ..Input::default() });
                bank.tick(&mut watching, now.applied, now.stiffness, Some(now.stiffness));
                *output = (now.code.0, now.stiffness.0.to_bits());
            }
            black_box((&outputs, &watching));
        });
    });

    let system = continuous(&Settings::PAPER);
    let mut moments = vec![Moment::default(); SAMPLES];
    group.bench_function("reference_f64", |bencher| {
        let solution = system.at_rest(1e-3);
        bencher.iter(|| {
            let mut solution = black_box(&solution).clone();
            solution.run(black_box(&targets), &mut moments);
            black_box(&moments);
        });
    });
    group.finish();
}

criterion_group!(benches, closed_loop);
criterion_main!(benches);
