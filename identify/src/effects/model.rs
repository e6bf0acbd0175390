//! A model: the chain of a plant file with effects applied to it.

use crate::effects::catalogue::EFFECTS;
use crate::effects::effect::{Affects, Coordinate, Effect, Place, Quantity};
use crate::effects::identified;
use crate::plant::base::Base;
use crate::plant::chain::Chain;
use crate::plant::visited::{Range, Visited};
use crate::record::data::Data;
use simulation::plant_file::PlantFile;

/// One effect in one form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Block {
    /// Index in [`EFFECTS`], which is the order of the chain.
    pub effect: usize,
    /// Index of the form.
    pub form: usize,
}

impl Block {
    /// Returns the effect.
    pub fn effect(&self) -> &'static dyn Effect {
        EFFECTS[self.effect]
    }

    /// Returns the first intermediate result of a simulation that the block changes.
    pub fn affects(&self) -> Affects {
        self.effect().affects(self.form)
    }

    /// Returns the name of the cause.
    pub fn cause(&self) -> &'static str {
        self.effect().cause()
    }

    /// Returns the coordinates of the form.
    pub fn coordinates(&self, data: &Data) -> Vec<Coordinate> {
        self.effect().coordinates(self.form, data)
    }

    /// Returns the number of coordinates of the form that a fit moves.
    pub fn fitted(&self, data: &Data) -> usize {
        self.coordinates(data).iter().filter(|coordinate| coordinate.fitted).count()
    }

    /// Returns true if some coordinates are found by search alone.
    pub fn searched(&self) -> bool {
        self.effect().searched(self.form)
    }
}

/// A model: blocks in the order of the chain, each with its point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// The blocks, and the coordinates' values of each.
    pub blocks: Vec<(Block, Vec<f64>)>,
    /// Coordinates of the relaxation that a fit moves as well, with their values: those of [`identified::coordinates`] if the
    /// nominal spring was identified from the same readings, where causes that it lacks have biased it; empty if it is known.
    pub relaxation: Vec<(Coordinate, f64)>,
}

/// A parameter that is reported of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Reported {
    /// Index among all parameters of the block.
    pub index: usize,
    /// The parameter.
    pub quantity: Quantity,
    /// Range in which the record has been, if that does not contain the parameter's place on its curve.
    pub extrapolated: Option<Range>,
}

impl Model {
    /// Returns the model with one more block.
    pub fn with(&self, block: Block, point: Vec<f64>) -> Self {
        let mut blocks = self.blocks.clone();
        let at = blocks.partition_point(|(other, _)| *other < block);
        blocks.insert(at, (block, point));
        Self { blocks, relaxation: self.relaxation.clone() }
    }

    /// Returns the model without an effect.
    pub fn without(&self, effect: usize) -> Self {
        let blocks = self.blocks.iter().filter(|(block, _)| block.effect != effect).cloned().collect();
        Self { blocks, relaxation: self.relaxation.clone() }
    }

    /// Returns the model with an instantaneous share of 0 instead of a negative one; `None` if it has no negative one.
    pub fn without_negative_share(&self) -> Option<Self> {
        let mut changed = self.clone();
        let negative = |(block, point): &&mut (Block, Vec<f64>)| {
            block.cause() == "instantaneous-share" && block.form == 0 && point.iter().any(|share| *share < 0.0)
        };
        changed.blocks.iter_mut().find(negative)?.1.fill(0.0);
        Some(changed)
    }

    /// Returns true if an effect is in the model, in any form.
    pub fn has(&self, effect: usize) -> bool {
        self.blocks.iter().any(|(block, _)| block.effect == effect)
    }

    /// Returns the point of an effect; `None` if it is not in the model.
    pub fn point(&self, effect: usize) -> Option<&[f64]> {
        self.blocks.iter().find(|(block, _)| block.effect == effect).map(|(_, point)| point.as_slice())
    }

    /// Returns true if an effect is in the model in a form that needs a search.
    pub fn searched(&self, effect: usize) -> bool {
        self.blocks.iter().any(|(block, _)| block.effect == effect && block.searched())
    }

    /// Returns effects and forms without their points.
    pub fn structure(&self) -> Vec<Block> {
        self.blocks.iter().map(|(block, _)| *block).collect()
    }

