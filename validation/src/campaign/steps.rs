//! Plain step experiments: each cause that such a record can show, gain and time constant off together, and no effect.

use super::case::{Case, Expected};
use super::part::seed;
use crate::ground_truth::Cause;
use crate::ground_truth::plain_steps::PlainSteps;

/// `count` records of each shape and length, without an effect, with each cause that it carries, and with a gain error and another
/// time constant together.
pub fn cases(first: u64, count: usize) -> Vec<Case> {
    let singles = Cause::ALL.map(|cause| vec![cause]);
    let sets = singles.into_iter().chain([vec![Cause::GainError, Cause::TimeConstant], vec![]]);
    let each = sets.flat_map(|causes| PlainSteps::all().into_iter().map(move |plain| (causes.clone(), plain)));
    let carried = each.filter(|(causes, plain)| causes.iter().all(|&cause| plain.carries(cause)));
    let repeated = carried.flat_map(|case| std::iter::repeat_n(case, count));
    repeated.enumerate().map(|(index, (causes, plain))| of(causes, plain, seed(first, 16, index))).collect()
}

fn of(causes: Vec<Cause>, plain: PlainSteps, seed: u64) -> Case {
    let names: Vec<_> = causes.iter().map(|cause| cause.name()).collect();
    Case {
        group: if names.is_empty() { "no effect".to_owned() } else { names.join(" + ") },
        kinds: vec![plain.name()],
        seed,
        expected: Expected::exactly(&causes),
        draw: Box::new(move |seed| plain.draw(&causes, seed).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_is_in_some_record_and_every_shape_has_records_without_an_effect() {
        let cases = cases(1, 2);
        for cause in Cause::ALL {
            assert!(cases.iter().any(|case| case.group == cause.name()), "{cause}");
        }
        let count = |group: &str| cases.iter().filter(|case| case.group == group).count();
        assert_eq!((count("no effect"), count("gain-error + time-constant")), (16, 16));
        assert_eq!(count("static-nonlinearity"), 8, "on two and three levels");
    }
}
