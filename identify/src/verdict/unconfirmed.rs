//! A change of the last readings, which none after it confirms.

use crate::answer::Finding;
use crate::fit::engine::{Engine, Fit};
use crate::verdict::credibility;

/// Time in which a spring has settled after a change of the voltage has arrived, in time constants.
const SETTLED: f64 = 3.0;
/// Longest such time that counts, in lengths of the record: of more readings the record itself is the judge.
const LONGEST: f64 = 0.1;
/// What is added to the evidence.
const EVIDENCE: &str = "; it lasts to the end of the record, and for no longer than the spring takes to settle, so that an error of the \
                        simulation would look the same";

/// Lowers the probability of a cause that changes the last readings alone, for no longer than the spring takes to settle.
pub(crate) fn weigh(engine: &Engine, extended: &Fit, findings: &mut [Finding]) {
    let data = engine.data;
    let chain = extended.model.chain(engine.base(), data);
    let end_s = data.time_s[data.rows() - 1];
    let settling_s = chain.delay_s + SETTLED * chain.relaxation.tau_s;
    let longest_s = settling_s.min(LONGEST * (end_s - data.time_s[0]));
    let is_short = |first: usize| end_s - data.time_s[first] < longest_s;
    for (block, point) in &extended.model.blocks {
        let last = block.effect().first_of_last_rows(block.form, point, data);
        let finding = findings.iter_mut().find(|finding| finding.cause == block.cause());
        if let Some(finding) = finding.filter(|_| last.is_some_and(is_short)) {
            credibility::of_unconfirmed(finding);
            finding.evidence.push_str(EVIDENCE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use simulation::record::{Record, Row};

    /// Probability and evidence of a shift in a record of 400 s, of a spring with a time constant of 5.5 s, and a delay if it is
    /// not 0.
    fn weighed(form: usize, point: &[f64], delay_s: f64) -> (f64, String) {
        let row = |row: usize| Row {
            line: row,
            time_s: row as f64,
            voltage_v: [300.0, 100.0][row / 50 % 2],
            measured: Some((row % 7) as f64),
        };
        let data = Data::new(&Record { name: String::new(), rows: (0..400).map(row).collect() }, Input::Hold);
        let (observed, base) = (Observed::new(&data), Base::paper());
        let mut engine = Engine::new(&data, &observed, &base);
        let block = |cause, form| Block { effect: index_of(cause).unwrap(), form };
        let mut model = Model::default().with(block("reading-offset", form), point.to_vec());
        if delay_s > 0.0 {
            model = model.with(block("delay", 0), vec![delay_s, 0.0]);
        }
        let extended = engine.evaluate(model);
        let finding = |cause| Finding {
            cause,
            probability: 0.9,
            parameters: Vec::new(),
            rmse_before: 2.0,
            rmse_after: 1.0,
            evidence: String::new(),
            proved: false,
        };
        let mut findings = [finding("hysteresis"), finding("reading-offset")];
        weigh(&engine, &extended, &mut findings);
        let [other, shift] = findings;
        assert!(other.probability == 0.9 && other.evidence.is_empty());
        (shift.probability, shift.evidence)
    }

    #[test]
    fn a_shift_of_the_last_readings_alone_is_less_likely_unless_it_is_long() {
        let (run, decay, ramps) = (0, 3, 4);
        for (form, point) in [(run, [390.0, 400.0, 4.0].as_slice()), (ramps, &[390.0, 400.0, 3.0, 0.0, 4.0])] {
            let (probability, evidence) = weighed(form, point, 0.0);
            assert!(probability < 0.5 && evidence == EVIDENCE, "form {form}: {probability} {evidence}");
        }
        assert!(weighed(decay, &[390.0, 2f64.ln(), 4.0], 0.0).0 < 0.5);
        for point in [[380.0, 400.0, 4.0], [370.0, 380.0, 4.0], [0.0, 10.0, 4.0]] {
            assert_eq!(weighed(run, &point, 0.0), (0.9, String::new()), "{point:?}");
        }
        // A change of the voltage arrives later.
        assert!(weighed(run, &[380.0, 400.0, 4.0], 8.0).0 < 0.5);
        // However long the delay is, a tenth of the record is enough.
        assert_eq!(weighed(run, &[359.0, 400.0, 4.0], 39.0).0, 0.9);
    }
}
