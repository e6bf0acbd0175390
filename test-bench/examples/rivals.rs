//! Counts on the emulated board the instructions of a tick of this controller and of alternatives:
//! `cargo xtask emulate --rivals`.
//!
//! Every controller runs the source report's spring through the same random targets and then to 300 V, where a working
//! controller settles. The crates implement the proportional-integral step alone; the response of their spring is simulated
//! and not counted. Every tick is a function call with inputs that are unknown to the optimiser.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::time::Duration;

use defmt_semihosting as _;
use discrete_pid::pid::{PidConfigBuilder, PidController};
use discrete_pid::time::Micros;
use dsp_process::SplitProcess;
use firmware::control::Stopwatch;
use idsp::Build;
use idsp::iir::{Biquad, BiquadClamp, DirectForm1, pid::Builder};
use model::units::Signal;
use model::{Config, Gains, Input, Output, Plant, Settings, State, Volts};
use random_numbers::Xorshift32;
use test_bench::mps2::instructions::{Counter, start_clock};
use test_bench::mps2::semihosting;
use test_bench::target::volts;

const SETTINGS: Settings = Settings::PAPER;
const GAINS: Gains = Gains::PAPER;
const PLANT: Plant = Plant::PAPER;
const SAMPLE_S: f64 = 1.0 / SETTINGS.rate_hz;
const MAX_V: f64 = SETTINGS.amplifier.max_v;
/// Number of ticks with a target that changes every 50 ticks.
const JUMPING: u32 = 10_000;
/// Number of all ticks; those at 300 V suffice to settle.
const TICKS: u32 = 40_000;
/// Final target: 300 V.
const END: Volts = Volts(Signal::const_from_int(300));

/// A controller with its spring.
trait Contender {
    /// Executes one tick and returns the output voltage, in V. Only the controller itself runs between start and stop of the
    /// stopwatch.
    fn tick(&mut self, target: Volts, stopwatch: &mut Counter) -> f64;
}

#[cortex_m_rt::entry]
fn main() -> ! {
    start_clock();
    let Ok(config) = SETTINGS.validate().map(|settings| settings.quantize()) else { semihosting::exit(1) };
    race("tick", &mut WholeTick { config, state: State::default() });
    race("tick_f64", &mut F64 { spring: Spring::default(), integral: 0.0, voltage: 0.0 });
    race("idsp", &mut Idsp::new());
    race("pid", &mut Pid::new());
    race("discrete_pid", &mut DiscretePid::new());
    semihosting::exit(0)
}

fn race(name: &'static str, contender: &mut dyn Contender) {
    let mut counter = Counter::begin();
    let (mut numbers, mut target) = (Xorshift32::new(1), Volts::ZERO);
    let mut reached_v = 0.0;
    for tick in 0..TICKS {
        if tick >= JUMPING {
            target = END;
        } else if tick % 50 == 0 {
            target = volts(numbers.draw());
        }
        reached_v = contender.tick(target, &mut counter);
    }
    let counted = counter.instructions();
    let end_mv = (reached_v * 1000.0) as i32;
    defmt::info!(
        "rival name={=str} min={=u32} mean={=u32} max={=u32} end_mv={=i32}",
        name,
        counted.min,
        counted.mean,
        counted.max,
        end_mv
    );
}

/// The source report's spring in double precision.
#[derive(Default)]
struct Spring {
    relaxed: f64,
}

impl Spring {
    #[inline(always)]
    fn stiffness(&self, voltage: f64) -> f64 {
        self.relaxed + PLANT.share * (voltage - self.relaxed)
    }

    #[inline(always)]
    fn pass(&mut self, voltage: f64) {
        // 1 - exp(-T / tau), with an error of 1e-12.
        const X: f64 = SAMPLE_S / PLANT.time_constant_s;
        const RELAXED: f64 = X - X * X / 2.0 + X * X * X / 6.0;
        self.relaxed += RELAXED * (voltage - self.relaxed);
    }
}

/// The controller of the firmware: limits, slew, anti-windup, estimator, pre-compensator, DAC code.
struct WholeTick {
    config: Config,
    state: State,
}

#[inline(never)]
fn whole_tick(config: &Config, state: &mut State, target: Volts) -> Output {
    config.tick(state, Input { target, ..Input::default() })
}

impl Contender for WholeTick {
    fn tick(&mut self, target: Volts, stopwatch: &mut Counter) -> f64 {
        let target = black_box(target);
        stopwatch.start();
        let output = whole_tick(&self.config, &mut self.state, target);
        stopwatch.stop();
        black_box(output).applied.to_f64()
    }
}

/// The whole tick of this controller in double precision, with precomputed constants.
struct F64 {
    spring: Spring,
    integral: f64,
    voltage: f64,
}

impl F64 {
    const CODES: f64 = ((1 << SETTINGS.amplifier.dac_bits) - 1) as f64;
    const VOLTS_PER_CODE: f64 = SETTINGS.amplifier.full_scale_v / Self::CODES;

