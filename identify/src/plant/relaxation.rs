//! The relaxation: feedthrough and first-order lags between settled stiffness and stiffness.
//!
//! ```text
//! y = share q + (1 - share - sum part_i - sum weight_j) lag(tau(q); q) + sum part_i lag(tau_i; q) + sum oscillation_j
//! ```
//!
//! `q` is the settled stiffness. The paper's plant has a single lag with a constant `tau`. A variable `tau` depends on
//! the voltage across the spring, or on the spring's own state, in V as well: `lag + part (q - lag)`, which is the
//! output of the first lag for a part of 0 and the whole stiffness for a part of `share`.

use std::f64::consts::TAU;

use crate::plant::initial_state::InitialState;
use crate::record::scales::REFERENCE_VOLTAGE_V;
use crate::record::signal::{DECAYED, Lag, Oscillator, Piece, Signal, pass_lags};
use simulation::plant_file::{self, Mode, PlantFile};

/// A further lag and its weight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Part {
    /// Fraction of the settled stiffness, 0 to 1; 0 for none.
    pub part: f64,
    /// Time constant, in s.
    pub tau_s: f64,
}

/// Number of further lags that the fixed-point tick can hold.
pub const FURTHER: usize = 3;

/// Longest integration step where the lag's state sets its time constant, relative to the shortest time constant.
const STEP: f64 = 0.1;
/// Relative difference of two time constants in series that are closer to each other: equal ones have no partial fractions.
const CLOSE: f64 = 1e-7;
/// Largest weight of a partial fraction; a larger one, of three equal time constants, would amplify rounding errors.
const LARGEST_WEIGHT: f64 = 1e9;
/// Largest number of integration steps of one piece, after which the lag has settled.
const MOST_STEPS: f64 = 200.0;

/// Work of a step whose exponential is computed, relative to one whose exponential is known.
const EXPONENTIAL: f64 = 4.0;
/// Work of an integration step where the spring's state sets the time constant.
const STEP_BY_STATE: f64 = 16.0;
/// Work of one piece of an oscillation, in units of one lag.
const WORK_OF_MODE: f64 = 6.0;
/// Work of a piece of a free response, beside that of its lags and oscillations, in units of one lag.
const FREE_PIECE: f64 = 2.0;
/// Further work of a piece that is not as long as the one before it, through one of a bank of lags and through an oscillation.
const IRREGULAR_LAG: f64 = 1.0;
const IRREGULAR_MODE: f64 = 25.0;

/// Parameters of the relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// Feedthrough: fraction of the settled stiffness that is reached without delay.
    pub share: f64,
    /// Time constant at 0 V, in s.
    pub tau_s: f64,
    /// Time constant at [`Relaxation::HIGH_V`], in s; equal to `tau_s` if it is constant.
    pub tau_high_s: f64,
    /// Interpolation of the time constant between both voltages: geometric if true, else linear.
    pub geometric: bool,
    /// Set if the time constant depends on the spring's state instead of the voltage: the fraction of the remaining
    /// change that the state includes.
    pub by_state: Option<f64>,
    /// Set if the time constant depends on the time instead of the voltage: begin and end of its change from `tau_s` to `tau_high_s`, in s
    /// after the first row.
    pub over_s: Option<[f64; 2]>,
    /// Time constant of the first lag while its output falls, in s; `None` if it is that while it rises.
    pub falling_tau_s: Option<f64>,
    /// Further lags, which act in parallel with the first.
    pub further: [Part; FURTHER],
    /// Oscillations, which act in parallel with the lags; unused ones have no weight.
    pub modes: [Mode; PlantFile::MOST_MODES],
}

/// No oscillation.
const NO_MODE: Mode = Mode { freq_hz: 1.0, zeta: 0.5, weight: 0.0, rate_weight: 0.0 };

impl Relaxation {
    /// Voltage at which the time constant is `tau_high_s`, in normalised V.
    pub const HIGH_V: f64 = REFERENCE_VOLTAGE_V;

    /// Returns a relaxation with one feedthrough and one constant time constant, in s.
    pub fn plain(share: f64, tau_s: f64) -> Self {
        Self {
            share,
            tau_s,
            tau_high_s: tau_s,
            geometric: false,
            by_state: None,
            over_s: None,
            falling_tau_s: None,
            further: Default::default(),
            modes: [NO_MODE; PlantFile::MOST_MODES],
        }
    }

