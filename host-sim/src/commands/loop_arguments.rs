//! The options of a controlled loop, which `vsj stair` and `vsj export` share.

use anyhow::Result;
use clap::Args;
use simulation::control_loop::{Controller, Options, gains, lowered};
use simulation::has_reference::remark_on_fall_back;
use simulation::plant_file::PlantFile;

use host_sim::output::terminal::remark;

use super::choice::{CONTROLLER, one_of};
use super::spring_error::Known;

/// Spring, controller and amplifier.
#[derive(Args, Debug)]
pub(crate) struct LoopArguments {
    /// Controller; default: paper, with --known robust
    #[arg(long, value_parser = one_of(CONTROLLER))]
    controller: Option<Controller>,
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
    /// Proportional gain of the paper controller; default: 4, less for a quick spring
    #[arg(long, value_name = "GAIN", allow_negative_numbers = true)]
    kp: Option<f64>,
    /// Integral gain of the paper controller, in 1/s; default: 1.35, less for a quick spring
    #[arg(long, value_name = "GAIN", allow_negative_numbers = true)]
    ki: Option<f64>,
    /// Time constant of the fast controller's approach to the target, in s, 0 to 1; default: 0
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    approach_s: Option<f64>,
    #[command(flatten)]
    known: Known,
    /// Ticks per second, 100 to 10 000
    #[arg(long, default_value_t = 1000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: f64,
}

impl LoopArguments {
    /// The settings of the loop around a spring; remarks on gains that are not the report's because the spring does not allow them.
    ///
    /// # Errors
    /// [`simulation::BadInput`] for options that would be ignored, and for a spring that the tick rejects.
    pub(crate) fn options(&self, plant: &PlantFile) -> Result<Options> {
        let Self { limit_v, min_v, slew_v_per_s, dac_bits, kp, ki, approach_s, rate_hz, .. } = *self;
        let margin = self.known.margin()?;
        let default = if margin.is_some() { Controller::Robust } else { Controller::Paper };
        let controller = self.controller.unwrap_or(default);
        let gains = gains([kp, ki], controller, plant, rate_hz)?;
        lowered(&gains, [kp, ki]).iter().for_each(|text| remark(text));
        margin.and_then(|margin| remark_on_fall_back(plant.extended(), &margin)).iter().for_each(|text| remark(text));
        let feedback = None;
        let options = Options {
            controller,
            limit_v,
            min_v,
            slew_v_per_s,
            dac_bits,
            kp: gains.proportional,
            ki: gains.integral_per_s,
            approach_s,
            margin,
            rate_hz,
            feedback,
        };
        options.check()?;
        Ok(options)
    }
}
