//! One instance of a unit: what may be called when, the time, messages, saved states.

use std::fmt;

use anyhow::Result;
use simulation::bad_input;
use simulation::bad_input::number;

use crate::machine::Machine;
use crate::status::{Status, WARNING};
use crate::unit::Unit;
use crate::variable::{Form, Role, Variable};
use crate::variables::variables;

/// Largest distance of a time from a tick, in ticks: importers add up steps, whose rounding errors add up too. To it comes the distance
/// between two doubles at that time, which in s since 1970 at 10 kHz is larger.
const TOLERANCE: f64 = 1e-3;
/// Largest distance in ticks where doubles lie further apart, so that a time is near one tick only.
const MOST_TOLERANCE: f64 = 0.25;
/// Most ticks of one step.
const MOST_TICKS: f64 = 1e10;

/// Receives a message, and the status that it explains: an error, or a warning that is a remark.
pub(crate) type Log = Box<dyn Fn(Status, &str)>;

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
    phase: Phase,
}

/// The phases of an instance, in their order; what an importer may call follows from them.
#[derive(Clone, Debug)]
enum Phase {
    Instantiated,
    Initializing,
    Stepping { machine: Box<Machine>, ticks: u64 },
    Terminated,
}

impl fmt::Display for Phase {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(match self {
            Self::Instantiated => "before the initialization",
            Self::Initializing => "in the initialization",
            Self::Stepping { .. } => "in the middle of a simulation",
            Self::Terminated => "after the end of the simulation",
        })
    }
}

impl Instance {
    pub(crate) fn new(unit: Unit, log: Log) -> Self {
        let variables = variables(&unit);
        let state = State::new(&variables);
        Self { unit, variables, state, log }
    }

    /// Hands a message to the importer.
    pub(crate) fn log(&self, status: Status, message: &str) {
        (self.log)(status, message);
    }

    /// Sets the time at which the simulation begins, in s.
    pub(crate) fn begin_at(&mut self, start_s: f64) -> Result<()> {
        let Phase::Instantiated = self.state.phase else {
            bad_input!("the start time is set {}: expected before the initialization", self.state.phase);
        };
        if !start_s.is_finite() {
            bad_input!("startTime = {}: expected a finite number of seconds", number(start_s));
        }
        self.state.start_s = start_s;
        self.state.values[0] = start_s;
        Ok(())
    }

    /// Begins the initialization.
    pub(crate) fn enter_initialization(&mut self) -> Result<()> {
        let Phase::Instantiated = self.state.phase else {
            bad_input!("the initialization begins {}: expected once, or again after a reset", self.state.phase);
        };
        self.state.phase = Phase::Initializing;
        Ok(())
    }

    /// Ends the initialization: the parameters are checked, spring and controller are at rest at 0 V. A parameter without effect is a
    /// remark.
    pub(crate) fn exit_initialization(&mut self) -> Result<()> {
        let Phase::Initializing = self.state.phase else {
            bad_input!("the initialization ends {}: expected in the initialization", self.state.phase);
        };
        let (machine, remark) = Machine::new(&self.unit, &self.variables, &self.state.values)?;
        machine.rest(&self.variables, &mut self.state.values);
        self.state.phase = Phase::Stepping { machine: Box::new(machine), ticks: 0 };
        if let Some(remark) = remark {
            self.log(WARNING, &remark);
        }
        Ok(())
    }