    /// Returns the time constant at a voltage, in s.
    pub fn tau_at(&self, voltage_v: f64) -> f64 {
        let part = voltage_v.abs() / Self::HIGH_V;
        let tau = if self.geometric {
            self.tau_s * (self.tau_high_s / self.tau_s).powf(part)
        } else {
            self.tau_s + (self.tau_high_s - self.tau_s) * part
        };
        tau.max(0.02 * self.tau_s)
    }

    /// Multiplies the weights of all further lags and oscillations.
    fn scale_weights(&mut self, factor: f64) {
        self.further.iter_mut().for_each(|further| further.part *= factor);
        for mode in &mut self.modes {
            mode.weight *= factor;
            mode.rate_weight *= factor;
        }
    }

    /// Replaces the feedthrough; the lags and oscillations keep the ratios of their weights.
    pub fn set_share(&mut self, share: f64) {
        self.scale_rest(1.0 - share);
        self.share = share;
    }

    /// Adds further lags with these weights, which the other lags and oscillations lose in proportion, and the feedthrough as well unless
    /// `share_is_kept`. If there is no place for as many lags, they replace the further ones.
    pub fn add_lags(&mut self, lags: &[Part], share_is_kept: bool) {
        let part: f64 = lags.iter().map(|lag| lag.part).sum();
        if share_is_kept {
            self.scale_rest(1.0 - self.share - part);
        } else {
            self.scale_weights(1.0 - part);
            self.share *= 1.0 - part;
        }
        if self.parts().count() + lags.len() > FURTHER {
            self.further = Default::default();
        }
        let free = self.further.iter_mut().filter(|further| further.part == 0.0);
        free.zip(lags).for_each(|(further, lag)| *further = *lag);
    }

    /// Adds a further lag whose weight the first one loses, if there is a place for it.
    pub fn take_from_first(&mut self, lag: Part) {
        if let Some(free) = self.further.iter_mut().find(|further| further.part == 0.0) {
            *free = lag;
        }
    }

    /// Scales the weights of lags and oscillations to a sum.
    fn scale_rest(&mut self, sum: f64) {
        let rest = 1.0 - self.share;
        if rest != 0.0 {
            self.scale_weights(sum / rest);
        }
    }

    /// Returns the further lags with a weight other than 0.
    pub fn parts(&self) -> impl Iterator<Item = Part> {
        self.further.into_iter().filter(|part| part.part != 0.0)
    }

    /// Returns the weight of the first lag.
    fn first_weight(&self) -> f64 {
        let modes: f64 = self.modes.iter().map(|mode| mode.weight).sum();
        1.0 - self.share - self.parts().map(|part| part.part).sum::<f64>() - modes
    }

    /// Writes the relaxation to a plant file.
    pub fn extend(&self, file: &mut PlantFile) {
        // A file holds one time constant for both directions, and none that changes with time: the last one is the spring's now.
        let first_s = if self.over_s.is_some() { self.tau_high_s } else { self.tau_s };
        let mut tau_s = vec![self.falling_tau_s.map_or(first_s, |falling_s| (first_s * falling_s).sqrt())];
        tau_s.extend(self.parts().map(|part| part.tau_s));
        let weights = match tau_s.len() {
            1 => Vec::new(),
            _ => std::iter::once(self.first_weight()).chain(self.parts().map(|part| part.part)).collect(),
        };
        let tau_high_s = (self.varies() && self.over_s.is_none()).then_some(self.tau_high_s);
        let tau_high_at_v = file.relaxation.tau_high_at_v;
        file.modes = self.oscillations().collect();
        file.relaxation = plant_file::Relaxation { share: self.share, tau_s, weights, tau_high_s, tau_high_at_v };
    }

    /// Returns the relaxation of a normalised plant file, which must be valid, with its oscillations.
    pub fn of(plant: &PlantFile) -> Self {
        let file = &plant.relaxation;
        let tau_s = file.tau_s.first().copied().unwrap_or_default();
        let mut relaxation = Self { tau_high_s: file.tau_high_s.unwrap_or(tau_s), ..Self::plain(file.share, tau_s) };
        let parts = file.tau_s.iter().zip(&file.weights).skip(1);
        for (further, (&tau_s, &part)) in relaxation.further.iter_mut().zip(parts) {
            *further = Part { part, tau_s };
        }
        relaxation.modes.iter_mut().zip(&plant.modes).for_each(|(mode, of_file)| *mode = *of_file);
        relaxation
    }

