//! The computations, by the names used in `data/printed.toml`.

use anyhow::{Result, bail};

use crate::beam::regression::{Fit, straight_line};
use crate::reproduce::digits::short;
use crate::reproduce::inputs::Inputs;
use crate::reproduce::outcome::Outcome;
use crate::reproduce::{models, readings};

/// Runs the computation named `of`.
///
/// # Errors
/// If no computation has that name, or an input is missing.
pub fn compute(of: &str, inputs: &Inputs<'_>) -> Result<Outcome> {
    let sum = |terms: Vec<f64>| terms.iter().sum::<f64>();
    Ok(match of {
        "same" => Outcome {
            evidence: Some(format!("{} prints {}", inputs.word("place")?, short(inputs.number("value")?))),
            ..Outcome::exact(inputs.number("value")?)
        },
        "sum" => Outcome::exact(inputs.number("factor").unwrap_or(1.0) * sum(inputs.numbers("terms")?)),
        "product" => Outcome::exact(inputs.numbers("factors")?.iter().product()),
        "quotient" => Outcome::exact(inputs.number("dividend")? / inputs.number("divisor")?),
        "root_sum_square" => {
            Outcome::exact(inputs.numbers("terms")?.iter().map(|term| term * term).sum::<f64>().sqrt())
        }
        "proportional" => {
            Outcome::exact(inputs.number("value_mm")? * inputs.number("to_un")? / inputs.number("at_un")?)
        }
        "on_line" => {
            let (x, y, at) = (inputs.numbers("x")?, inputs.numbers("y")?, inputs.number("at")?);
            let (&[x0, x1], &[y0, y1]) = (&x[..], &y[..]) else { bail!("a line takes two points") };
            Outcome::exact(y0 + (y1 - y0) * (at - x0) / (x1 - x0))
        }
        "line" => {
            let fit = Fit::new(&straight_line(&inputs.numbers("x")?), &inputs.numbers("y")?)?;
            let (intercept, slope) = (fit.coefficient(0)?, fit.coefficient(1)?);
            Outcome::exact(match inputs.word("part")? {
                "intercept" => intercept.value,
                "intercept_low" => intercept.low,
                "intercept_high" => intercept.high,
                "slope" => slope.value,
                "slope_low" => slope.low,
                "slope_high" => slope.high,
                other => bail!("a line has no `{other}`"),
            })
        }
        "second_moment" => Outcome::exact(models::whole_beam(inputs)?.second_moment_m4()),
        "modulus_by_slope" => Outcome::exact(
            1e-3 * (1e-3 * inputs.number("length_mm")?).powi(3) / (3.0 * inputs.number("second_moment_m4")?),
        ),
        "shear_modulus" => {
            let two = 2.0 * (1.0 + inputs.number("poissons_ratio")?);
            Outcome::exact(inputs.number("youngs_modulus_pa")? / two)
        }
        "beam_tip_up_mm" => Outcome::exact(models::beam_tip_mm(inputs)?),
        "beam_tip_down_mm" => Outcome::exact(-models::beam_tip_mm(inputs)?),
        "bonded_tip_mm" => Outcome::exact(models::bonded_tip_mm(inputs)?),
        "stair_voltage" => Outcome::exact(models::stair_voltage(inputs)?),
        "table3" => Outcome::exact(models::stair_at(inputs)?),
        "plant_gain" => Outcome::exact(models::plant_gain(inputs)?),
        "time_to" => Outcome::exact(models::time_to(inputs.word("controller")?, inputs)?),
        "settled_after" => Outcome::exact(models::settled_after_s(inputs.number("part")?)),
        "part_after" => Outcome::exact(models::part_after_percent(inputs)?),
        "time_saved_percent" => {
            Outcome::exact(1e2 * (1.0 - models::time_to("with", inputs)? / models::time_to("without", inputs)?))
        }
        "table1_slope" => readings::slope(inputs)?,
        "table1_reading" => readings::table1(inputs)?,
        "tip_by_table1_mm" => readings::tip_by_table1_mm(inputs)?,
        "table3_reading" => readings::table3(inputs)?,
        "largest_fem_error_percent" => readings::largest_fem_error_percent()?,
        other => bail!("no computation is called `{other}`"),
    })
}
