//! What a plant file says and the spring has not.
//!
//! Causes are added to a simulation. A part that should not be in it would need the opposite of a cause: there is none for
//! a memory, and combinations of others pass for it. So, whatever was found, each part that a plant file need not have is
//! taken out as well, and stays out if the record is clearly likelier without it:
//!
//! ```text
//! score(best causes without the part) > score(best causes) + CLEARLY
//! ```

use crate::answer::Verdict;
use crate::examine::{CLEARLY, Options, read};
use crate::fit::engine::Engine;
use crate::plant::base::Base;
use crate::record::data::Data;
use crate::record::observed::Observed;
use crate::search::{Lead, Scored, Search};
use crate::verdict::diagnosis::Diagnosis;
use simulation::record::Record;

/// The same diagnosis, or another without some parts of the plant file.
pub(crate) fn taken_out(
    record: &Record,
    options: &Options,
    data: &Data,
    found: Diagnosis,
    progress: &mut impl FnMut(&Scored),
) -> Diagnosis {
    let Some(mut lead) = found.lead.clone() else { return found };
    let (mut score, mut options) = (found.score, options.clone());
    let mut lacking = Vec::new();
    loop {
        let tried = options.base.without_each().map(|(part, base)| {
            let (score, lead) = best(&base, data, &found.observed, lead.clone(), progress);
            (part, base, score, lead)
        });
        let best = tried.max_by(|a, b| a.2.total_cmp(&b.2)).filter(|best| best.2 > score + CLEARLY);
        let Some((part, base, better, of)) = best else { break };
        lacking.push(part);
        (options.base, score, lead) = (base, better, of);
    }
    if lacking.is_empty() {
        return found;
    }
    let without = read(record, &options, data, progress);
    beside(found, without, lacking)
}

/// Of a search from what another has found.
fn best(base: &Base, data: &Data, observed: &Observed, lead: Lead, progress: &mut impl FnMut(&Scored)) -> (f64, Lead) {
    let mut engine = Engine::new(data, observed, base);
    let mut search = Search::new(&mut engine);
    let best = search.from(lead, progress);
    (best.score, search.lead())
}

/// What was found without some parts, beside the simulation with them.
fn beside(found: Diagnosis, mut without: Diagnosis, lacking: Vec<&'static str>) -> Diagnosis {
    let report = &mut without.report;
    report.baseline = found.report.baseline;
    report.extended.gain = 1.0 - report.extended.quality.held_out_rmse / report.baseline.held_out_rmse.max(1e-12);
    if report.verdict == Verdict::Consistent {
        report.verdict = Verdict::Explained;
    }
    report.take_out = lacking;
    without.baseline = found.baseline;
    let [before, _] = found.held_out;
    without.held_out[0] = before;
    without
}
