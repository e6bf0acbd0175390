//! A model: the paper's chain with some effects in it, and what it predicts for a record.

use super::base::Base;
use super::chain::Chain;
use super::data::Data;
use super::effect::{Acts, Coordinate, Effect};
use super::effects::EFFECTS;
use super::signal::Signal;
use crate::plant_file::PlantFile;

/// One effect in one form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Block {
    /// Its place in [`EFFECTS`], which is the chain's order.
    pub effect: usize,
    /// Its form.
    pub form: usize,
}

impl Block {
    /// The effect itself.
    pub fn effect(&self) -> &'static dyn Effect {
        EFFECTS[self.effect]
    }

    /// The cause's name.
    pub fn cause(&self) -> &'static str {
        self.effect().cause()
    }

    /// The coordinates of its form.
    pub fn coordinates(&self, data: &Data) -> Vec<Coordinate> {
        self.effect().coordinates(self.form, data)
    }

    /// True if a search alone can place it.
    pub fn searched(&self, data: &Data) -> bool {
        self.coordinates(data).iter().any(|coordinate| coordinate.searched)
    }
}

/// Blocks in the chain's order, each with its point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// The blocks.
    pub blocks: Vec<(Block, Vec<f64>)>,
}

impl Model {
    /// The model with one more block.
    pub fn with(&self, block: Block, point: Vec<f64>) -> Self {
        let mut blocks = self.blocks.clone();
        let at = blocks.partition_point(|(other, _)| *other < block);
        blocks.insert(at, (block, point));
        Self { blocks }
    }

    /// The model without one of its effects.
    pub fn without(&self, effect: usize) -> Self {
        Self { blocks: self.blocks.iter().filter(|(block, _)| block.effect != effect).cloned().collect() }
    }

    /// True if an effect is in it, in any form.
    pub fn has(&self, effect: usize) -> bool {
        self.blocks.iter().any(|(block, _)| block.effect == effect)
    }

    /// The point of an effect, if it is there.
    pub fn point(&self, effect: usize) -> Option<&[f64]> {
        self.blocks.iter().find(|(block, _)| block.effect == effect).map(|(_, point)| point.as_slice())
    }

    /// True if an effect is in it that only a search can place.
    pub fn searched(&self, effect: usize, data: &Data) -> bool {
        self.blocks.iter().any(|(block, _)| block.effect == effect && block.searched(data))
    }

    /// Effects and forms, as a key.
    pub fn structure(&self) -> Vec<Block> {
        self.blocks.iter().map(|(block, _)| *block).collect()
    }

    /// Coordinates of all blocks, one after the other.
    pub fn coordinates(&self, data: &Data) -> Vec<Coordinate> {
        self.blocks.iter().flat_map(|(block, _)| block.coordinates(data)).collect()
    }

    /// All points, one after the other.
    pub fn points(&self) -> Vec<f64> {
        self.blocks.iter().flat_map(|(_, point)| point.iter().copied()).collect()
    }

    /// Sets all points from one vector.
    pub fn set_points(&mut self, points: &[f64]) {
        let mut rest = points;
        for (_, point) in &mut self.blocks {
            let (own, others) = rest.split_at(point.len());
            point.copy_from_slice(own);
            rest = others;
        }
    }
}

/// Runs models on a record.
#[derive(Clone, Debug)]
pub struct Simulator<'a> {
    /// The record.
    pub data: &'a Data,
    /// The simulation without any effect.
    pub base: &'a Base,
    signal: Signal,
    levels_v: Vec<f64>,
    /// What the last amplifier made of the command, and the last memory and law of that.
    amplified: Kept<Signal>,
    settled: Kept<Signal>,
    /// What the last relaxation made of that, from rest and from elsewhere.
    chained: [Kept<Signal>; 2],
    /// Readings before any effect on them, of the last response from either.
    response: [Kept<Vec<f64>>; 2],
    /// Runs so far.
    pub runs: usize,
}

/// What a part of a run made, and of what.
#[derive(Clone, Debug, Default)]
struct Kept<T> {
    of: Option<(f64, Model)>,
    made: T,
}

impl<T> Kept<T> {
    /// True if it was made from the same start by the same blocks as far as `last`; else it is said to be from now on.
    fn is_of(&mut self, ahead_v: f64, model: &Model, last: Acts) -> bool {
        let blocks = || model.blocks.iter().filter(|(block, _)| block.effect().acts() <= last);
        if self.of.as_ref().is_some_and(|(ahead, kept)| *ahead == ahead_v && kept.blocks.iter().eq(blocks())) {
            return true;
        }
        self.of = Some((ahead_v, Model { blocks: blocks().cloned().collect() }));
        false
    }
}

