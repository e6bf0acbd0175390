//! Simulation of models on a record; simulations that differ only in later blocks reuse the earlier results.

use crate::effects::effect::Affects;
use crate::effects::model::{Block, Model};
use crate::plant::base::Base;
use crate::plant::chain::Chain;
use crate::plant::initial_state::InitialState;
use crate::record::data::Data;
use crate::record::signal::Signal;

/// Simulates models under the command of one record.
#[derive(Clone, Debug)]
pub struct Simulator<'a> {
    /// The record.
    data: &'a Data,
    /// The plant without any effect.
    pub(super) base: &'a Base,
    signal: Signal,
    levels_v: Vec<f64>,
    /// Results of the last simulation: the voltage on the electrodes, the settled stiffness, and the stiffness behind
    /// the relaxation.
    amplified: Cached<Signal>,
    static_response: Cached<Signal>,
    chained: Cached<Signal>,
    /// Reading of the stiffness at each row, before any effect on the readings.
    response: Cached<Vec<f64>>,
    /// Response of the stiffness to each initial state.
    kernels: Cached<Vec<Vec<f64>>>,
    /// Index of the state of each of these kernels.
    states: Vec<usize>,
    /// True if the response that was simulated last is linear in the initial state.
    linear_in_start: bool,
    /// Simulators of several records, in their order; empty for a single one.
    parts: Vec<Simulator<'a>>,
    /// Work since it was counted last, in units of one piece through one lag.
    work: f64,
    /// Fraction of the pieces of the voltage on the electrodes that are not as long as the one before them, so that their
    /// exponentials are not known.
    irregular: f64,
}

/// A result, and the blocks that it was computed from.
#[derive(Clone, Debug, Default)]
struct Cached<T> {
    key: Option<Model>,
    value: T,
}

impl<T> Cached<T> {
    /// Returns true if the result was computed from the same blocks up to `last`; otherwise sets the key to the blocks
    /// of the model.
    fn update_key(&mut self, model: &Model, last: Affects) -> bool {
        self.update_key_by(model, |affects| affects <= last)
    }

    /// Returns true if the result was computed from the same blocks of those that `matter`; otherwise sets the key to these.
    fn update_key_by(&mut self, model: &Model, matter: impl Fn(Affects) -> bool) -> bool {
        let blocks = || model.blocks.iter().filter(|(block, _)| matter(block.affects()));
        let relaxation = if matter(Affects::Relaxation) { model.relaxation.as_slice() } else { &[] };
        if self.key.as_ref().is_some_and(|kept| kept.blocks.iter().eq(blocks()) && kept.relaxation == relaxation) {
            return true;
        }
        self.key = Some(Model { blocks: blocks().cloned().collect(), relaxation: relaxation.to_vec() });
        false
    }
}

/// Smallest response to an initial state of 1 V that is one, in V.
const LEAST_KERNEL: f64 = 1e-200;

/// Work of one piece in each stage, in units of one lag.
const AMPLIFIER: f64 = 2.0;
const STATIC_RESPONSE: f64 = 3.0;
const RESPONSE: f64 = 4.0;
const INITIAL_STATE: f64 = 14.0;
/// Further work of a piece that is not as long as the one before it, relative to one that is.
const IRREGULAR: f64 = 3.0;

/// Returns the fraction of a signal's pieces that are not as long as the one before them.
fn irregular(signal: &Signal) -> f64 {
    signal.new_durations() as f64 / signal.len().max(1) as f64
}

/// Returns the work of a block on a response.
fn response_work(block: Block, signal: &Signal, irregular: f64) -> f64 {
    let of_piece = if block.affects() == Affects::Response { RESPONSE } else { 0.0 };
    (1.0 + IRREGULAR * irregular) * of_piece * signal.len() as f64
}

impl<'a> Simulator<'a> {
    /// Prepares simulations of one record.
    pub fn new(data: &'a Data, base: &'a Base) -> Self {
        Self {
            data,
            base,
            irregular: irregular(&data.command),
            signal: Signal::default(),
            levels_v: Vec::new(),
            amplified: Cached::default(),
            static_response: Cached::default(),
            chained: Cached::default(),
            response: Cached::default(),
            kernels: Cached::default(),
            states: Vec::new(),
            linear_in_start: true,
            parts: data.parts.iter().map(|part| Self::new(&part.data, base)).collect(),
            work: 0.0,
        }
    }

    /// Returns the work since the last call.
    pub fn take_work(&mut self) -> u64 {
        std::mem::take(&mut self.work) as u64 + self.parts.iter_mut().map(Self::take_work).sum::<u64>()
    }

