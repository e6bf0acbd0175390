//! The settings as C has them: zero means that a part is absent.

use model::extended::{lags::MAX_LAGS, law::MAX_POINTS, memory::MAX_PLAYS};
use model::{Gains, Settings};

/// `vsj_spring`: the spring that the controller's estimator runs, with the keys of a plant file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spring {
    /// Part of a change that is instantaneous.
    pub share: f64,
    /// Time constants, in s.
    pub tau_s: [f64; MAX_LAGS],
    /// Weight of each time constant; 0 for a single one with the weight `1 - share`.
    pub weights: [f64; MAX_LAGS],
    /// First time constant at 500 V, in s; 0 if it is constant.
    pub tau_high_s: f64,
    /// Hysteresis: weight of the voltage itself.
    pub direct: f64,
    /// Hysteresis: half the width of each play operator, in V.
    pub thresholds_v: [f64; MAX_PLAYS],
    /// Hysteresis: weight of each play operator.
    pub play_weights: [f64; MAX_PLAYS],
    /// Static law: voltage of each point, in V.
    pub law_voltage_v: [f64; MAX_POINTS],
    /// Static law: stiffness at each point, in V.
    pub law_stiffness: [f64; MAX_POINTS],
    /// Leakage: part that is finally lost.
    pub leakage_share: f64,
    /// Leakage: time constant, in s; 0 without leakage.
    pub leakage_tau_s: f64,
    /// Number of time constants.
    pub lags: u32,
    /// Number of play operators; there is no hysteresis if `direct` is 0 too.
    pub plays: u32,
    /// Number of points of the law; 0 without one.
    pub points: u32,
    /// Not read.
    pub reserved: u32,
}

/// `vsj_sensor`: a stiffness sensor, the fields of [`model::Feedback`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensor {
    /// Standard deviation of a reading, in V; 0 without a sensor.
    pub noise_v: f64,
    /// Standard deviation with which the model's error wanders, in V per root second.
    pub model_uncertainty: f64,
    /// Shortest time constant of the correction, in s.
    pub fastest_s: f64,
    /// Time between two readings, in s.
    pub interval_s: f64,
    /// Age above which a reading is stale, in s.
    pub oldest_s: f64,
    /// Lowest value that the sensor can give, in V.
    pub lowest_v: f64,
    /// Highest value that the sensor can give, in V.
    pub highest_v: f64,
    /// Time constant with which the correction decays while the sensor is not trusted, in s.
    pub fade_s: f64,
}

/// `VSJ_NONE`: the target is the voltage.
pub const NONE: u32 = 0;
/// `VSJ_PAPER`: the report's proportional-integral pre-compensator.
pub const PAPER: u32 = 1;
/// `VSJ_FAST`: the time-optimal pre-compensator.
pub const FAST: u32 = 2;
/// `VSJ_ROBUST`: the pre-compensator for a spring that is known to within errors.
pub const ROBUST: u32 = 3;

/// `vsj_margin`: how well [`ROBUST`] knows the spring, the fields of [`model::Margin`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Known {
    /// Relative error of all time constants, both ways.
    pub time_constant: f64,
    /// Relative error of the share, both ways.
    pub share: f64,
    /// Relative error of the gain, both ways.
    pub gain: f64,
    /// Overshoot that is allowed, as a part of the step.
    pub overshoot: f64,
    /// Fall back that is allowed, as a part of the step.
    pub fall_back: f64,
}

/// `vsj_settings`: everything that a controller is built from, in SI units.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct All {
    /// Ticks per second, in Hz.
    pub rate_hz: f64,
    /// Voltage at the DAC's highest code, in V.
    pub full_scale_v: f64,
    /// Lowest voltage that may be put out, in V.
    pub min_v: f64,
    /// Highest voltage that may be put out, in V.
    pub max_v: f64,
    /// Fastest change of the voltage, in V/s; 0 for no limit.
    pub slew_v_per_s: f64,
    /// Proportional gain of [`PAPER`], in V/V.
    pub kp: f64,
    /// Integral gain of [`PAPER`], in 1/s.
    pub ki: f64,
    /// Time constant of the approach of [`FAST`], in s.
    pub approach_s: f64,
    /// Width of the DAC, in bits.
    pub dac_bits: u32,
    /// [`NONE`], [`PAPER`], [`FAST`] or [`ROBUST`].
    pub controller: u32,
    /// The spring.
    pub spring: Spring,
    /// The stiffness sensor.
    pub sensor: Sensor,
    /// How well [`ROBUST`] knows the spring.
    pub margin: Known,
}

impl All {
    /// The report's spring, controller and range at 1 kHz.
    pub fn paper() -> Self {
        let Settings { rate_hz, plant, amplifier, .. } = Settings::PAPER;
        let Gains { proportional, integral_per_s } = Gains::PAPER;
        let mut spring = Spring { share: plant.share, lags: 1, ..Spring::default() };
        spring.tau_s[0] = plant.time_constant_s;
        Self {
            rate_hz,
            full_scale_v: amplifier.full_scale_v,
            min_v: amplifier.min_v,
            max_v: amplifier.max_v,
            slew_v_per_s: 0.0,
            kp: proportional,
            ki: integral_per_s,
            approach_s: 0.0,
            dac_bits: amplifier.dac_bits,
            controller: PAPER,
            spring,
            sensor: Sensor::default(),
            margin: Known::default(),
        }
    }
}
