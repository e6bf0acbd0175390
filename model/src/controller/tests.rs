//! Tests of the tick with every pre-compensator, which an image with the feature `robust` has.
#![cfg(feature = "robust")]

mod anti_windup;
mod first_voltage;
#[cfg(feature = "feedback")]
mod transfer;

use super::*;

fn input(target_v: f64) -> Input {
    Input { target: Volts::new(target_v).unwrap(), measured: None }
}

fn quantized(settings: &Settings) -> Config {
    settings.validate().unwrap().quantize()
}
