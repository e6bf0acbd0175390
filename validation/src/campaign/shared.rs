//! Pairs of causes that [`part::pairs`](super::part::pairs) leaves out because they share a stage of the chain, and pairs that can
//! mimic each other across stages.

use super::case::{Case, Expected};
use super::part::seed;
use crate::ground_truth::Cause::{self, *};
use crate::ground_truth::record::Recipe;

/// Pairs of different stages whose effects on a record are alike, at least on some schedules.
const MIMICS: [[Cause; 2]; 18] = [
    // What is static and linear.
    [GainError, ChargeLeakage],
    [GainError, Drift],
    [GainError, SecondRelaxation],
    [GainError, AmplifierLimit],
    [GainError, InstantaneousShare],
    // What bends or bounds the curve.
    [StaticNonlinearity, AmplifierLimit],
    [StaticNonlinearity, SensorSaturation],
    [StaticNonlinearity, VoltageDependentTimeConstant],
    [AmplifierLimit, SensorSaturation],
    // What makes the response lag.
    [Hysteresis, TimeConstant],
    [Hysteresis, SecondRelaxation],
    [Hysteresis, AmplifierSlew],
    [InstantaneousShare, Delay],
    [InstantaneousShare, AmplifierSlew],
    [TimeConstant, Delay],
    [TimeConstant, AmplifierSlew],
    // What goes with the time or oscillates.
    [Drift, ReadingOffset],
    [Resonance, Hum],
];

/// All pairs of the set: of the same stage, then the mimics.
///
/// A time constant together with a voltage-dependent one is not among them: the latter has any mean.
pub fn pairs() -> Vec<[Cause; 2]> {
    let after = |(i, &a): (usize, &Cause)| Cause::ALL[i + 1..].iter().map(move |&b| [a, b]).collect::<Vec<_>>();
    let same_stage = Cause::ALL.iter().enumerate().flat_map(after).filter(|[a, b]| a.block() == b.block());
    same_stage.filter(|pair| *pair != [TimeConstant, VoltageDependentTimeConstant]).chain(MIMICS).collect()
}

/// `count` records of every pair, each at full size and at half of it; 2401 rows, white noise of 0.2 %.
pub fn cases(first: u64, count: usize) -> Vec<Case> {
    let sizes = [("full size", 1.0), ("half size", 0.5)];
    let each = pairs().into_iter().flat_map(|pair| (0..count).flat_map(move |_| sizes.map(|size| (pair, size))));
    each.enumerate().map(|(index, (pair, (kind, size)))| of(pair, kind, size, seed(first, 15, index))).collect()
}

fn of(pair: [Cause; 2], kind: &str, size: f64, seed: u64) -> Case {
    Case {
        group: pair.map(Cause::name).join(" + "),
        kinds: vec![kind.to_owned()],
        seed,
        expected: Expected::exactly(&pair),
        draw: Box::new(move |seed| Recipe::of(&pair).draw(seed).at(size).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_of_a_stage_and_mimics_are_all_there_once() {
        let mut names: Vec<_> = cases(1, 1).into_iter().map(|case| case.group).collect();
        names.dedup();
        // 3 of the amplifier, 3 static, 28 of the relaxation less one, 10 of the readings.
        assert_eq!(names.len(), 3 + 3 + 27 + 10 + MIMICS.len());
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), pairs().len(), "no pair twice");
        assert!(MIMICS.iter().all(|[a, b]| a.block() != b.block()), "the others are there already");
    }

    #[test]
    fn both_effects_of_every_pair_are_in_its_record() {
        for case in cases(3, 1) {
            let hidden = (case.draw)(case.seed).hidden;
            let size = if case.kinds == ["full size"] { 1.0 } else { 0.5 };
            assert!(hidden.effects.len() == 2 && hidden.effects.iter().all(|effect| effect.size == size), "{case:?}");
            for effect in &hidden.effects {
                let kept: Vec<_> = hidden.effects.iter().filter(|other| *other != effect).cloned().collect();
                let without =
                    crate::ground_truth::LabelledRecord::new(hidden.schedule.clone(), kept, hidden.noise, hidden.seed);
                let squares: f64 =
                    hidden.readings.read.iter().zip(&without.readings.read).map(|(a, b)| (a - b).powi(2)).sum();
                // In units of the noise's variance: far beyond what a likelihood-ratio test needs.
                assert!(squares > 50.0 * hidden.noise.sigma_v.powi(2), "{case:?}: {} adds {squares}", effect.cause);
            }
        }
    }
}
