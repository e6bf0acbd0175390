//! The folds of cross-validation: which rows are held out together.

use crate::stats::thresholds::empirical::{FEW_ROWS, FEWEST_STAIRS, SHORTEST_SEGMENT};
use std::iter;

/// Number of folds; each holds out every [`FOLDS`]-th segment of the record.
const FOLDS: usize = 5;
/// Number of segments of a long record: short compared with the extent of most effects, long compared with the noise's
/// autocorrelation.
const SEGMENTS: usize = 40;

/// Returns the fold of each row: whole stairs of a short record with enough stairs, else segments of equal length in
/// turn.
pub(crate) fn folds(voltage_v: &[f64]) -> Vec<u8> {
    let rows = voltage_v.len();
    if rows < FEW_ROWS.count() {
        let stairs: Vec<usize> = voltage_v.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
        let longest = stairs.iter().copied().max().unwrap_or(0);
        // A stair with half of the rows leaves too little to fit, and the rows of a sweep are no stairs.
        if stairs.len() >= FEWEST_STAIRS.count() && 2 * stairs.len() <= rows && 2 * longest <= rows {
            let most = 2 * FOLDS;
            let of_stair = |(stair, &length): (usize, &usize)| iter::repeat_n((stair % most) as u8, length);
            return stairs.iter().enumerate().flat_map(of_stair).collect();
        }
    }
    folds_of_segments(rows)
}

/// Returns the fold of each of `rows` rows: segments of equal length in turn.
pub(crate) fn folds_of_segments(rows: usize) -> Vec<u8> {
    let length = rows.div_ceil(SEGMENTS).max(SHORTEST_SEGMENT.count());
    // Each round begins with another fold; otherwise one fold would hold out all steps of a stair whose period is one
    // round.
    let fold_of = |stretch: usize| (stretch + 2 * (stretch / FOLDS)) % FOLDS;
    (0..rows).map(|row| fold_of(row / length) as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_records_are_held_out_stair_by_stair_if_they_have_stairs() {
        let stair: Vec<f64> = (0..18).map(|row| f64::from(row / 3)).collect();
        let expected: Vec<u8> = (0..18).map(|row| row / 3).collect();
        assert_eq!(folds(&stair), expected);
        // A sweep and a single step are divided into segments of equal length.
        for record in [(0..60).map(f64::from).collect::<Vec<_>>(), [[0.0; 10], [1.0; 10], [1.0; 10]].concat()] {
            let fold = folds(&record);
            assert!(fold.chunk_by(|a, b| a == b).all(|stretch| stretch.len() == SHORTEST_SEGMENT.count()), "{fold:?}");
            assert_eq!(fold.iter().max(), Some(&(FOLDS as u8 - 1)));
        }
    }

    /// For no period of a schedule, in segments, does one fold hold out all of its steps.
    #[test]
    fn no_fold_holds_out_every_step() {
        let fold = folds(&[0.0; 60 * SEGMENTS]);
        for period in 2..=SEGMENTS / 4 {
            for phase in 0..period {
                let steps: Vec<u8> = fold.iter().copied().step_by(60).skip(phase).step_by(period).collect();
                let most = (0..FOLDS).map(|of| steps.iter().filter(|step| usize::from(**step) == of).count()).max();
                assert!(most.unwrap() < steps.len(), "{period}, {phase}: {steps:?}");
            }
        }
    }
}
