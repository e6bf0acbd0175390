//! One instance of a unit: what may be called when, the time, messages, saved states.

use anyhow::{Context, Result};
use simulation::bad_input;
use simulation::bad_input::number;

use crate::machine::Machine;
use crate::unit::Unit;
use crate::variable::{Form, Role, Variable};
use crate::variables::variables;

/// Largest distance of a time from a tick, in ticks: importers add up steps, whose rounding errors add up too.
const TOLERANCE: f64 = 1e-3;

/// Receives the message of an error.
pub(crate) type Log = Box<dyn Fn(&str)>;

/// An instance of a unit.
pub(crate) struct Instance {
    unit: Unit,
    variables: Vec<Variable>,
    state: State,
    log: Log,
}

/// All that changes in an instance.
#[derive(Clone, Debug)]
pub(crate) struct State {
    values: Vec<f64>,
    start_s: f64,
    /// `None` until the initialization is over.
    running: Option<Running>,
}

#[derive(Clone, Debug)]
struct Running {
    machine: Machine,
    ticks: u64,
}

impl Instance {
    pub(crate) fn new(unit: Unit, log: Log) -> Self {
        let variables = variables(&unit);
        let state = State::new(&variables);
        Self { unit, variables, state, log }
    }

    /// Hands a message to the importer.
    pub(crate) fn log(&self, message: &str) {
        (self.log)(message);
    }

    /// Sets the time at which the simulation begins, in s.
    pub(crate) fn begin_at(&mut self, start_s: f64) -> Result<()> {
        if !start_s.is_finite() {
            bad_input!("startTime = {}: expected a finite number of seconds", number(start_s));
        }
        self.state.start_s = start_s;
        self.state.values[0] = start_s;
        Ok(())
    }

    /// Ends the initialization: the parameters are checked, spring and controller are at rest at 0 V.
    pub(crate) fn initialize(&mut self) -> Result<()> {
        let machine = Machine::new(&self.unit, &self.variables, &self.state.values)?;
        machine.rest(&self.variables, &mut self.state.values);
        self.state.running = Some(Running { machine, ticks: 0 });
        Ok(())
    }

    /// Returns to what the instance was at first.
    pub(crate) fn reset(&mut self) {
        self.state = State::new(&self.variables);
    }

    /// A copy of all that changes.
    pub(crate) fn save(&self) -> State {
        self.state.clone()
    }

    /// Continues from a copy.
    pub(crate) fn restore(&mut self, state: &State) {
        self.state = state.clone();
    }

    /// The time, in s.
    pub(crate) fn time_s(&self) -> f64 {
        self.state.values[0]
    }

    /// The value of a variable of this form; an enumeration is an integer in FMI 2.0 and a type of its own in 3.0.
    pub(crate) fn get(&self, reference: u32, forms: &[Form]) -> Result<f64> {
        let index = self.index(reference, forms)?;
        Ok(self.state.values[index])
    }

    /// Sets an input, or before the end of the initialization a parameter.
    pub(crate) fn set(&mut self, reference: u32, forms: &[Form], value: f64) -> Result<()> {
        let index = self.index(reference, forms)?;
        let Variable { name, role, form, lowest, highest, .. } = &self.variables[index];
        match role {
            Role::Input => {}
            role if role.is_parameter() && self.state.running.is_none() => {}
            role if role.is_parameter() => {
                bad_input!(
                    "{name} is set in the middle of a simulation: expected before the end of the initialization"
                );
            }
            _ => bad_input!("{name} is set: expected an input or a parameter"),
        }
        // Others are checked when all are known: their ranges depend on one another.
        if *form != Form::Real {
            let (lowest, highest) = (lowest.unwrap_or(f64::MIN), highest.unwrap_or(f64::MAX));
            simulation::bad_input::check(name, value, lowest..=highest, "")?;
        }
        self.state.values[index] = value;
        Ok(())
    }

    fn index(&self, reference: u32, forms: &[Form]) -> Result<usize> {
        let index = reference as usize;
        match self.variables.get(index) {
            Some(variable) if forms.contains(&variable.form) => Ok(index),
            Some(variable) => bad_input!("{}: accessed as another type than {:?}", variable.name, variable.form),
            None => bad_input!("value reference {reference}: expected at most {}", self.variables.len() - 1),
        }
    }

    /// Runs the ticks from `from_s` until `step_s` later.
    pub(crate) fn step(&mut self, from_s: f64, step_s: f64) -> Result<()> {
        let State { values, start_s, running } = &mut self.state;
        let Running { machine, ticks } = running.as_mut().context("a step before the initialization has ended")?;
        let rate_hz = machine.rate_hz();
        let (now, end) = ((from_s - *start_s) * rate_hz, (from_s + step_s - *start_s) * rate_hz);
        let time_s = |ticks: u64| *start_s + ticks as f64 / rate_hz;
        // NaN is near nothing.
        let is_near = |time: f64, tick: f64| (time - tick).abs() <= TOLERANCE;
        if !is_near(now, *ticks as f64) {
            bad_input!(
                "a step begins at {} s: expected {} s, where the last one has ended",
                number(from_s),
                number(time_s(*ticks))
            );
        }
        let last = end.round();
        if !is_near(end, last) || last <= *ticks as f64 {
            bad_input!(
                "a step of {} s is {} ticks: expected a whole number of ticks of {} s",
                number(step_s),
                number(step_s * rate_hz),
                number(1.0 / rate_hz)
            );
        }
        let last = last as u64;
        machine.run(last - *ticks, &self.variables, values)?;
        *ticks = last;
        values[0] = from_s + step_s;
        Ok(())
    }
}

impl State {
    fn new(variables: &[Variable]) -> Self {
        Self { values: variables.iter().map(|variable| variable.start).collect(), start_s: 0.0, running: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Kind;
    use simulation::control_loop::Options;
    use simulation::plant_file;

    #[test]
    fn outputs_after_the_initialization_follow_the_parameters() {
        let plant = plant_file::parse("plant.toml", include_str!("../../docs/plant.toml")).expect("the example");
        let mut instance = Instance::new(Unit { kind: Kind::Spring, plant, options: Options::PAPER }, Box::new(|_| ()));
        let place = |name: &str| variables(&instance.unit).iter().position(|it| it.name == name).expect("it exists");
        let (zero, reading) = (place("spring.reading.zero") as u32, place("reading") as u32);
        instance.set(zero, &[Form::Real], 12.5).expect("a parameter");
        instance.initialize().expect("parameters in their ranges");
        assert_eq!(instance.get(reading, &[Form::Real]).expect("an output"), 12.5);
    }
}