    /// Returns the relaxation that is this one in series with further lags, whose time constants are in s, by partial fractions:
    ///
    /// ```text
    /// lag(tau_i) lag(tau) = (tau_i lag(tau_i) - tau lag(tau)) / (tau_i - tau)
    /// ```
    ///
    /// `None` if the time constant varies, if there are oscillations, if there is no place for as many lags, or if three time
    /// constants are equal.
    pub fn in_series_with(&self, series_s: &[f64]) -> Option<Self> {
        let mut whole = *self;
        for &tau_s in series_s {
            if !self.is_linear() || self.oscillations().next().is_some() {
                return None;
            }
            let free = whole.further.iter().position(|further| further.part == 0.0)?;
            let close = |other: f64| (other / tau_s - 1.0).abs() < CLOSE;
            let twin = std::iter::once(whole.tau_s).chain(whole.parts().map(|it| it.tau_s)).find(|&it| close(it));
            let tau_s = twin.map_or(tau_s, |twin| twin * (1.0 + CLOSE));
            let factor = |of_s: f64| of_s / (of_s - tau_s);
            let first = whole.first_weight() * factor(whole.tau_s);
            whole.further.iter_mut().for_each(|further| further.part *= factor(further.tau_s));
            let others = first + whole.parts().map(|it| it.part).sum::<f64>();
            whole.further[free] = Part { part: 1.0 - others, tau_s };
            whole.share = 0.0;
            if whole.parts().any(|it| it.part.abs() > LARGEST_WEIGHT) {
                return None;
            }
        }
        Some(whole)
    }

    /// Returns the oscillations that contribute.
    pub fn oscillations(&self) -> impl Iterator<Item = Mode> {
        self.modes.into_iter().filter(contributes)
    }

    /// Returns true if the time constant depends on the voltage, the spring's own state or the time.
    pub fn varies(&self) -> bool {
        self.tau_high_s != self.tau_s
    }

    /// Returns true if the first lag has the same time constant at all times.
    pub fn is_linear(&self) -> bool {
        !self.varies() && self.falling_tau_s.is_none()
    }

    /// Maps the settled stiffness to the stiffness. `levels_v` is the voltage across the spring in the middle of each
    /// piece, in V; it is needed only if the time constant depends on it.
    pub fn pass(&self, signal: &mut Signal, start: &mut InitialState, levels_v: &[f64]) {
        let mut running = Running::at(self, signal.before, start);
        let free = signal.is_zero();
        if self.is_linear() || free && running.lag.value() == 0.0 {
            let Running { first_weight, lag, mut lags, oscillations: mut modes, .. } = running;
            lags.push((first_weight, lag));
            if free {
                // Of an initial state only what it moves is simulated.
                lags.retain(|(_, lag)| lag.value() != 0.0);
                modes.retain(|(_, oscillator)| !oscillator.is_zero());
            }
            return pass_all(signal, self.share, &lags, modes, free);
        }
        let mut levels = self.levels(levels_v);
        signal.pass(|piece| running.pass(piece, levels.next()));
    }

    /// Replaces the contents of `levels_v` by the voltage that sets the time constant in each piece of the voltage across the spring, in V.
    /// For a change with time it grows from 0 V to [`Relaxation::HIGH_V`].
    pub fn levels_of(&self, applied: &Signal, levels_v: &mut Vec<f64>) {
        let Some([begin_s, end_s]) = self.over_s else { return applied.middles(levels_v) };
        // Integral of the part of the change that is done, so that a change within a piece counts by its part of the piece.
        let done = |time_s: f64| {
            let within_s = time_s.clamp(begin_s, end_s) - begin_s;
            0.5 * within_s * within_s / (end_s - begin_s).max(f64::MIN_POSITIVE) + (time_s - end_s).max(0.0)
        };
        let mut time_s = 0.0;
        levels_v.clear();
        levels_v.extend(applied.durations_s().map(|duration_s| {
            let (from_s, to_s) = (time_s, time_s + duration_s);
            time_s = to_s;
            let part = if duration_s > 0.0 { (done(to_s) - done(from_s)) / duration_s } else { 0.0 };
            part.clamp(0.0, 1.0) * Self::HIGH_V
        }));
    }

    /// Returns those of the voltages that set the time constant, in V, on which it depends; none if it does not depend on them.
    pub fn levels(&self, levels_v: &[f64]) -> impl Iterator<Item = f64> {
        let depends = self.depends_on_levels();
        levels_v.iter().copied().filter(move |_| depends)
    }

    /// Returns true if the time constant depends on the voltage across the spring or the time.
    pub fn depends_on_levels(&self) -> bool {
        self.varies() && self.by_state.is_none()
    }

