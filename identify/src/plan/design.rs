//! The rivals as models that can be simulated: their points, draws from their posteriors, and the parameters that each may bend.

use anyhow::Result;
use nalgebra::{DMatrix, DVector};
use simulation::bad_input;

use crate::effects::effect::Coordinate;
use crate::effects::model::{Block, Model};
use crate::effects::{EFFECTS, index_of};
use crate::hypotheses::{FittedBlock, Rival};
use crate::plan::library::Random;
use crate::record::data::Data;

/// Causes of one record's readings, which no voltage of another record shows.
const OF_THE_READINGS: [&str; 6] =
    ["hum", "reading-offset", "sensor-saturation", "quantisation", "stuck-sensor", "outliers"];
/// Causes that any explanation may hide a part of another one in: gain, time constant, instantaneous share.
const BENDING: [&str; 3] = ["gain-error", "time-constant", "instantaneous-share"];
/// Standard deviation of the parameters of such causes before the experiment: a factor of 1.5, and half a share.
const BENT_BY: f64 = 0.5;
/// Number of standard deviations of the first record's posterior that a rival may move away in the next one, so that the next record
/// decides on its own.
const POSTERIOR_WIDTHS: f64 = 10.0;
/// Draws from each posterior, on both sides of its mean; the mean itself is one more.
const DRAWS: usize = 2;

/// An explanation that the plan is to confirm or reject.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    /// Cause codes, as the diagnosis names them.
    pub(super) causes: Vec<String>,
    /// What the first record says for the set against the best one, in nats.
    pub(super) nats: f64,
    /// True if the diagnosis names the set; false for a set with one cause more than such a set, which is not far behind.
    pub(super) named: bool,
    /// The model, without causes of one record's readings.
    pub(super) model: Model,
    /// Covariance of its fitted coordinates, normalised; `None` if the record does not determine it.
    pub(super) covariance: Option<DMatrix<f64>>,
}

/// A coordinate that may bend, with its standard deviation before the experiment.
#[derive(Clone, Debug)]
pub(super) struct Bend {
    /// The model with the coordinate's block.
    pub(super) model: Model,
    /// Index of the coordinate among all of that model.
    pub(super) place: usize,
    /// Standard deviation before the experiment.
    pub(super) deviation: f64,
    /// The cause, if it is not one of the hypothesis.
    pub(super) extra: Option<&'static str>,
}

impl Bend {
    /// Returns the index of the coordinate's block in the model, and the index of the block's first coordinate.
    pub(super) fn block(&self) -> (usize, usize) {
        let mut first = 0;
        for (index, (_, point)) in self.model.blocks.iter().enumerate() {
            if self.place < first + point.len() {
                return (index, first);
            }
            first += point.len();
        }
        unreachable!("a coordinate is one of the model's")
    }
}

/// Returns true if a cause is visible in every record of a spring, if the voltage shows it.
pub(super) fn of_the_spring(cause: &str) -> bool {
    !OF_THE_READINGS.contains(&cause)
}

impl Hypothesis {
    /// Returns a rival as a model; `name` is what an error calls the file.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for a cause, form or list of numbers that this version does not have.
    pub(super) fn of(rival: &Rival, named: bool, data: &Data, name: &str) -> Result<Self> {
        let mut model = Model::default();
        let (mut kept, mut fitted) = (Vec::new(), 0);
        // A record that may not begin at rest has its states at the beginning behind all other coordinates; the next one begins at rest.
        let unsettled = Data { initial_state_unknown: true, ..data.clone() };
        for FittedBlock { cause, form, point } in &rival.blocks {
            let Some(effect) = index_of(cause).filter(|&effect| *form < EFFECTS[effect].forms()) else {
                bad_input!("{name}: cause {cause}, form {form}: expected a cause and a form of this version of vsj");
            };
            let block = Block { effect, form: *form };
            let [at_rest, moving] = [data, &unsettled].map(|data| block.coordinates(data));
            let of_record = if point.len() == moving.len() { &moving } else { &at_rest };
            if of_record.len() != point.len() || point.iter().any(|value| !value.is_finite()) {
                bad_input!("{name}: cause {cause}: {} numbers; expected {}", point.len(), at_rest.len());
            }
            let fitted_of = |of: &[Coordinate]| of.iter().filter(|coordinate| coordinate.fitted).count();
            if of_the_spring(cause) {
                kept.extend(fitted..fitted + fitted_of(&at_rest));
                model = model.with(block, point[..at_rest.len()].to_vec());
            }
            fitted += fitted_of(of_record);
        }
        let square = rival.covariance.len() == fitted && rival.covariance.iter().all(|row| row.len() == fitted);
        let entry = |row: usize, column: usize| rival.covariance[kept[row]][kept[column]];
        let covariance = (square && !kept.is_empty()).then(|| DMatrix::from_fn(kept.len(), kept.len(), entry));
        Ok(Self { causes: rival.causes.clone(), nats: rival.nats, named, model, covariance })
    }

    /// Returns true if another hypothesis differs in causes of the readings alone, so that each can always imitate the other.
    pub(super) fn same_spring(&self, other: &Self) -> bool {
        self.contains(other) && other.contains(self)
    }