    /// Computes the prediction of a model for each row, in V.
    pub fn run(&mut self, model: &Model, readings: &mut Vec<f64>) {
        if !self.parts.is_empty() {
            return self.run_parts(model, readings, None);
        }
        if !self.response.update_key(model, Affects::Response) {
            let mut value = std::mem::take(&mut self.response.value);
            value.clear();
            let output = self.data.scales().output;
            value.extend(self.responded(model).at_rows().map(|stiffness| output * stiffness));
            self.response.value = value;
        }
        readings.clone_from(&self.response.value);
        self.modify_readings(model, readings);
    }

    /// Computes the prediction of several records one after the other and, if asked for, the kernels of each: those of its initial
    /// state, if that is unknown, and its zero offset.
    fn run_parts(&mut self, model: &Model, readings: &mut Vec<f64>, mut kernels: Option<&mut Vec<Vec<f64>>>) {
        readings.clear();
        let rows = self.data.rows();
        let (mut of_part, mut own) = (Vec::new(), Vec::new());
        for (part, simulator) in self.data.parts.iter().zip(&mut self.parts) {
            own.clear();
            match kernels {
                Some(_) if part.data.initial_state_unknown => {
                    simulator.run_with_initial_states(model, &mut of_part, &mut own);
                }
                _ => simulator.run(model, &mut of_part),
            }
            readings.extend(&of_part);
            if let Some(kernels) = &mut kernels {
                own.push(vec![1.0; part.rows.len()]);
                kernels.extend(own.drain(..).map(|kernel| {
                    let mut whole = vec![0.0; rows];
                    whole[part.rows.clone()].copy_from_slice(&kernel);
                    whole
                }));
            }
        }
    }

    fn modify_readings(&self, model: &Model, readings: &mut [f64]) {
        for (block, point) in &model.blocks {
            block.effect().modify_readings(block.form, point, self.data, readings);
        }
    }

    /// Computes the same, and its kernels: the change of the prediction for each initial state that is 1 V away from rest at the
    /// first row, if that is unknown, and for a zero and a gain that are off by 1 V at the full scale, if the nominal spring was
    /// identified.
    pub fn run_with_initial_states(&mut self, model: &Model, readings: &mut Vec<f64>, kernels: &mut Vec<Vec<f64>>) {
        if !self.parts.is_empty() {
            kernels.clear();
            return self.run_parts(model, readings, Some(kernels));
        }
        self.run(model, readings);
        kernels.clear();
        if self.data.initial_state_unknown {
            kernels.extend_from_slice(self.initial_state_kernels(model));
        }
        if self.data.estimates_zero() {
            kernels.push(vec![1.0; readings.len()]);
        }
        if self.data.normalisation.identified {
            let full_scale_v = self.data.full_scale_v;
            kernels.push(self.response.value.iter().map(|stiffness| stiffness / full_scale_v).collect());
        }
        if model.blocks.iter().any(|(block, _)| block.affects() == Affects::Readings) {
            for kernel in kernels {
                kernel.iter_mut().zip(&self.response.value).for_each(|(moved, stiffness)| *moved += stiffness);
                self.modify_readings(model, kernel);
                kernel.iter_mut().zip(&*readings).for_each(|(moved, reading)| *moved -= reading);
            }
        }
    }

    /// Returns true if the response that was simulated last is linear in the initial state, so that its kernels are the same from every
    /// one.
    pub fn is_linear_in_start(&self) -> bool {
        self.linear_in_start
    }

    /// Returns the response of the stiffness to each initial state, of the model that was simulated last.
    fn initial_state_kernels(&mut self, model: &Model) -> &[Vec<f64>] {
        let chain = model.chain(self.base, self.data);
        let depends = chain.initial_state_depends_on_voltage();
        let matter = |affects| affects <= Affects::Response && (depends || affects != Affects::StaticResponse);
        if !self.kernels.update_key_by(model, matter) {
            self.kernels.value.clear();
            self.states.clear();
            let (mut state, mut states) = (0, 1);
            while state < states {
                let mut start = InitialState::off(state);
                let kernel = self.change(model, &chain, &mut start);
                // A state that changes no row is not estimated.
                if kernel.iter().any(|value| value.abs() > LEAST_KERNEL) {
                    self.kernels.value.push(kernel);
                    self.states.push(state);
                }
                (state, states) = (state + 1, start.states());
            }
        }
        &self.kernels.value
    }

