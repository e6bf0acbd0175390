//! A model: the paper's chain with some effects in it.

use crate::effects::catalogue::EFFECTS;
use crate::effects::effect::{Coordinate, Effect};
use crate::plant::base::Base;
use crate::plant::chain::Chain;
use crate::record::data::Data;
use simulation::plant_file::PlantFile;

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

    /// True if one of its coordinates is found by search alone.
    pub fn searched(&self) -> bool {
        self.effect().searched(self.form)
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
    pub fn searched(&self, effect: usize) -> bool {
        self.blocks.iter().any(|(block, _)| block.effect == effect && block.searched())
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

    /// The base's chain, changed by the model's blocks.
    pub fn chain<'a>(&'a self, base: &'a Base, data: &'a Data) -> Chain<'a> {
        let mut chain = base.chain();
        for (block, point) in &self.blocks {
            block.effect().modify_chain(block.form, point, data, &mut chain);
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
