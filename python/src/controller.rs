//! The controller's tick on arrays, and the spring alone.

use anyhow::Result;
use identify::effects::model::Model;
use identify::fit::simulator::Simulator;
use identify::plant::base::Base;
use identify::record::data::Data;
use model::{Feedback, Input, Margin, OutOfRange, Output, Reading, ScaledStiffness, Volts};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use simulation::bad_input;
use simulation::bad_input::BadInput;
use simulation::control_loop::{self, ControlLoop, Options};
use simulation::experiment::MOST_TICKS;
use simulation::has_reference::remark_on_fall_back;
use simulation::open_loop;
use simulation::plant_file::{self, PlantFile};
use simulation::record::{Record, Row};

use crate::analysis::Plant;
use crate::error::exception;

/// The settings of a loop by the names of the command's options.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LoopOptions {
    controller: String,
    limit_v: f64,
    min_v: f64,
    slew_v_per_s: Option<f64>,
    dac_bits: u32,
    kp: Option<f64>,
    ki: Option<f64>,
    approach_s: Option<f64>,
    margin: Option<[f64; 5]>,
    rate_hz: f64,
    feedback: Option<Sensor>,
}

/// A stiffness sensor by the names of the fields of [`Feedback`].
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Sensor {
    noise_v: f64,
    model_uncertainty: f64,
    fastest_s: f64,
    interval_s: f64,
    oldest_s: f64,
    lowest_v: f64,
    highest_v: f64,
    fade_s: f64,
}

/// Loads a spring that the tick simulates.
fn load(plant: Plant) -> Result<PlantFile> {
    match plant {
        Plant::Named(name) => plant_file::load(&name),
        Plant::Text((name, text)) => plant_file::parse(&name, &text),
    }
}

/// What the ticks put out, one value per tick.
#[derive(Default)]
struct Samples {
    code: Vec<u16>,
    applied_v: Vec<f64>,
    stiffness: Vec<f64>,
    limits: Vec<u8>,
}

impl LoopOptions {
    /// The settings of a loop around a spring, and what the user should know about them, one line each.
    fn options(self, plant: &PlantFile) -> Result<(Options, Vec<String>)> {
        let feedback = self.feedback.map(|it| Feedback {
            noise_v: it.noise_v,
            model_uncertainty: it.model_uncertainty,
            fastest_s: it.fastest_s,
            interval_s: it.interval_s,
            oldest_s: it.oldest_s,
            lowest_v: it.lowest_v,
            highest_v: it.highest_v,
            fade_s: it.fade_s,
        });
        let controller = control_loop::Controller::by_name(&self.controller)?;
        let given = [self.kp, self.ki];
        let gains = control_loop::gains(given, controller, plant, self.rate_hz)?;
        let options = Options {
            controller,
            limit_v: self.limit_v,
            min_v: self.min_v,
            slew_v_per_s: self.slew_v_per_s,
            dac_bits: self.dac_bits,
            kp: gains.proportional,
            ki: gains.integral_per_s,
            approach_s: self.approach_s,
            margin: self.margin.and_then(Margin::from_values),
            rate_hz: self.rate_hz,
            feedback,
        };
        let mut remarks = control_loop::lowered(&gains, given);
        remarks.extend(options.margin.and_then(|margin| remark_on_fall_back(plant.extended(), &margin)));
        Ok((options, remarks))
    }
}

/// Runs one tick per target in V; a reading in V that is NaN is none. Checks all before the first tick.
fn run(control: &mut ControlLoop, targets: &[f64], readings: Option<&[f64]>) -> Result<Samples> {
    let at = |name: &str, tick: usize, error: OutOfRange| BadInput(format!("{name}[{tick}]: {error}"));
    if let Some(readings) = readings
        && readings.len() != targets.len()
    {
        bad_input!("readings: {} values; expected {}, one per target", readings.len(), targets.len());
    }
    if targets.len() as f64 > MOST_TICKS {
        bad_input!("targets: {} values; expected at most {MOST_TICKS} ticks in a run", targets.len());
    }
    let mut inputs = Vec::with_capacity(targets.len());
    for (tick, &target) in targets.iter().enumerate() {
        let target = Volts::new(target).map_err(|error| at("targets", tick, error))?;
        let measured = match readings.map(|readings| readings[tick]) {
            Some(reading) if !reading.is_nan() => {
                let reading = Volts::new(reading).map_err(|error| at("readings", tick, error))?;
                Reading::fresh(ScaledStiffness(reading.0))
            }
            _ => None,
        };
        inputs.push(Input { target, measured });
    }
    let mut samples = Samples {
        code: Vec::with_capacity(targets.len()),
        applied_v: Vec::with_capacity(targets.len()),
        stiffness: Vec::with_capacity(targets.len()),
        limits: Vec::with_capacity(targets.len()),
    };
    control.run(inputs.into_iter(), |Output { code, applied, stiffness, limits, .. }| {
        samples.code.push(code.0);
        samples.applied_v.push(applied.to_f64());
        samples.stiffness.push(stiffness.to_f64());
        samples.limits.push(limits.bits());
    });
    Ok(samples)
}

/// The controller: configuration and state of the tick.
#[pyclass(module = "vsj._vsj")]
pub(crate) struct Controller {
    inner: ControlLoop,
    has_sensor: bool,
    #[pyo3(get)]
    not_simulated: Vec<String>,
    #[pyo3(get)]
    remarks: Vec<String>,
}