    /// Computes the prediction of a model from an initial state, zero and gain: `start_v` holds the offset, in V, of each that had a
    /// kernel when these were computed last. Of a single record.
    pub fn run_from(&mut self, model: &Model, start_v: &[f64], readings: &mut Vec<f64>) {
        self.run(model, readings);
        readings.clone_from(&self.response.value);
        let (states_v, reading_map) = start_v.split_at(self.known_states());
        if !states_v.is_empty() {
            let change = self.change_by(model, states_v);
            readings.iter_mut().zip(change).for_each(|(reading, change)| *reading += change);
        }
        if let [zero_v, gain_v @ ..] = reading_map {
            let gain = gain_v.first().map_or(0.0, |gain_v| gain_v / self.data.full_scale_v);
            let stiffness = self.response.value.iter();
            readings.iter_mut().zip(stiffness).for_each(|(reading, stiffness)| *reading += zero_v + gain * stiffness);
        }
        self.modify_readings(model, readings);
    }

    /// Computes the kernels of the initial states at an initial state: the change of the prediction by 1 V more of each. `start_v` and
    /// `kernels` hold those of zero and gain as well, which stay. Of a single record, in the model that was simulated last.
    pub fn update_kernels(&mut self, model: &Model, start_v: &[f64], kernels: &mut [Vec<f64>]) {
        let states = self.known_states();
        let mut states_v = start_v[..states].to_vec();
        let here = self.change_by(model, &states_v);
        for (index, kernel) in kernels[..states].iter_mut().enumerate() {
            states_v[index] += 1.0;
            *kernel = self.change_by(model, &states_v);
            kernel.iter_mut().zip(&here).for_each(|(there, here)| *there -= here);
            states_v[index] = start_v[index];
        }
    }

    /// Returns the number of initial states that had a kernel when these were computed last.
    fn known_states(&self) -> usize {
        if self.data.initial_state_unknown { self.states.len() } else { 0 }
    }

    /// Returns the change of the prediction at each row, in V, by an offset of each known state, in V.
    fn change_by(&mut self, model: &Model, states_v: &[f64]) -> Vec<f64> {
        let mut offsets_v = vec![0.0; self.states.last().map_or(0, |last| last + 1)];
        self.states.iter().zip(states_v).for_each(|(&state, &offset_v)| offsets_v[state] = offset_v);
        let chain = model.chain(self.base, self.data);
        self.change(model, &chain, &mut InitialState::of(offsets_v))
    }

    /// Returns the change of the prediction at each row by an initial state, in V, of the model that was simulated last.
    fn change(&mut self, model: &Model, chain: &Chain, start: &mut InitialState) -> Vec<f64> {
        let output = self.data.scales().output;
        let linear = chain.is_linear_in_start();
        let alone = model.blocks.iter().all(|(block, _)| block.affects() != Affects::Response);
        let mut again = start.clone();
        if linear
            && alone
            && let Some((mut response, work)) =
                chain.free_response(&self.amplified.value, &self.data.time_s, &mut again)
        {
            *start = again;
            self.work += work;
            response.iter_mut().for_each(|stiffness| *stiffness *= output);
            return response;
        }
        if linear {
            chain.initial_state_response(&self.amplified.value, &mut self.signal, start, &self.levels_v);
            self.work += (1.0 + IRREGULAR * self.irregular) * INITIAL_STATE * self.signal.len() as f64;
        } else {
            self.signal.clone_from(&self.static_response.value);
            let (applied, from_rest) = (&self.amplified.value, Some(&self.chained.value));
            let simulated = chain.relax(&mut self.signal, applied, start, &mut self.levels_v, from_rest);
            self.work += simulated * chain.work(&self.signal, self.irregular);
        }
        for (block, point) in &model.blocks {
            block.effect().modify_response(block.form, point, &mut self.signal, start);
            self.work += response_work(*block, &self.signal, self.irregular);
        }
        let changed = self.signal.at_rows().map(|stiffness| output * stiffness);
        if linear { changed.collect() } else { changed.zip(&self.response.value).map(|(to, from)| to - from).collect() }
    }

