//! `vsj link PORT model`: which model of the spring the MCU runs, or a new one for it.

use anyhow::{Context, Result};
use clap::Args;
use host_sim::link::Failure;
use host_sim::output::terminal::{json, print, remark};
use link::{Controller, Reason, WireModel};
use simulation::bad_input;

use super::session::Session;
use super::settings::remark_on_margin;
use crate::commands::plant;

/// A spring whose stiffness is below this, in V, counts as settled at 0 V.
const SETTLED_V: f64 = 1.0;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// A plant file, such as `vsj diagnose --out` writes, at most 1 MiB, or `paper`
    #[arg(value_name = "FILE.toml|paper")]
    plant: Option<String>,
}

impl Arguments {
    /// Reads the model to be sent; `None` without a plant file.
    pub(super) fn read(&self) -> Result<Option<WireModel>> {
        self.plant.as_deref().map(|plant| plant::wire(plant).map(|(model, _)| model)).transpose()
    }
}

pub(super) fn run(session: &mut Session, arguments: &Arguments, model: Option<&WireModel>) -> Result<()> {
    let answer = match model {
        None => session.client.models(),
        Some(model) => session.client.install(model),
    };
    let name = session.client.name().to_owned();
    let models = match answer {
        Err(Failure::Refused(reason @ Reason::BadModel { .. })) => {
            bad_input!("{}: {reason}", arguments.plant.as_deref().unwrap_or_default())
        }
        answer => answer.with_context(|| name.clone())?,
    };
    let estimate_v = session.status.sample.estimate.to_f64();
    if let Some(wait_s) = model.and_then(|model| unsettled_s(estimate_v, model)) {
        remark(&format!(
            "{name}: the estimated stiffness is still {estimate_v:.0} V, but the MCU has restarted and takes it to be at rest; \
             leave it disarmed for {wait_s:.0} s"
        ));
    }
    // The model is stored and runs: what follows is no failure.
    if let Some(model) = model
        && session.status.firmware.controller == Controller::Robust
        && let Ok(settings) = session.client.read_settings(false)
    {
        remark_on_margin(&name, &settings, Some(model.plant()));
    }
    let text = format!("runs    {}\nstored  {}\n", models.active, models.stored);
    print(&if session.json { json(&models)? } else { text })
}

/// Time in s that the slowest relaxation needs to settle at 0 V; `None` if it has settled.
fn unsettled_s(estimate_v: f64, model: &WireModel) -> Option<f64> {
    let leak_s = model.leakage.map(|(_, time_constant_s)| time_constant_s);
    let all_s = model.time_constants_s.iter().copied().chain(model.time_constant_high_s).chain(leak_s);
    let distance = estimate_v.abs() / SETTLED_V;
    (distance > 1.0).then(|| all_s.fold(0.0, f64::max) * distance.ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{ExtendedPlant, extended::Relaxation};

    #[test]
    fn a_spring_that_was_let_go_takes_its_slowest_time_constant_for_each_neper() {
        let relaxation =
            Relaxation { share: 0.1, time_constants_s: &[0.5, 5.5], weights: &[0.5, 0.4], time_constant_high_s: None };
        let plant = ExtendedPlant { memory: None, law: None, leakage: None, relaxation };
        let model = WireModel::new(&plant, None, None).unwrap();
        let wait_s = unsettled_s(-450.0, &model).unwrap();
        assert!((450.0 * (-wait_s / 5.5).exp() - 1.0).abs() < 1e-9, "{wait_s}");
        assert_eq!(unsettled_s(0.9, &model), None);
    }
}