/// Codes, applied voltages in V, stiffness in V, limits.
type Arrays<'py> =
    (Bound<'py, PyArray1<u16>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u8>>);

#[pymethods]
impl Controller {
    #[new]
    fn new(plant: Plant, options: LoopOptions) -> PyResult<Self> {
        let has_sensor = options.feedback.is_some();
        let load = || {
            let file = load(plant)?;
            let (options, remarks) = options.options(&file)?;
            Ok((ControlLoop::new(&file, &options)?, file.left_out(), remarks))
        };
        let (inner, not_simulated, remarks) = load().map_err(exception)?;
        Ok(Self { inner, has_sensor, not_simulated, remarks })
    }

    /// Another controller in the same state.
    fn copied(&self) -> Self {
        Self {
            inner: self.inner.clone(),
            has_sensor: self.has_sensor,
            not_simulated: self.not_simulated.clone(),
            remarks: self.remarks.clone(),
        }
    }

    /// Forgets everything: the spring is at rest at 0 V.
    fn reset(&mut self) {
        self.inner.reset();
    }

    /// The lowest and the highest voltage that is put out, in V.
    #[getter]
    fn range_v(&self) -> (f64, f64) {
        let (low, high) = self.inner.range();
        (low.to_f64(), high.to_f64())
    }

    /// One tick per target.
    #[pyo3(signature = (targets, readings=None))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        targets: PyReadonlyArray1<'py, f64>,
        readings: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Arrays<'py>> {
        if readings.is_some() && !self.has_sensor {
            return Err(exception(
                BadInput("readings: the controller has no sensor; expected feedback=".into()).into(),
            ));
        }
        let targets = targets.as_array().to_vec();
        let readings = readings.map(|readings| readings.as_array().to_vec());
        let inner = &mut self.inner;
        let samples = py.detach(|| run(inner, &targets, readings.as_deref())).map_err(exception)?;
        Ok((
            samples.code.into_pyarray(py),
            samples.applied_v.into_pyarray(py),
            samples.stiffness.into_pyarray(py),
            samples.limits.into_pyarray(py),
        ))
    }
}

/// The fixed-point spring without a controller: stiffness in V at the times in s, each just after the voltage in V was applied.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    plant: Plant,
    time_s: PyReadonlyArray1<'py, f64>,
    voltage_v: PyReadonlyArray1<'py, f64>,
    rate_hz: f64,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Vec<String>)> {
    let (time_s, voltage_v) = (time_s.as_array().to_vec(), voltage_v.as_array().to_vec());
    let simulated = py.detach(|| {
        if time_s.len() != voltage_v.len() {
            bad_input!("voltage: {} values; expected {}, one per time", voltage_v.len(), time_s.len());
        }
        let file = load(plant)?;
        let stiffness = open_loop::simulate(&file.extended(), rate_hz, &time_s, &voltage_v)?;
        Ok((stiffness, file.left_out()))
    });
    let (stiffness, left_out) = simulated.map_err(exception)?;
    Ok((stiffness.into_pyarray(py), left_out))
}

/// The readings of a spring at rest at 0 V before the first row, in double precision with all parts of its plant file.
#[pyfunction]
pub(crate) fn predict<'py>(
    py: Python<'py>,
    plant: Plant,
    time_s: PyReadonlyArray1<'py, f64>,
    voltage_v: PyReadonlyArray1<'py, f64>,
    input: String,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (time_s, voltage_v) = (time_s.as_array().to_vec(), voltage_v.as_array().to_vec());
    let readings = py.detach(|| {
        let file = match plant {
            Plant::Named(name) => plant_file::load_for_host(&name)?,
            Plant::Text((name, text)) => plant_file::parse_for_host(&name, &text)?,
        };
        check_course(&time_s, &voltage_v)?;
        let row = |line: usize| Row { line, time_s: time_s[line], voltage_v: voltage_v[line], measured: Some(0.0) };
        let record = Record { name: "X".into(), rows: (0..time_s.len()).map(row).collect() };
        let map = file.reading.unwrap_or_default();
        let base = Base::new(file)?;
        let data = Data::new(&record, input.parse()?);
        let mut readings = Vec::new();
        Simulator::new(&data, &base).run(&Model::default(), &mut readings);
        readings.iter_mut().for_each(|reading| *reading = map.zero + map.gain * *reading);
        Ok(readings)
    });
    Ok(readings.map_err(exception)?.into_pyarray(py))
}

/// Checks increasing, finite times and finite voltages.
fn check_course(time_s: &[f64], voltage_v: &[f64]) -> Result<()> {
    if time_s.is_empty() || time_s.len() != voltage_v.len() {
        bad_input!("X: {} times and {} voltages; expected as many, at least one", time_s.len(), voltage_v.len());
    }
    for (row, (time, voltage)) in time_s.iter().zip(voltage_v).enumerate() {
        if !(time.is_finite() && voltage.is_finite()) {
            bad_input!("X[{row}]: {time} s, {voltage} V; expected finite numbers");
        }
        if row > 0 && time_s[row - 1] >= *time {
            bad_input!("X[{row}]: {time} s follows {} s; expected increasing times", time_s[row - 1]);
        }
    }
    Ok(())
}
