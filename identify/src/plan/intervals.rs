//! 95 % intervals of parameters before and after an experiment, by the delta method.

use simulation::units::Units;

use crate::effects::effect::Quantity;
use crate::plan::answer::Sharper;
use crate::plan::candidate::Commands;
use crate::plan::design::Bend;
use crate::plan::separation::Design;
use crate::stats::thresholds::probability::Z;

/// Returns the intervals of the parameters of the likeliest hypothesis, and of gain, time constant and share.
pub(super) fn intervals(design: &Design, commands: &Commands) -> Vec<Sharper> {
    let Some(after) = design.posterior(commands) else { return Vec::new() };
    let (data, _) = design.record(commands, false);
    let (hypothesis, bends) = (&design.hypotheses[0], &design.bends[0]);
    let scales = &data.normalisation.scales;
    let units = Units { reading: design.reading_unit.clone(), ..Units::default() };
    let mut intervals = Vec::new();
    let mut index = 0;
    while index < bends.len() {
        // All coordinates of one block follow each other.
        let (block, first) = bends[index].block();
        let same = |bend: &&Bend| bend.extra == bends[index].extra && bend.block() == (block, first);
        let members = index..index + bends[index..].iter().take_while(same).count();
        let (of_block, point) = &bends[index].model.blocks[block];
        let quantities = |point: &[f64]| of_block.effect().quantities(of_block.form, point, &data);
        for (number, Quantity { name, dimension, value, .. }) in quantities(point).into_iter().enumerate() {
            let slope = |member: usize| {
                let (mut moved, place) = (point.clone(), bends[member].place - first);
                let step = 1e-5 * (1.0 + point[place].abs());
                moved[place] += step;
                (quantities(&moved)[number].value - value) / step
            };
            let slopes: Vec<f64> = members.clone().map(slope).collect();
            let half = |entry: &dyn Fn(usize, usize) -> f64| {
                let terms = members
                    .clone()
                    .zip(&slopes)
                    .flat_map(|(a, of_a)| members.clone().zip(&slopes).map(move |(b, of_b)| (a, b, of_a * of_b)));
                let variance: f64 = terms.map(|(a, b, slopes)| slopes * entry(a, b)).sum();
                Z * scales.size(dimension).abs() * variance.max(0.0).sqrt()
            };
            // The coordinates of the hypothesis are the first of those that it may bend.
            let known = hypothesis.covariance.as_ref().filter(|matrix| members.end <= matrix.nrows());
            intervals.push(Sharper {
                cause: of_block.cause().to_owned(),
                parameter: name,
                value: scales.restored(dimension, value),
                now: known.map(|matrix| half(&|a, b| matrix[(a, b)])),
                planned: half(&|a, b| bends[a].deviation * bends[b].deviation * after[(a, b)]),
                unit: dimension.unit(&units),
            });
        }
        index = members.end;
    }
    intervals
}