impl Model {
    /// The base's chain, changed by the model's blocks.
    pub fn chain<'a>(&'a self, base: &'a Base, data: &'a Data) -> Chain<'a> {
        let mut chain = base.chain();
        for (block, point) in &self.blocks {
            block.effect().change(block.form, point, data, &mut chain);
        }
        chain
    }

    /// The base with the model's blocks in it, as a plant file.
    pub fn extend(&self, base: &Base, data: &Data) -> PlantFile {
        let mut file = base.file().clone();
        let chain = self.chain(base, data);
        chain.write(&mut file, data.full_scale_v);
        for (block, point) in &self.blocks {
            if let Some(value) = block.effect().unmodelled(block.form, point, data, &chain) {
                file.unmodelled.get_or_insert_default().insert(block.cause().to_owned(), value);
            }
        }
        file
    }

    /// The blocks that the model's plant file only mentions.
    pub fn unmodelled(&self, base: &Base, data: &Data) -> Self {
        let chain = self.chain(base, data);
        let mentioned = |(block, point): &&(Block, Vec<f64>)| {
            block.effect().unmodelled(block.form, point, data, &chain).is_some_and(|value| value.is_table())
        };
        Self { blocks: self.blocks.iter().filter(mentioned).cloned().collect() }
    }
}

impl<'a> Simulator<'a> {
    /// For one record.
    pub fn new(data: &'a Data, base: &'a Base) -> Self {
        Self {
            data,
            base,
            signal: Signal::default(),
            levels_v: Vec::new(),
            amplified: Kept::default(),
            settled: Kept::default(),
            chained: Default::default(),
            response: Default::default(),
            runs: 0,
        }
    }

    /// What a model predicts for each row, in V.
    pub fn run(&mut self, model: &Model, readings: &mut Vec<f64>) {
        self.run_from(0.0, model, readings);
    }

    /// The same from lags that are `ahead_v` of where they would be at rest under the first voltage.
    pub fn run_from(&mut self, ahead_v: f64, model: &Model, readings: &mut Vec<f64>) {
        self.runs += 1;
        let data = self.data;
        let from = usize::from(ahead_v != 0.0);
        if !self.response[from].is_of(ahead_v, model, Acts::OnResponse) {
            let mut made = std::mem::take(&mut self.response[from].made);
            made.clear();
            made.extend(self.responded(ahead_v, model).at_rows());
            self.response[from].made = made;
        }
        readings.clone_from(&self.response[from].made);
        for (block, point) in &model.blocks {
            block.effect().read(block.form, point, data, readings);
        }
    }

    /// The stiffness that a model's chain and response make of the command.
    fn responded(&mut self, ahead_v: f64, model: &Model) -> &Signal {
        let data = self.data;
        let chained = &mut self.chained[usize::from(ahead_v != 0.0)];
        let known = chained.is_of(ahead_v, model, Acts::OnChain);
        let signal = &mut chained.made;
        if !known {
            let chain = model.chain(self.base, data);
            // Whatever the spring was ahead by.
            if !self.settled.is_of(0.0, model, Acts::OnSettled) {
                if !self.amplified.is_of(0.0, model, Acts::OnAmplifier) {
                    self.amplified.made.clone_from(&data.command);
                    chain.amplify(&mut self.amplified.made);
                }
                self.settled.made.clone_from(&self.amplified.made);
                chain.settle(&mut self.settled.made);
            }
            signal.clone_from(&self.settled.made);
            chain.relax(signal, ahead_v, &self.amplified.made, &mut self.levels_v);
        }
        if model.blocks.iter().all(|(block, _)| block.effect().acts() != Acts::OnResponse) {
            return signal;
        }
        self.signal.clone_from(signal);
        for (block, point) in &model.blocks {
            block.effect().respond(block.form, point, data, &mut self.signal);
        }
        &self.signal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::data::Input;
    use crate::diagnose::effects::index_of;
    use crate::record::Record;

    /// Whatever ran before: a run is what it is for a new simulator.
    #[test]
    fn what_is_kept_changes_no_run() {
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
        let (mut got, mut expected) = (Vec::new(), Vec::new());
        for first in &models {
            for (model, ahead_v) in models.iter().flat_map(|model| [(model, 0.0), (model, 50.0)]) {
                kept.run(first, &mut got);
                kept.run_from(ahead_v, model, &mut got);
                Simulator::new(&data, &base).run_from(ahead_v, model, &mut expected);
                assert_eq!(got, expected, "{model:?} from {ahead_v} V after {first:?}");
            }
        }
    }
}