    /// Returns the number of steps of all lags over all pieces of a signal, of which a fraction is `irregular`: not as long as the piece
    /// before it, so that every lag and oscillation needs its exponentials anew.
    pub fn work(&self, signal: &Signal, irregular: f64) -> f64 {
        let pieces = signal.len() as f64;
        let lag = 1.0 + IRREGULAR_LAG * irregular;
        let lags = self.parts().count() as f64 * lag;
        let modes = self.oscillations().count() as f64 * (WORK_OF_MODE + IRREGULAR_MODE * irregular);
        let first = match self.by_state.filter(|_| self.varies()) {
            Some(_) => return signal.durations_s().map(|duration_s| STEP_BY_STATE * self.steps(duration_s)).sum(),
            None if self.varies() => EXPONENTIAL,
            None => lag,
        };
        pieces * (first + lags + modes)
    }

    /// Returns the work of a free response over a number of pieces, in units of one lag, of a relaxation that is linear.
    pub fn free_work(&self, pieces: usize) -> f64 {
        let lags = 1.0 + self.parts().count() as f64;
        pieces as f64 * (FREE_PIECE + lags + WORK_OF_MODE * self.oscillations().count() as f64)
    }

    /// Returns the number of integration steps of a piece where the spring's state sets the time constant.
    fn steps(&self, duration_s: f64) -> f64 {
        (duration_s / (STEP * self.tau_s.min(self.tau_high_s))).ceil().clamp(1.0, MOST_STEPS)
    }

    /// Returns start and end of the first lag over a piece of its input, where the spring's state sets its time
    /// constant. The solution is exact for the time constant in the middle of each integration step.
    fn follow_state(&self, instantaneous: f64, lag: &mut Lag, piece: Piece) -> (f64, f64) {
        let start = lag.value();
        let steps = self.steps(piece.duration_s);
        let duration_s = piece.duration_s / steps;
        let rise = (piece.to - piece.from) / steps;
        let mut from = piece.from;
        for _ in 0..steps as usize {
            // The implicit midpoint lies between the output and its input for any step length.
            let ahead = 0.5 * duration_s / (lag.tau_s() + 0.5 * duration_s);
            let to_come = from + 0.5 * rise - lag.value();
            let middle = lag.value() + (ahead + instantaneous * (1.0 - ahead)) * to_come;
            *lag = lag.with_tau(self.tau_at(middle));
            lag.pass(Piece { duration_s, from, to: from + rise });
            from += rise;
        }
        (start, lag.value())
    }
}

/// A relaxation in operation: the state of its lags and oscillations.
#[derive(Clone, Debug)]
pub struct Running {
    relaxation: Relaxation,
    first_weight: f64,
    /// The first lag.
    lag: Lag,
    /// Voltage that has set its time constant, in V; NaN before the first.
    level_v: f64,
    /// The further lags, each with its weight.
    lags: Vec<(f64, Lag)>,
    /// The oscillations.
    oscillations: Vec<(Mode, Oscillator)>,
}

impl Running {
    /// Returns a relaxation at rest at a settled stiffness, in V, but for the offsets of an initial state.
    pub fn at(relaxation: &Relaxation, rest: f64, start: &mut InitialState) -> Self {
        let mut at_rest = |tau_s| Lag::at(tau_s, rest + start.next_offset_v());
        let lag = at_rest(relaxation.tau_s);
        let lags = relaxation.parts().map(|it| (it.part, at_rest(it.tau_s))).collect();
        let oscillations = relaxation.oscillations().map(|mode| {
            let omega = TAU * mode.freq_hz;
            let (x, rate) = (rest + start.next_offset_v(), omega * start.next_offset_v());
            (mode, Oscillator::at(omega, mode.zeta, x, rate))
        });
        Self {
            relaxation: *relaxation,
            first_weight: relaxation.first_weight(),
            lag,
            level_v: f64::NAN,
            lags,
            oscillations: oscillations.collect(),
        }
    }

    /// Returns the stiffness without its feedthrough, in V.
    pub fn relaxed(&self) -> f64 {
        let lags = self.lags.iter().map(|(part, lag)| part * lag.value());
        let oscillations = self.oscillations.iter().map(|(mode, oscillator)| output(mode, oscillator));
        self.first_weight * self.lag.value() + lags.chain(oscillations).sum::<f64>()
    }

