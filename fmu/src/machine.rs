//! The parts of a unit in motion: values of the variables in, ticks, values of the outputs out.

use anyhow::{Context, Result};
use model::{Input, Output as Tick, ScaledStiffness, Volts};
use simulation::bad_input;
use simulation::bad_input::BadInput;
use simulation::control_loop::{ControlLoop, Controller, SpringAlone};
use simulation::has_reference::remark_on_fall_back;
use simulation::plant_file::{PlantFile, Reading};

use crate::unit::Unit;
use crate::variable::{Output, Role, Variable};
use crate::variables::variables;

/// Controller and spring of an instance, with their states.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    control: Option<ControlLoop>,
    spring: Option<SpringAlone>,
    reading: Reading,
    rate_hz: f64,
}

impl Unit {
    /// Checks that the tick can run the unit with its start values.
    ///
    /// # Errors
    /// [`BadInput`] with the first value out of its range, and the range.
    pub fn check(&self) -> Result<()> {
        let variables = variables(self);
        let values: Vec<f64> = variables.iter().map(|variable| variable.start).collect();
        Machine::new(self, &variables, &values).map(drop)
    }
}

impl Machine {
    /// The parts at rest at 0 V, and what the user should know about the parameters.
    ///
    /// # Errors
    /// [`BadInput`] with the first parameter out of its range, and the range.
    pub(crate) fn new(unit: &Unit, variables: &[Variable], values: &[f64]) -> Result<(Self, Option<String>)> {
        let mut options = unit.options;
        let (mut model, mut spring) = (unit.plant.clone(), unit.plant.clone());
        for (variable, &value) in variables.iter().zip(values) {
            let place = match variable.role {
                Role::Setting(setting) => {
                    setting.put(&mut options, value);
                    continue;
                }
                Role::Model(number) => number.place(&mut model),
                Role::Spring(number) => number.place(&mut spring),
                Role::Time | Role::Input | Role::Output(_) => continue,
            };
            *place.with_context(|| format!("{}: the plant file has none", variable.name))? = value;
        }
        if options.controller != Controller::Fast {
            options.approach_s = None;
        }
        if options.controller != Controller::Robust {
            options.margin = None;
        }
        let (mut control, mut remark) = (None, None);
        if unit.kind.has_controller() {
            check("model", &model)?;
            control = Some(ControlLoop::new(&model, &options)?);
            remark = options.margin.and_then(|margin| remark_on_fall_back(model.extended(), &margin));
        }
        let alone = match unit.kind.has_spring() {
            false => None,
            true => {
                check("spring", &spring)?;
                Some(SpringAlone::new(&spring, options.rate_hz)?)
            }
        };
        let reading = spring.reading.unwrap_or_default();
        Ok((Self { control, spring: alone, reading, rate_hz: options.rate_hz }, remark))
    }

    /// Ticks per second, in Hz.
    pub(crate) const fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Runs `ticks` ticks, at least one, with `input` held; puts the outputs of the last one into their places in `values`.
    ///
    /// # Errors
    /// [`BadInput`] for an input that is no voltage within +-2000 V.
    pub(crate) fn run(&mut self, ticks: u64, variables: &[Variable], values: &mut [f64]) -> Result<()> {
        let Some((name, input)) = variables.iter().zip(&*values).find(|(variable, _)| variable.role == Role::Input)
        else {
            bad_input!("the unit has no input");
        };
        let input = Volts::new(*input).map_err(|error| BadInput(format!("{}: {error}", name.name)))?;
        let (mut stiffness, mut last) = (ScaledStiffness::default(), None);
        let spring = &mut self.spring;
        let mut apply = |applied| {
            if let Some(spring) = spring {
                stiffness = spring.run(applied);
            }
        };
        match &mut self.control {
            None => (0..ticks).for_each(|_| apply(input)),
            Some(control) => {
                let inputs = (0..ticks).map(|_| Input { target: input, ..Input::default() });
                control.run(inputs, |output| {
                    apply(output.applied);
                    last = Some(output);
                });
            }
        }
        self.put_outputs(last.as_ref(), stiffness, variables, values);
        Ok(())
    }

    /// Puts the outputs of the parts at rest at 0 V into their places in `values`.
    pub(crate) fn rest(&self, variables: &[Variable], values: &mut [f64]) {
        self.put_outputs(None, ScaledStiffness::default(), variables, values);
    }

    fn put_outputs(&self, tick: Option<&Tick>, stiffness: ScaledStiffness, variables: &[Variable], values: &mut [f64]) {
        for (variable, value) in variables.iter().zip(values) {
            if let Role::Output(output) = variable.role {
                *value = self.output(output, tick, stiffness);
            }
        }
    }

    fn output(&self, output: Output, tick: Option<&Tick>, stiffness: ScaledStiffness) -> f64 {
        let of_tick = |value: fn(&Tick) -> f64| tick.map_or(0.0, value);
        match output {
            Output::Applied => of_tick(|tick| tick.applied.to_f64()),
            Output::Code => of_tick(|tick| f64::from(tick.code.0)),
            Output::Estimate => of_tick(|tick| tick.stiffness.to_f64()),
            Output::Limits => of_tick(|tick| f64::from(tick.limits.bits())),
            Output::Stiffness => stiffness.to_f64(),
            Output::Reading => self.reading.zero + self.reading.gain * stiffness.to_f64(),
        }
    }
}

/// Checks a spring whose numbers may have been set; `part` is in front of the field's name.
fn check(part: &str, plant: &PlantFile) -> Result<()> {
    plant.check().map_err(|error| BadInput(format!("{part}.{error}")).into())
}
