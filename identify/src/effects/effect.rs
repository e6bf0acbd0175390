//! The interface of an effect: a physical cause, as a block of the chain from command to reading.
//!
//! ```text
//! command -> amplifier -> static law and hysteresis -> relaxation -> response -> reading
//! ```
//!
//! An effect acts at one location of the chain by overriding one of the `modify_` functions, with parameters that a fit
//! moves. It may have several *forms*: different laws of the same cause. A new effect is one file in `effects/` and one
//! line in the catalogue.

use crate::dimension::Dimension;
use crate::plant::chain::Chain;
use crate::plant::initial_state::InitialState;
use crate::plant::visited::Axis;
use crate::record::data::Data;
use crate::record::signal::Signal;

/// Location of an effect in the chain; two effects at the same location are harder to isolate than two at different
/// ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Location {
    /// Between the command and the spring's electrodes.
    Amplifier,
    /// Between the electrodes and the settled stiffness: static law and hysteresis.
    Static,
    /// Between the settled stiffness and the stiffness, over time.
    Relaxation,
    /// Between the stiffness and the reading.
    Reading,
}

/// The first intermediate result of a simulation that an effect changes; simulations that differ only in later ones
/// share the earlier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Affects {
    /// The voltage on the electrodes, by [`Effect::modify_chain`].
    Amplifier,
    /// The settled stiffness, by [`Effect::modify_chain`].
    StaticResponse,
    /// The stiffness, by [`Effect::modify_chain`].
    Relaxation,
    /// The stiffness, by [`Effect::modify_response`] alone.
    Response,
    /// The readings, by [`Effect::modify_readings`] alone.
    Readings,
}

/// Bounds of a number that a fit moves; the number is the logarithm of a quantity where that makes the fit better
/// conditioned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    /// Smallest value.
    pub lowest: f64,
    /// Largest value.
    pub highest: f64,
    /// True if the fit moves it, false if it keeps its initial value.
    pub fitted: bool,
}

impl Coordinate {
    /// Returns a coordinate that the fit moves between two bounds.
    pub fn new(lowest: f64, highest: f64) -> Self {
        Self { lowest, highest, fitted: true }
    }

    /// Returns a coordinate that the fit moves between two bounds in any order.
    pub fn between(one: f64, other: f64) -> Self {
        Self::new(one.min(other), one.max(other))
    }

    /// Returns the logarithm of a quantity between two positive bounds.
    pub fn log(lowest: f64, highest: f64) -> Self {
        Self::new(lowest.ln(), highest.ln())
    }

    /// Returns a coordinate that keeps its value in a fit.
    pub fn fixed(lowest: f64, highest: f64) -> Self {
        Self { fitted: false, ..Self::new(lowest, highest) }
    }
}

/// A parameter as it is reported.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Name in the report.
    pub name: String,
    /// Dimension, which decides the unit.
    pub dimension: Dimension,
    /// Value, normalised.
    pub value: f64,
    /// Place on a curve of which it is the value; `None` if it is not one.
    pub place: Option<Place>,
}

/// Place on a curve of the spring, which a record shows only where the spring has been.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Axis of the curve.
    pub axis: Axis,
    /// Place on that axis, in V.
    pub at_v: f64,
    /// True if the parameter is omitted where the record has not been, false if it is reported as extrapolated.
    pub omitted: bool,
}

impl Quantity {
    /// Returns a named value.
    pub fn new(name: impl Into<String>, dimension: Dimension, value: f64) -> Self {
        Self { name: name.into(), dimension, value, place: None }
    }

    /// Returns the same as the value of a curve, reported only where the record has been.
    pub fn point_of_curve(self, axis: Axis, at_v: f64) -> Self {
        Self { place: Some(Place { axis, at_v, omitted: true }), ..self }
    }

    /// Returns the same as the value of a curve, reported as extrapolated where the record has not been.
    pub fn end_of_curve(self, axis: Axis, at_v: f64) -> Self {
        Self { place: Some(Place { axis, at_v, omitted: false }), ..self }
    }
}

/// What initial points and searches are derived from.
pub struct FitContext<'a> {
    /// The record.
    pub data: &'a Data,
    /// Residual of the model without the effect, in V; NaN in rows that [`Effect::refine_searched`] must not use.
    pub residual: &'a [f64],
    /// Scale of the noise, in V.
    pub sigma: f64,
}

/// A cause of a difference between simulation and readings.
pub trait Effect: Sync {
    /// Returns the name of the cause in reports.
    fn cause(&self) -> &'static str;

    /// Returns the location in the chain.
    fn location(&self) -> Location;

    /// Returns the first intermediate result of a simulation that a form of the effect changes.
    fn affects(&self, _form: usize) -> Affects {
        match self.location() {
            Location::Amplifier => Affects::Amplifier,
            Location::Static => Affects::StaticResponse,
            Location::Relaxation | Location::Reading => Affects::Relaxation,
        }
    }