    /// Adds the stiffness at some times, in s, from now at the first of them on, while the settled stiffness is 0; the relaxation must be
    /// linear. Returns the largest number of steps until a lag or an oscillation has decayed.
    pub fn add_free(self, time_s: &[f64], response: &mut [f64]) -> usize {
        let until_next_s = |row: usize| time_s.get(row + 1).map_or(0.0, |next| next - time_s[row]);
        let mut steps = 0;
        let first = (self.first_weight, self.lag);
        for (weight, mut lag) in self.lags.into_iter().chain([first]) {
            for (step, at) in response.iter_mut().enumerate() {
                if lag.value().abs() < DECAYED {
                    break;
                }
                *at += weight * lag.value();
                lag.pass_free(until_next_s(step));
                steps = steps.max(step);
            }
        }
        for (mode, mut oscillator) in self.oscillations {
            for (step, at) in response.iter_mut().enumerate() {
                if oscillator.value().abs().max(oscillator.scaled_rate().abs()) < DECAYED {
                    break;
                }
                *at += output(&mode, &oscillator);
                oscillator.pass(Piece { duration_s: until_next_s(step), from: 0.0, to: 0.0 });
                steps = steps.max(step);
            }
        }
        steps
    }

    /// Advances over one piece of the settled stiffness and returns the stiffness at its start and end, both in V. `level_v` is the
    /// voltage that sets the time constant, in V, if it depends on that.
    pub fn pass(&mut self, piece: Piece, level_v: Option<f64>) -> (f64, f64) {
        let relaxation = &self.relaxation;
        if let Some(level_v) = level_v
            && level_v != self.level_v
        {
            self.level_v = level_v;
            self.lag = self.lag.with_tau(relaxation.tau_at(level_v));
        }
        if let Some(falling_s) = relaxation.falling_tau_s {
            let tau_s = if piece.from + piece.to < 2.0 * self.lag.value() { falling_s } else { relaxation.tau_s };
            self.lag = if tau_s == self.lag.tau_s() { self.lag } else { self.lag.with_tau(tau_s) };
        }
        let (start, end) = match relaxation.by_state.filter(|_| relaxation.varies()) {
            Some(instantaneous) => relaxation.follow_state(instantaneous, &mut self.lag, piece),
            None => self.lag.pass(piece),
        };
        let share = relaxation.share;
        let (mut from, mut to) =
            (share * piece.from + self.first_weight * start, share * piece.to + self.first_weight * end);
        for (part, lag) in &mut self.lags {
            let (start, end) = lag.pass(piece);
            from += *part * start;
            to += *part * end;
        }
        for (mode, oscillator) in &mut self.oscillations {
            let (start, end) = contribution(mode, oscillator, piece);
            from += start;
            to += end;
        }
        (from, to)
    }

    /// Returns the stiffness at the end of the last piece, of `duration_s` s, if its settled stiffness had ended `more` higher than `to`
    /// was reached with; all in V.
    pub fn raised_end(&mut self, duration_s: f64, more: f64, to: f64) -> f64 {
        let mut end = to + self.relaxation.share * more;
        let mut raise = |weight: f64, lag: &mut Lag| {
            let before = lag.value();
            lag.raise_end(more);
            end += weight * (lag.value() - before);
        };
        raise(self.first_weight, &mut self.lag);
        self.lags.iter_mut().for_each(|(part, lag)| raise(*part, lag));
        for (mode, oscillator) in &mut self.oscillations {
            let before = output(mode, oscillator);
            oscillator.raise_end(duration_s, more);
            end += output(mode, oscillator) - before;
        }
        end
    }
}

/// Returns true if an oscillation contributes to the response.
pub fn contributes(mode: &Mode) -> bool {
    mode.weight != 0.0 || mode.rate_weight != 0.0
}

/// Returns what an oscillation contributes at start and end of a piece of its input.
fn contribution(mode: &Mode, oscillator: &mut Oscillator, piece: Piece) -> (f64, f64) {
    let start = output(mode, oscillator);
    oscillator.pass(piece);
    (start, output(mode, oscillator))
}

/// Returns what an oscillation contributes at present.
fn output(mode: &Mode, oscillator: &Oscillator) -> f64 {
    mode.weight * oscillator.value() + mode.rate_weight * oscillator.scaled_rate()
}

/// Replaces a signal, which is 0 if `free`, by `share` of it and its responses of lags and oscillations.
fn pass_all(signal: &mut Signal, share: f64, lags: &[(f64, Lag)], modes: Vec<(Mode, Oscillator)>, free: bool) {
    let input = (!modes.is_empty()).then(|| signal.clone());
    pass_lags(signal, share, lags, free);
    for (mode, mut oscillator) in modes {
        let mut input = input.iter().flat_map(Signal::pieces);
        signal.pass(|piece| {
            let input = input.next().expect("as many pieces");
            let (from, to) = contribution(&mode, &mut oscillator, *input);
            (piece.from + from, piece.to + to)
        });
    }
}
