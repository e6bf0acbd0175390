//! First fits of a structure's extensions: fewer and fewer of them are fitted further and further (successive halving, Jamieson
//! and Talwalkar, *AISTATS* 2016).
//!
//! | which | fit |
//! | --- | --- |
//! | every form from every start that is worth fitting | two rounds, the derivatives of the extended fit kept |
//! | of these, the best of each effect and all among the best eight | up to four more rounds of the same kind |
//! | of these, the best of each effect and all among the best four | evaluated |
//! | the best six of these | before, completed with derivatives of their own and across discontinuities |
//!
//! Each step ends with its part of the work that is left, so that a search which cannot afford all of them has results of some.

use std::collections::HashSet;

use crate::effects::model::Block;
use crate::fit::engine::{Approach, Engine, Fit};
use crate::noise::Noise;

/// Extensions among this many best ones are fitted beyond their first rounds, and the best of each effect.
const FURTHER: usize = 8;
/// Extensions among this many best ones are evaluated, and the best of each effect.
const EVALUATED: usize = 4;
/// Number of extensions that are completed.
const COMPLETED: usize = 6;

/// Parts of the work that is left for the search, after which no more is fitted in the first rounds, in further ones, and evaluated; the
/// rest is for what follows the first fits.
const ROUNDS_END: [f64; 3] = [1.0 / 3.0, 1.0 / 2.0, 2.0 / 3.0];

/// A block that is added to a structure, before it is fitted.
pub(super) struct Start {
    pub(super) block: Block,
    pub(super) point: Vec<f64>,
    /// The price of the block, in nats.
    pub(super) price: f64,
}

/// An extension while it is fitted.
struct Runner {
    effect: usize,
    price: f64,
    approach: Approach,
}

/// Returns first fits of a structure's extensions under the law `law`: the best one of each effect and a few others, the best first. The
/// starts that promise most come first, in case the work does not suffice for all.
pub(super) fn first_fits(engine: &mut Engine, fit: &Fit, law: &Noise, starts: Vec<Start>) -> Vec<Fit> {
    let known = engine.known(fit, law);
    let (left, before) = (engine.budget().work_left() as f64, engine.budget().spent());
    let has_ended = |engine: &Engine, part: f64| {
        engine.budget().is_over() || (engine.budget().spent() - before) as f64 > part * left
    };
    let [first_end, further_end, evaluated_end] = ROUNDS_END;
    let mut runners = Vec::new();
    for Start { block, point, price } in starts {
        if has_ended(engine, first_end) {
            break;
        }
        let approach = engine.approached(fit.model.with(block, point), law, &known);
        runners.push(Runner { effect: block.effect, price, approach });
    }
    retain_best(&mut runners, FURTHER);
    for runner in &mut runners {
        if !has_ended(engine, further_end) {
            engine.approach_further(&mut runner.approach, law, &known);
        }
    }
    retain_best(&mut runners, EVALUATED);
    let mut fits = Vec::new();
    for (rank, Runner { effect, approach, .. }) in runners.into_iter().enumerate() {
        if has_ended(engine, evaluated_end) {
            break;
        }
        fits.push(match rank < COMPLETED {
            true => engine.completed(approach.model, law, effect),
            false => engine.evaluate(approach.model),
        });
    }
    fits
}

/// Sorts by likelihood less price, the best first, and retains the best of each effect and the `most` best ones.
fn retain_best(runners: &mut Vec<Runner>, most: usize) {
    let score = |runner: &Runner| runner.approach.log_likelihood - runner.price;
    runners.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let (mut rank, mut seen) = (0, HashSet::new());
    runners.retain(|runner| {
        rank += 1;
        seen.insert(runner.effect) || rank <= most
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::model::Model;
    use crate::fit::budget::{Budget, Effort};
    use crate::fit::stop::Stop;
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::search::evaluator::{Breadth, Evaluator};
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// The paper's spring under a stair, with a gain that falls by a fifth.
    fn drifting() -> Data {
        const ROWS: usize = 600;
        let mut lag = 0.0;
        let noise = normals(ROWS);
        let row = |row: usize| {
            let voltage_v = 100.0 * (row / 60 % 6) as f64;
            let time_s = 0.5 * row as f64;
            let stiffness = (voltage_v / 11.0 + lag * 10.0 / 11.0) * (1.0 - 0.2 * row as f64 / ROWS as f64);
            lag += (voltage_v - lag) * -f64::exp_m1(-0.5 / 5.5);
            Row { line: row, time_s, voltage_v, measured: Some(stiffness + noise[row]) }
        };
        Data::new(&Record { name: String::new(), rows: (0..ROWS).map(row).collect() }, Input::Hold)
    }

    /// First fits of all causes beside the simulation as it is given with a part of the work of a normal search, and the part that they
    /// took.
    fn fitted(data: &Data, part: f64) -> (Vec<Fit>, f64) {
        let (observed, base) = (Observed::new(data), Base::paper());
        let budget = Budget::part(part, Effort::Normal, data.rows(), Stop::default());
        let mut engine = Engine::within(data, &observed, &base, &budget);
        let nominal = engine.evaluate(Model::default());
        let breadth = Breadth { exhaustive: true, ..Breadth::default() };
        let fits = Evaluator::extended(&mut engine, &nominal, breadth, &|_| true);
        (fits, part * budget.spent() as f64 / budget.total() as f64)
    }

    #[test]
    fn work_that_does_not_suffice_for_all_starts_suffices_for_the_most_promising() {
        let data = drifting();
        let (all, work) = fitted(&data, 1.0);
        let (some, less) = fitted(&data, 0.4 * work);
        assert!(less < work && all.len() > 5, "{less} of {work}, {} fits", all.len());
        let names = |fits: &[Fit]| fits.iter().map(|fit| fit.model.blocks[0].0.cause()).collect::<Vec<_>>();
        let (all, some) = (names(&all), names(&some));
        assert_eq!((all[0], some[0]), ("drift", "drift"), "{all:?} {some:?}");
    }
}