    /// Returns the stiffness for the command, with the effects on the chain and on the stiffness.
    fn responded(&mut self, model: &Model) -> &Signal {
        let data = self.data;
        let known = self.chained.update_key(model, Affects::Relaxation);
        let signal = &mut self.chained.value;
        if !known {
            let chain = model.chain(self.base, data);
            if !self.static_response.update_key(model, Affects::StaticResponse) {
                if !self.amplified.update_key(model, Affects::Amplifier) {
                    self.amplified.value.clone_from(&data.command);
                    chain.amplify(&mut self.amplified.value);
                    self.irregular = irregular(&self.amplified.value);
                    self.work += AMPLIFIER * self.amplified.value.len() as f64;
                }
                self.static_response.value.clone_from(&self.amplified.value);
                chain.static_response(&mut self.static_response.value);
                self.work += STATIC_RESPONSE * self.static_response.value.len() as f64;
            }
            signal.clone_from(&self.static_response.value);
            let applied = &self.amplified.value;
            chain.relax(signal, applied, &mut InitialState::at_rest(), &mut self.levels_v, None);
            self.linear_in_start = chain.is_linear_in_start();
            self.work += chain.work(signal, self.irregular);
        }
        if model.blocks.iter().all(|(block, _)| block.affects() != Affects::Response) {
            return signal;
        }
        self.signal.clone_from(signal);
        for (block, point) in &model.blocks {
            block.effect().modify_response(block.form, point, &mut self.signal, &mut InitialState::at_rest());
            self.work += response_work(*block, &self.signal, self.irregular);
        }
        &self.signal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::effect::Coordinate;
    use crate::effects::{EFFECTS, index_of};
    use crate::record::input::Input;
    use simulation::record::Record;

    /// A simulation gives the same result as in a new simulator, whatever was simulated before.
    #[test]
    fn cached_results_do_not_change_a_simulation() {
        let rows = (0..60).map(|row| format!("{row},{},0\n", 100 * (row / 20 % 2)));
        let text = format!("time_s,voltage_v,stiffness\n{}", rows.collect::<String>());
        let (data, base) = (Data::new(&Record::parse("r", &text, "stiffness").unwrap(), Input::Hold), Base::paper());
        let of = |blocks: &[(&str, &[f64])]| {
            blocks.iter().fold(Model::default(), |model, (cause, point)| {
                model.with(Block { effect: index_of(cause).unwrap(), form: 0 }, point.to_vec())
            })
        };
        type Named<'a> = (&'a str, &'a [f64]);
        let [gain, swing, hum, cut]: [Named; 4] = [
            ("gain-error", &[1.2]),
            ("resonance", &[-1.0, -1.0]),
            ("hum", &[0.1, 3.0, 0.0]),
            ("amplifier-limit", &[60.0]),
        ];
        let models = [
            of(&[]),
            of(&[hum]),
            of(&[gain, hum]),
            of(&[gain, swing, hum]),
            of(&[cut, gain]),
            of(&[cut]),
            of(&[gain]),
            of(&[swing]),
        ];
        let mut kept = Simulator::new(&data, &base);
        let mut got = (Vec::new(), Vec::new());
        let mut expected = got.clone();
        for first in &models {
            for model in &models {
                kept.run(first, &mut got.0);
                kept.run_with_initial_states(model, &mut got.0, &mut got.1);
                Simulator::new(&data, &base).run_with_initial_states(model, &mut expected.0, &mut expected.1);
                assert_eq!(got, expected, "{model:?} after {first:?}");
            }
        }
    }

    /// A fit may go to every corner of its bounds: the prediction there is finite, also beyond the nominal spring's reference
    /// voltage and for voltages of both signs.
    #[test]
    fn prediction_is_finite_at_every_corner_of_the_bounds() {
        let rows = (0..60).map(|row| format!("{row},{},{}\n", [0, 300, -400, 900][row / 8 % 4], row % 7));
        let text = format!("time_s,voltage_v,stiffness\n{}", rows.collect::<String>());
        let (data, base) = (Data::new(&Record::parse("r", &text, "stiffness").unwrap(), Input::Hold), Base::paper());
        // Of a block with more coordinates not every corner.
        const MOST: usize = 8;
        let mut corners = 0;
        for (effect, of) in EFFECTS.iter().enumerate() {
            for form in 0..of.forms() {
                let bounds = of.coordinates(form, &data);
                for corner in 0..1 << bounds.len().min(MOST) {
                    let end = |(index, bound): (usize, &Coordinate)| match corner >> (index % MOST) & 1 {
                        0 => bound.lowest,
                        _ => bound.highest,
                    };
                    let point: Vec<f64> = bounds.iter().enumerate().map(end).collect();
                    let mut readings = Vec::new();
                    let model = Model::default().with(Block { effect, form }, point);
                    Simulator::new(&data, &base).run(&model, &mut readings);
                    assert!(readings.iter().all(|reading| reading.is_finite()), "{model:?}: {readings:?}");
                    corners += 1;
                }
            }
        }
        assert!(corners > 100, "{corners}");
    }
}