    /// Returns the coordinates of all blocks in order, then those of the relaxation. The time constant of a relaxation in which a
    /// block varies it is that block's.
    pub fn coordinates(&self, data: &Data) -> Vec<Coordinate> {
        let varies = self.blocks.iter().any(|(block, _)| block.cause() == "voltage-dependent-time-constant");
        let of_relaxation = self.relaxation.iter().enumerate().map(|(place, (coordinate, _))| {
            let fitted = coordinate.fitted && !(varies && place == identified::TIME_CONSTANT);
            Coordinate { fitted, ..*coordinate }
        });
        self.blocks.iter().flat_map(|(block, _)| block.coordinates(data)).chain(of_relaxation).collect()
    }

    /// Returns the points of all blocks in order, then that of the relaxation.
    pub fn points(&self) -> Vec<f64> {
        let of_relaxation = self.relaxation.iter().map(|(_, value)| *value);
        self.blocks.iter().flat_map(|(_, point)| point.iter().copied()).chain(of_relaxation).collect()
    }

    /// Replaces the points of all blocks and of the relaxation, which must be in order.
    pub fn set_points(&mut self, points: &[f64]) {
        let mut rest = points;
        for (_, point) in &mut self.blocks {
            let (own, others) = rest.split_at(point.len());
            point.copy_from_slice(own);
            rest = others;
        }
        self.relaxation.iter_mut().zip(rest).for_each(|((_, value), point)| *value = *point);
    }

    /// Returns the chain of a plant with the effects of the model.
    pub fn chain<'a>(&'a self, base: &'a Base, data: &'a Data) -> Chain<'a> {
        let mut chain = base.chain();
        if !self.relaxation.is_empty() {
            let values = self.relaxation.iter().map(|(_, value)| *value);
            chain.relaxation = identified::moved(&chain.relaxation, values);
        }
        for (block, point) in &self.blocks {
            block.effect().modify_chain(block.form, point, data, &mut chain);
        }
        chain
    }

    /// Returns where on its curves the spring has been in a record, or in several.
    pub fn visited(&self, base: &Base, data: &Data) -> Visited {
        let chain = self.chain(base, data);
        let commands = data.parts.iter().map(|part| &part.data.command);
        let all = commands.map(|command| chain.visited(command)).reduce(Visited::with);
        all.unwrap_or_else(|| chain.visited(&data.command))
    }

    /// Returns the range of voltages over which a record shows the static law of the plant file.
    pub fn known_law(&self, base: &Base, data: &Data) -> Range {
        self.chain(base, data).known_law(&self.visited(base, data))
    }

    /// Returns the parameters that are reported of a block. Points of a curve are left out where the record has not been, unless it
    /// has been near none of them.
    pub fn reported(&self, block: usize, base: &Base, data: &Data) -> Vec<Reported> {
        let (block, point) = &self.blocks[block];
        let quantities = block.effect().quantities(block.form, point, data);
        let visited = quantities.iter().any(|it| it.place.is_some()).then(|| self.visited(base, data));
        let unknown =
            |place: Place| visited.map(|visited| visited.of(place.axis)).filter(|range| !range.is_near(place.at_v));
        let each = quantities.into_iter().enumerate();
        let each = each.map(|(index, quantity)| {
            let extrapolated = quantity.place.and_then(unknown);
            Reported { index, quantity, extrapolated }
        });
        let all: Vec<Reported> = each.collect();
        let omitted = |it: &Reported| it.extrapolated.is_some() && it.quantity.place.is_some_and(|place| place.omitted);
        if all.iter().all(omitted) { all } else { all.into_iter().filter(|it| !omitted(it)).collect() }
    }

    /// Returns the plant file of a plant with the effects of the model.
    pub fn extend(&self, base: &Base, data: &Data) -> PlantFile {
        let mut file = base.file().clone();
        let chain = self.chain(base, data);
        chain.write(&mut file, &self.visited(base, data));
        for (block, point) in &self.blocks {
            if let Some(value) = block.effect().unmodelled(block.form, point, data, &chain) {
                file.unmodelled.get_or_insert_default().insert(block.cause().to_owned(), value);
            }
        }
        file
    }

    /// Returns the blocks that the plant file does not represent.
    pub fn unmodelled(&self, base: &Base, data: &Data) -> Self {
        let chain = self.chain(base, data);
        let mentioned = |(block, point): &&(Block, Vec<f64>)| {
            block.effect().unmodelled(block.form, point, data, &chain).is_some_and(|value| value.is_table())
        };
        Self { blocks: self.blocks.iter().filter(mentioned).cloned().collect(), relaxation: Vec::new() }
    }
}
