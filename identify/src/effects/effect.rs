//! What an effect is: a physical block along the chain from command to reading.
//!
//! ```text
//! command -> amplifier -> static law and memory -> relaxation -> response -> reading
//! ```
//!
//! An effect acts at one place of the chain (it overrides one of the hooks below), by parameters that a fit may move. It
//! may come in several *forms*: the same cause, another law. A new effect is one file in `effects/` and its line there.

use crate::plant::chain::Chain;
use crate::plant::initial_state::InitialState;
use crate::record::data::Data;
use crate::record::signal::Signal;

/// Where in the chain an effect acts. Two effects of one stage are harder to tell apart than two of different stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Location {
    /// Between the command and the spring's electrodes.
    Amplifier,
    /// Static law and memory.
    Static,
    /// How the stiffness follows in time.
    Relaxation,
    /// How it is read.
    Reading,
}

/// What of a run an effect changes. Runs that differ in later things alone share the earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Affects {
    /// By [`Effect::modify_chain`], up to the amplifier's output.
    Amplifier,
    /// By [`Effect::modify_chain`], up to where the stiffness would settle.
    StaticResponse,
    /// By [`Effect::modify_chain`], behind it.
    Relaxation,
    /// By [`Effect::modify_response`] alone.
    Response,
    /// By [`Effect::modify_readings`] alone.
    Readings,
}

/// A number that the fit moves. Coordinates are chosen so that a fit is well behaved: logarithms where only size counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    /// Smallest value allowed.
    pub lowest: f64,
    /// Largest value allowed.
    pub highest: f64,
    /// False for what a fit cannot move.
    pub fitted: bool,
}

impl Coordinate {
    /// One that the fit moves between two bounds.
    pub fn new(lowest: f64, highest: f64) -> Self {
        Self { lowest, highest, fitted: true }
    }

    /// The logarithm of a quantity between two bounds.
    pub fn log(lowest: f64, highest: f64) -> Self {
        Self::new(lowest.ln(), highest.ln())
    }

    /// One that stays where a start has put it.
    pub fn fixed(lowest: f64, highest: f64) -> Self {
        Self { fitted: false, ..Self::new(lowest, highest) }
    }
}

/// A parameter as the user reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Its name in the report.
    pub name: String,
    /// SI unit, or "" for a ratio.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
}

impl Quantity {
    /// A named value.
    pub fn new(name: impl Into<String>, unit: &'static str, value: f64) -> Self {
        Self { name: name.into(), unit, value }
    }
}

/// What a search for starting points sees.
pub struct FitContext<'a> {
    /// The record.
    pub data: &'a Data,
    /// What the model without the effect leaves, in V; NaN in rows that [`Effect::refine_searched`] must not look at.
    pub residual: &'a [f64],
    /// The noise's scale, in V.
    pub sigma: f64,
}

/// A cause, as a block of the chain.
pub trait Effect: Sync {
    /// Its name in reports.
    fn cause(&self) -> &'static str;

    /// Where it acts.
    fn location(&self) -> Location;

    /// What of a run it changes.
    fn affects(&self) -> Affects {
        match self.location() {
            Location::Amplifier => Affects::Amplifier,
            Location::Static => Affects::StaticResponse,
            Location::Relaxation | Location::Reading => Affects::Relaxation,
        }
    }

    /// What it does, in words that follow "because".
    fn description(&self) -> &'static str;

    /// The experiment that shows it and nothing else, in words that follow "run".
    fn isolating_experiment(&self) -> &'static str;

    /// Number of forms that it comes in.
    fn forms(&self) -> usize {
        1
    }

    /// The coordinates of a form.
    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate>;

    /// Points from which a fit may find it, for a form.
    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>>;

    /// The user's parameters at a point.
    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity>;

    /// True if some coordinates of a form are found by [`Effect::refine_searched`] alone and not by the fit.
    fn searched(&self, _form: usize) -> bool {
        false
    }

    /// Causes that contain this one: with one of them in the model, it has nothing to add.
    fn special_case_of(&self) -> &'static [&'static str] {
        &[]
    }

    /// How many places a search for a form looks at, as a natural logarithm: what a find by chance is discounted by.
    fn ln_candidates(&self, _form: usize, _data: &Data) -> f64 {
        0.0
    }

    /// Moves the searched coordinates to where `residual`, which is without the effect, wants them.
    fn refine_searched(&self, _form: usize, _point: &mut [f64], _scene: &FitContext) {}

    /// Of a point between two bounds at which the prediction jumps, one that many `steps` beyond, or before them if negative.
    fn across_jumps(&self, _form: usize, _point: &[f64], _steps: f64, _data: &Data) -> Option<Vec<f64>> {
        None
    }

    /// Lowest and highest of the user's parameters that a search alone has found; others are left to the fit.
    fn searched_range(&self, _form: usize, _point: &[f64], _scene: &FitContext) -> Vec<(String, f64, f64)> {
        Vec::new()
    }

    /// Changes the chain, as far as a plant file can say it.
    fn modify_chain<'a>(&self, _form: usize, _point: &'a [f64], _data: &'a Data, _chain: &mut Chain<'a>) {}

    /// What no table of a plant file holds of it, for the whole chain that it is in: a table of its own, or a remark.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, _chain: &Chain) -> Option<toml::Value> {
        Some(table(self, form, point, data))
    }

    /// Acts on the stiffness, in V; its states ask where they start.
    fn modify_response(&self, _form: usize, _point: &[f64], _signal: &mut Signal, _start: &mut InitialState) {}

    /// Acts on the readings at each row, in V.
    fn modify_readings(&self, _form: usize, _point: &[f64], _data: &Data, _readings: &mut [f64]) {}
}

/// Logarithms of a range, so many, evenly from one end to the other.
pub fn logarithms((from, to): (f64, f64), count: u32) -> impl Iterator<Item = f64> {
    let (from, to) = (from.ln(), to.ln());
    (0..count).map(move |part| from + (to - from) * f64::from(part) / f64::from(count - 1))
}

/// The user's parameters, as a plant file keeps what it does not model.
pub fn table<E: Effect + ?Sized>(effect: &E, form: usize, point: &[f64], data: &Data) -> toml::Value {
    let quantities = effect.quantities(form, point, data).into_iter();
    toml::Value::Table(quantities.map(|quantity| (quantity.name, quantity.value.into())).collect())
}
