//! Whether a record is diagnosed under a simpler nominal spring than the one that was identified from it.
//!
//! A linear model of high order imitates what is not linear, down to the noise if that is small. Under a spring of lower order it is a
//! cause, which has to prove itself against the model of higher order.

use crate::stats::thresholds::probability::CLEARLY_LIKELIER;

/// Ratio of the held-out errors of a diagnosis under a simpler nominal spring and of the identified one below which no other is needed.
const CLEARLY_BETTER: f64 = 0.8;
/// Ratio of the held-out errors up to which a simpler nominal spring is as good as another.
const AS_GOOD: f64 = 1.02;

/// What a diagnosis under one nominal spring has achieved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Merits {
    /// True if it has findings.
    pub(super) names_causes: bool,
    /// True if it leaves nothing but noise.
    pub(super) explains: bool,
    /// Root mean square of the held-out error, in the reading's unit.
    pub(super) held_out_rmse: f64,
    /// Score of the extended simulation, in nats, as a density of the readings in their own unit.
    pub(super) score: f64,
    /// Number of readings that are known up to an interval.
    pub(super) intervals: usize,
}

impl Merits {
    /// True if causes under a simpler spring explain the record and predict it clearly better than the identified spring without any,
    /// whose held-out error is `identified`, in the reading's unit.
    pub(super) fn need_no_other(&self, identified: f64) -> bool {
        // The error of a reading that is known up to an interval is mostly zero, but not in the error that is given.
        let is_comparable = self.intervals == 0;
        is_comparable && self.names_causes && self.explains && self.held_out_rmse < CLEARLY_BETTER * identified
    }

    /// True if causes under a simpler spring predict held-out segments as well as the diagnosis under the identified one and, where that one
    /// explains the record, are clearly likelier, whether they explain it or not.
    pub(super) fn are_preferred_to(&self, identified: &Self) -> bool {
        let is_as_good = self.names_causes && self.held_out_rmse < AS_GOOD * identified.held_out_rmse;
        is_as_good && (!identified.explains || self.score > identified.score + CLEARLY_LIKELIER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPLAINED: Merits =
        Merits { names_causes: true, explains: true, held_out_rmse: 1.0, score: -500.0, intervals: 0 };

    #[test]
    fn what_explains_a_record_is_given_up_for_what_is_clearly_likelier() {
        let simple = |score, held_out_rmse| Merits { score, held_out_rmse, ..EXPLAINED };
        assert!(simple(-496.0, 1.0).are_preferred_to(&EXPLAINED));
        assert!(!simple(-498.0, 1.0).are_preferred_to(&EXPLAINED), "as likely");
        assert!(!simple(-400.0, 1.1).are_preferred_to(&EXPLAINED), "predicts worse");
        assert!(!Merits { names_causes: false, ..simple(-400.0, 1.0) }.are_preferred_to(&EXPLAINED));
        // Neither explains a record that one of them explains worse than the other describes it.
        assert!(Merits { explains: false, ..simple(-400.0, 0.8) }.are_preferred_to(&EXPLAINED));
    }

    #[test]
    fn where_neither_leaves_noise_alone_the_simpler_spring_is_kept_if_it_predicts_as_well() {
        let unexplained = Merits { explains: false, ..EXPLAINED };
        for explains in [false, true] {
            let simple = Merits { explains, score: -600.0, held_out_rmse: 1.01, ..EXPLAINED };
            assert!(simple.are_preferred_to(&unexplained));
            assert!(!Merits { held_out_rmse: 1.03, ..simple }.are_preferred_to(&unexplained));
        }
    }

    #[test]
    fn no_other_spring_is_tried_after_one_whose_causes_explain_the_record_and_predict_it_clearly_better() {
        assert!(EXPLAINED.need_no_other(1.3));
        assert!(!EXPLAINED.need_no_other(1.2));
        assert!(!Merits { explains: false, ..EXPLAINED }.need_no_other(1.3));
        assert!(!Merits { names_causes: false, ..EXPLAINED }.need_no_other(1.3));
        assert!(!Merits { intervals: 1, ..EXPLAINED }.need_no_other(1.3));
    }
}