    /// Ends the simulation; outputs can still be read.
    pub(crate) fn terminate(&mut self) {
        self.state.phase = Phase::Terminated;
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
            role if role.is_parameter() => {
                let (Phase::Instantiated | Phase::Initializing) = self.state.phase else {
                    bad_input!("{name} is set {}: expected before the end of the initialization", self.state.phase);
                };
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
        let State { values, start_s, phase } = &mut self.state;
        let Phase::Stepping { machine, ticks } = phase else {
            bad_input!("a step {phase}: expected between the initialization and the end of the simulation");
        };
        let rate_hz = machine.rate_hz();
        let (now, end) = ((from_s - *start_s) * rate_hz, (from_s + step_s - *start_s) * rate_hz);
        let time_s = |ticks: u64| *start_s + ticks as f64 / rate_hz;
        // NaN is near nothing.
        let is_near = |time_s: f64, time: f64, tick: f64| {
            let spacing_s = time_s.abs().next_up() - time_s.abs();
            (time - tick).abs() <= (TOLERANCE + spacing_s * rate_hz).min(MOST_TOLERANCE)
        };
        if !is_near(from_s, now, *ticks as f64) {
            bad_input!(
                "a step begins at {} s: expected {} s, where the last one has ended",
                number(from_s),
                number(time_s(*ticks))
            );
        }
        let last = end.round();
        if !is_near(from_s + step_s, end, last) || last <= *ticks as f64 {
            bad_input!(
                "a step of {} s is {} ticks: expected a whole number of ticks of {} s",
                number(step_s),
                number(step_s * rate_hz),
                number(1.0 / rate_hz)
            );
        }
        if last - *ticks as f64 > MOST_TICKS {
            bad_input!(
                "a step of {} s is {} ticks: expected at most {MOST_TICKS:e}",
                number(step_s),
                number(step_s * rate_hz)
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
        Self {
            values: variables.iter().map(|variable| variable.start).collect(),
            start_s: 0.0,
            phase: Phase::Instantiated,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;
    use crate::unit::Kind;
    use simulation::control_loop::{Controller, Options};
    use simulation::plant_file;

    #[test]
    fn outputs_after_the_initialization_follow_the_parameters() {
        let plant = plant_file::parse("plant.toml", include_str!("../../docs/plant.toml")).expect("the example");
        let mut instance = instance(plant);
        let place = |name: &str| variables(&instance.unit).iter().position(|it| it.name == name).expect("it exists");
        let (zero, reading) = (place("spring.reading.zero") as u32, place("reading") as u32);
        instance.set(zero, &[Form::Real], 12.5).expect("a parameter");
        instance.enter_initialization().expect("an instance");
        instance.exit_initialization().expect("parameters in their ranges");
        assert_eq!(instance.get(reading, &[Form::Real]).expect("an output"), 12.5);
    }

    /// The unit alone would fall back; a parameter of the importer leaves it without effect.
    #[test]
    fn a_fall_back_that_has_no_effect_is_a_remark() {
        for (kind, known_share, expected) in [
            (Kind::Both, 0.05, true),
            (Kind::Controller, 0.05, true),
            (Kind::Both, 0.0, false),
            (Kind::Spring, 0.05, false),
        ] {
            let margin = model::Margin { share: 0.0, fall_back: 0.125, ..model::Margin::TYPICAL };
            let options = Options { controller: Controller::Robust, margin: Some(margin), ..Options::PAPER };
            let plant = plant_file::load("paper").expect("it is built in");
            let messages = Rc::new(RefCell::new(Vec::new()));
            let log = Rc::clone(&messages);
            let log = Box::new(move |status, message: &str| log.borrow_mut().push((status, message.to_owned())));
            let mut instance = Instance::new(Unit { kind, plant, options }, log);
            if let Some(share) = instance.variables.iter().position(|variable| variable.name == "known_share") {
                instance.set(share as u32, &[Form::Real], known_share).expect("a parameter");
            }
            instance.enter_initialization().expect("an instance");
            assert!(messages.borrow().is_empty(), "{messages:?}");
            instance.exit_initialization().expect("parameters in their ranges");
            let messages = messages.borrow();
            let is_remark = |(status, text): &(Status, String)| {
                *status == WARNING
                    && text.starts_with("a fall back by 12.5 % has no effect within these errors: it helps where")
            };
            assert_eq!(messages.len(), usize::from(expected), "{kind:?} {known_share}: {messages:?}");
            assert!(messages.iter().all(is_remark), "{messages:?}");
        }
    }

    #[test]
    fn calls_out_of_their_order_are_refused_and_change_nothing() {
        let mut instance = instance(plant_file::load("paper").expect("it is built in"));
        let refused = |result: Result<()>, what: &str| {
            let error = result.expect_err(what).to_string();
            assert!(error.contains(what) && error.contains("expected"), "{error}");
        };
        refused(instance.step(0.0, 0.001), "a step before the initialization");
        refused(instance.exit_initialization(), "ends before the initialization");
        // FMI 2.0 has the importer set up at least once.
        instance.begin_at(3.0).expect("an instance");
        instance.begin_at(5.0).expect("an instance");
        instance.enter_initialization().expect("an instance");
        refused(instance.begin_at(0.0), "is set in the initialization");
        refused(instance.enter_initialization(), "begins in the initialization");
        instance.exit_initialization().expect("parameters in their ranges");
        refused(instance.step(5.0, 1e300), "expected at most 1e10");
        instance.step(5.0, 0.002).expect("two ticks");
        for _ in 0..2 {
            refused(instance.begin_at(0.0), "is set in the middle of a simulation");
            refused(instance.exit_initialization(), "ends in the middle of a simulation");
        }
        let saved = instance.save();
        instance.step(5.002, 0.001).expect("the clock goes on");
        instance.terminate();
        refused(instance.step(5.003, 0.001), "a step after the end");
        instance.restore(&saved);
        instance.step(5.002, 0.001).expect("the saved state");
        instance.reset();
        instance.begin_at(0.0).expect("an instance as at first");
    }

    #[test]
    fn steps_at_a_time_since_1970_are_whole_ticks_as_far_as_doubles_go() {
        let step_s = 1e-4;
        for (start_s, is_fine) in [(0.0, true), (1.7e9, true), (-1.7e9, true), (1e13, false)] {
            let options = Options { rate_hz: 1.0 / step_s, ..Options::PAPER };
            let plant = plant_file::load("paper").expect("it is built in");
            let mut instance = Instance::new(Unit { kind: Kind::Spring, plant, options }, Box::new(|_, _| ()));
            instance.begin_at(start_s).expect("an instance");
            instance.enter_initialization().expect("an instance");
            instance.exit_initialization().expect("parameters in their ranges");
            let times = (0..10_000).map(|number| start_s + f64::from(number) * step_s);
            let found = times.into_iter().try_for_each(|time_s| instance.step(time_s, step_s));
            assert_eq!(found.is_ok(), is_fine, "{start_s}: {found:?}");
            let half = instance.step(instance.time_s(), 0.5 * step_s).expect_err("half a tick").to_string();
            assert!(half.contains("expected"), "{half}");
        }
    }

    fn instance(plant: plant_file::PlantFile) -> Instance {
        Instance::new(Unit { kind: Kind::Spring, plant, options: Options::PAPER }, Box::new(|_, _| ()))
    }
}