    /// Returns true if the hypothesis has all causes of another one, so that it can always imitate that.
    pub(super) fn contains(&self, other: &Self) -> bool {
        other.model.blocks.iter().all(|(block, _)| self.model.has(block.effect))
    }

    /// Returns the indices of the fitted coordinates.
    pub(super) fn places(&self, data: &Data) -> Vec<usize> {
        let bounds = self.model.coordinates(data);
        (0..bounds.len()).filter(|&place| bounds[place].fitted).collect()
    }

    /// Returns models with parameters drawn from the posterior, the likeliest first.
    pub(super) fn draws(&self, data: &Data, random: &mut Random) -> Vec<Model> {
        let mut draws = vec![self.model.clone()];
        let Some(factor) = self.covariance.clone().and_then(DMatrix::cholesky) else { return draws };
        let (places, bounds) = (self.places(data), self.model.coordinates(data));
        for _ in 0..DRAWS {
            let normal = DVector::from_fn(places.len(), |_, _| random.normal());
            let off = factor.l() * normal;
            for side in [1.0, -1.0] {
                let mut points = self.model.points();
                for (&place, off) in places.iter().zip(off.iter()) {
                    points[place] = (points[place] + side * off).clamp(bounds[place].lowest, bounds[place].highest);
                }
                let mut model = self.model.clone();
                model.set_points(&points);
                draws.push(model);
            }
        }
        draws
    }

    /// Returns all coordinates that the hypothesis may bend to imitate another one: its own, and those of gain, time constant and
    /// share if it has none of their causes.
    pub(super) fn bends(&self, data: &Data, tau_s: f64) -> Vec<Bend> {
        let bounds = self.model.coordinates(data);
        let own = self.places(data).into_iter().enumerate().map(|(index, place)| {
            let range = bounds[place].highest - bounds[place].lowest;
            let posterior = self.covariance.as_ref().map(|matrix| matrix[(index, index)].max(0.0).sqrt());
            let deviation = posterior.map_or(range, |deviation| (POSTERIOR_WIDTHS * deviation).min(range));
            Bend { model: self.model.clone(), place, deviation: deviation.max(f64::MIN_POSITIVE), extra: None }
        });
        let mut bends: Vec<Bend> = own.collect();
        if data.normalisation.start.is_some() {
            return bends;
        }
        for cause in BENDING {
            let effect = index_of(cause).expect("an effect");
            let special = EFFECTS[effect].special_case_of();
            if self.model.blocks.iter().any(|(block, _)| block.cause() == cause || special.contains(&block.cause())) {
                continue;
            }
            let neutral = match cause {
                "gain-error" => 1.0,
                "time-constant" => tau_s.ln(),
                _ => data.normalisation.share,
            };
            let block = Block { effect, form: 0 };
            let model = self.model.with(block, vec![neutral]);
            let before = model.blocks.iter().take_while(|(other, _)| *other != block);
            let place = before.map(|(_, point)| point.len()).sum();
            bends.push(Bend { model, place, deviation: BENT_BY, extra: Some(cause) });
        }
        bends
    }

    /// Returns true if the hypothesis has a cause, or one of which that is a special case.
    pub(super) fn claims(&self, cause: &str) -> bool {
        let special = index_of(cause).map_or(&[][..], |effect| EFFECTS[effect].special_case_of());
        self.model.blocks.iter().any(|(block, _)| block.cause() == cause || special.contains(&block.cause()))
    }
}

#[cfg(test)]
mod tests {
    use simulation::record::{Record, Row};

    use super::*;
    use crate::record::input::Input;

    /// A rate-limited amplifier of a record that may not begin at rest has a voltage before the first row, which the next record has not.
    #[test]
    fn a_state_at_the_beginning_of_the_record_is_left_out_of_the_next_one() {
        let row = |line: usize| Row { line, time_s: line as f64, voltage_v: 0.0, measured: Some(0.0) };
        let record = Record { name: String::new(), rows: (0..100).map(row).collect() };
        let data = Data { initial_state_unknown: false, ..Data::new(&record, Input::Hold) };
        let rival = |point: &[f64]| Rival {
            causes: vec!["amplifier-slew".into(), "gain-error".into()],
            nats: 0.0,
            parameters: Default::default(),
            blocks: [("amplifier-slew", 1, point), ("gain-error", 0, &[0.1])]
                .map(|(cause, form, point)| FittedBlock { cause: cause.into(), form, point: point.to_vec() })
                .into(),
            covariance: (0..4).map(|row| (0..4).map(|column| f64::from(10 * row + column)).collect()).collect(),
        };
        let hypothesis = Hypothesis::of(&rival(&[6.0, 9.0, -158.0]), true, &data, "first.json").unwrap();
        assert_eq!(hypothesis.model.points(), [6.0, 9.0, 0.1]);
        let covariance = hypothesis.covariance.unwrap();
        assert_eq!((covariance.nrows(), covariance[(2, 2)], covariance[(1, 2)]), (3, 33.0, 13.0));
        let error = Hypothesis::of(&rival(&[6.0]), true, &data, "first.json").unwrap_err().to_string();
        assert_eq!(error, "first.json: cause amplifier-slew: 1 numbers; expected 2");
    }
}