    /// Returns the stage of the chain that the effect changes at a point, as far as the record can tell: where its own stage responds too
    /// slowly or too quickly to be seen, it changes the static response.
    fn location_at(&self, _form: usize, _point: &[f64], _data: &Data) -> Location {
        self.location()
    }

    /// Returns what the effect does, as a clause that can follow "because".
    fn description(&self) -> &'static str;

    /// Returns the experiment that isolates the effect, as a clause that can follow "run".
    fn isolating_experiment(&self) -> &'static str;

    /// Returns the number of forms.
    fn forms(&self) -> usize {
        1
    }

    /// Returns the number of forms, from the first, that every search tries; the others are tried where these leave structure.
    fn common_forms(&self) -> usize {
        self.forms()
    }

    /// Returns the coordinates of a form.
    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate>;

    /// Returns the initial points for fits of a form.
    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>>;

    /// Returns the reported parameters at a point.
    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity>;

    /// Returns true if [`Effect::refine_searched`] finds some coordinates of a form, which the fit does not move.
    fn searched(&self, _form: usize) -> bool {
        false
    }

    /// Returns the causes of which this one is a special case; in a model with one of them it is redundant.
    fn special_case_of(&self) -> &'static [&'static str] {
        &[]
    }

    /// Returns true at a point where the effect cannot be distinguished from another cause, whose name it must not take, in readings with
    /// noise of the scale `sigma_v`.
    fn is_another_cause(&self, _form: usize, _point: &[f64], _data: &Data, _sigma_v: f64) -> bool {
        false
    }

    /// Returns the first of the last rows if the effect changes those alone; `None` elsewhere.
    fn first_of_last_rows(&self, _form: usize, _point: &[f64], _data: &Data) -> Option<usize> {
        None
    }

    /// Returns the form and the point at which the effect alone responds as it does at a point together with a gain; `None` if no form
    /// includes a gain.
    fn with_gain(&self, _form: usize, _point: &[f64], _gain: f64, _data: &Data) -> Option<(usize, Vec<f64>)> {
        None
    }

    /// Returns the cause that is a special case of a form of the effect, with the form of that cause and its point nearest to a point;
    /// `None` if it has no special case.
    fn nearest_special_case(
        &self,
        _form: usize,
        _point: &[f64],
        _data: &Data,
    ) -> Option<(&'static str, usize, Vec<f64>)> {
        None
    }

    /// Returns the logarithm of the number of independent candidates that a search for a form compares; the likelihood
    /// gain is reduced by this, in nats.
    fn ln_candidates(&self, _form: usize, _data: &Data) -> f64 {
        0.0
    }

    /// Moves the searched coordinates to their most likely place, given the residual of the model without the effect.
    fn refine_searched(&self, _form: usize, _point: &mut [f64], _scene: &FitContext) {}

    /// Returns the point across `steps` discontinuities of the prediction, backwards if negative; `None` if there is no
    /// such point.
    fn across_jumps(&self, _form: usize, _point: &[f64], _steps: f64, _data: &Data) -> Option<Vec<f64>> {
        None
    }

    /// Returns names and bounds of the reported parameters that only a search finds; the fit bounds the others.
    fn searched_range(&self, _form: usize, _point: &[f64], _scene: &FitContext) -> Vec<(String, f64, f64)> {
        Vec::new()
    }

    /// Applies the effect to the chain, as far as a plant file can represent it.
    fn modify_chain<'a>(&self, _form: usize, _point: &'a [f64], _data: &'a Data, _chain: &mut Chain<'a>) {}

    /// Returns what a plant file cannot represent of the effect, given the whole chain: its parameters as a table, or a
    /// remark; `None` if nothing is lost.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, _chain: &Chain) -> Option<toml::Value> {
        Some(table(self, form, point, data))
    }

    /// Applies the effect to the stiffness, in V; every state takes its initial offset from `start`.
    fn modify_response(&self, _form: usize, _point: &[f64], _signal: &mut Signal, _start: &mut InitialState) {}

    /// Applies the effect to the reading of each row, in V.
    fn modify_readings(&self, _form: usize, _point: &[f64], _data: &Data, _readings: &mut [f64]) {}
}

/// Returns `count` logarithms from the first to the second number, equally spaced.
pub fn logarithms((from, to): (f64, f64), count: u32) -> impl Iterator<Item = f64> {
    let (from, to) = (from.ln(), to.ln());
    (0..count).map(move |part| from + (to - from) * f64::from(part) / f64::from(count - 1))
}

/// Returns the reported parameters as a table of a plant file, in the file's units.
pub fn table<E: Effect + ?Sized>(effect: &E, form: usize, point: &[f64], data: &Data) -> toml::Value {
    let quantities = effect.quantities(form, point, data).into_iter();
    let restored = |Quantity { name, dimension, value, .. }| (name, data.scales().restored(dimension, value).into());
    toml::Value::Table(quantities.map(restored).collect())
}
