//! The options of a controlled loop, which `vsj stair` and `vsj export` share.

use clap::Args;
use model::Gains;
use simulation::control_loop::{Controller, Options};

use super::choice::{CONTROLLER, one_of};

/// Spring, controller and amplifier.
#[derive(Args, Debug)]
pub(crate) struct LoopArguments {
    /// Controller
    #[arg(long, value_parser = one_of(CONTROLLER), default_value = "paper")]
    controller: Controller,
    /// The spring: `paper`, or a plant file of at most 1 MiB; its recorded limit and slew apply where they are stricter than
    /// the options
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    pub(crate) plant: String,
    /// Highest voltage of the amplifier, in V
    #[arg(long, default_value_t = 700.0, value_name = "V", allow_negative_numbers = true)]
    limit_v: f64,
    /// Lowest voltage of the amplifier, in V
    #[arg(long, default_value_t = 0.0, value_name = "V", allow_negative_numbers = true)]
    min_v: f64,
    /// Slew limit of the amplifier, in V/s; default: none
    #[arg(long, value_name = "V/S", allow_negative_numbers = true)]
    slew_v_per_s: Option<f64>,
    /// Width of the DAC, in bits
    #[arg(long, default_value_t = 12, value_name = "BITS")]
    dac_bits: u32,
    /// Proportional gain of the controller
    #[arg(long, default_value_t = Gains::PAPER.proportional, value_name = "GAIN", allow_negative_numbers = true)]
    kp: f64,
    /// Integral gain of the controller, in 1/s
    #[arg(long, default_value_t = Gains::PAPER.integral_per_s, value_name = "GAIN", allow_negative_numbers = true)]
    ki: f64,
    /// Time constant of the fast controller's approach to the target, in s, 0 to 1; default: 0
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    approach_s: Option<f64>,
    /// Ticks per second, 100 to 10 000
    #[arg(long, default_value_t = 1000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: f64,
}

impl LoopArguments {
    /// The settings of the loop.
    pub(crate) fn options(&self) -> Options {
        let Self { controller, limit_v, min_v, slew_v_per_s, dac_bits, kp, ki, approach_s, rate_hz, .. } = *self;
        Options { controller, limit_v, min_v, slew_v_per_s, dac_bits, kp, ki, approach_s, rate_hz, feedback: None }
    }
}