    #[inline(never)]
    fn whole_tick(&mut self, target: f64) -> (u16, f64) {
        const RELAXED_GAIN: f64 = GAINS.proportional * (1.0 - PLANT.share);
        const SHARED: f64 = 1.0 / (1.0 + GAINS.proportional * PLANT.share);
        const RESET: f64 = SAMPLE_S * GAINS.integral_per_s / GAINS.proportional;
        const CODES_PER_VOLT: f64 = 1.0 / F64::VOLTS_PER_CODE;
        // As large as the range, so without effect, but computed as in the firmware's tick.
        const STEP: f64 = SETTINGS.amplifier.full_scale_v;
        let target = target.clamp(0.0, MAX_V);
        let wanted = (GAINS.proportional * target - RELAXED_GAIN * self.spring.relaxed + self.integral) * SHARED;
        self.voltage = wanted.clamp(self.voltage - STEP, self.voltage + STEP).clamp(0.0, MAX_V);
        self.integral += RESET * (self.voltage - self.integral);
        let code = (self.voltage * CODES_PER_VOLT + 0.5) as u16;
        let applied = f64::from(code) * Self::VOLTS_PER_CODE;
        let stiffness = self.spring.stiffness(applied);
        self.spring.pass(applied);
        (code, stiffness)
    }
}

impl Contender for F64 {
    fn tick(&mut self, target: Volts, stopwatch: &mut Counter) -> f64 {
        let target = black_box(target.to_f64());
        stopwatch.start();
        let output = self.whole_tick(target);
        stopwatch.stop();
        f64::from(black_box(output).0) * Self::VOLTS_PER_CODE
    }
}

/// Coefficients with 28 fraction bits: range up to 8, for a gain of 4.
type Coefficient = dsp_fixedpoint::Q32<28>;

/// The crate idsp: a biquad as proportional-integral controller, with its output limited before the feedback.
struct Idsp {
    filter: BiquadClamp<Coefficient, i32>,
    state: DirectForm1<i32>,
    spring: Spring,
}

impl Idsp {
    fn new() -> Self {
        let biquad: Biquad<Coefficient> =
            Builder::default().kp(GAINS.proportional).ki(GAINS.integral_per_s).build(&SAMPLE_S);
        let mut filter = BiquadClamp::from(biquad);
        (filter.min, filter.max) = (0, (MAX_V as i32) << 20);
        Self { filter, state: DirectForm1::default(), spring: Spring::default() }
    }

    #[inline(never)]
    fn step(&mut self, target: i32, measured: i32) -> i32 {
        self.filter.process(&mut self.state, target - measured)
    }
}

impl Contender for Idsp {
    fn tick(&mut self, target: Volts, stopwatch: &mut Counter) -> f64 {
        const ONE_V: f64 = (1 << 20) as f64;
        let voltage = f64::from(self.state.y0()) / ONE_V;
        let (target, measured) = black_box((target.0.to_bits(), (self.spring.stiffness(voltage) * ONE_V) as i32));
        stopwatch.start();
        let output = self.step(target, measured);
        stopwatch.stop();
        let voltage = f64::from(black_box(output)) / ONE_V;
        self.spring.pass(voltage);
        voltage
    }
}

/// The crate pid in single precision.
struct Pid {
    controller: pid::Pid<f32>,
    voltage: f32,
    spring: Spring,
}

impl Pid {
    fn new() -> Self {
        let mut controller = pid::Pid::new(0.0, MAX_V as f32);
        controller.p(GAINS.proportional as f32, 1e4).i((GAINS.integral_per_s * SAMPLE_S) as f32, MAX_V as f32);
        Self { controller, voltage: 0.0, spring: Spring::default() }
    }

    #[inline(never)]
    fn step(&mut self, target: f32, measured: f32) -> f32 {
        self.controller.setpoint = target;
        self.controller.next_control_output(measured).output
    }
}

impl Contender for Pid {
    fn tick(&mut self, target: Volts, stopwatch: &mut Counter) -> f64 {
        let measured = self.spring.stiffness(self.voltage.into()) as f32;
        let (target, measured) = black_box((target.to_f64() as f32, measured));
        stopwatch.start();
        let output = self.step(target, measured);
        stopwatch.stop();
        self.voltage = black_box(output);
        self.spring.pass(self.voltage.into());
        self.voltage.into()
    }
}

/// The crate discrete_pid in single precision.
struct DiscretePid {
    controller: PidController<Micros, f32>,
    voltage: f32,
    spring: Spring,
    now_us: u64,
}

impl DiscretePid {
    fn new() -> Self {
        let config = PidConfigBuilder::default()
            .kp(GAINS.proportional as f32)
            .ki(GAINS.integral_per_s as f32)
            .sample_time(Duration::from_micros(1_000_000 / u64::from(firmware::RATE_HZ)))
            .output_limits(0.0, MAX_V as f32)
            .build();
        let Ok(config) = config else { semihosting::exit(1) };
        Self { controller: PidController::new_uninit(config), voltage: 0.0, spring: Spring::default(), now_us: 0 }
    }

    #[inline(never)]
    fn step(&mut self, target: f32, measured: f32, now_us: u64) -> f32 {
        self.controller.compute(measured, target, Micros(now_us), None)
    }
}

impl Contender for DiscretePid {
    fn tick(&mut self, target: Volts, stopwatch: &mut Counter) -> f64 {
        self.now_us += 1_000_000 / u64::from(firmware::RATE_HZ);
        let measured = self.spring.stiffness(self.voltage.into()) as f32;
        let (target, measured, now_us) = black_box((target.to_f64() as f32, measured, self.now_us));
        stopwatch.start();
        let output = self.step(target, measured, now_us);
        stopwatch.stop();
        self.voltage = black_box(output);
        self.spring.pass(self.voltage.into());
        self.voltage.into()
    }
}
