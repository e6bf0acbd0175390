//! A diagnosis from beginning to end: all passes over a record, in order.

use anyhow::Result;

use simulation::bad_input;
use simulation::record::Record;

use crate::answer::Report;
use crate::effects::index_of;
use crate::fit::engine::Engine;
use crate::plant::base::Base;
use crate::record::data::{Data, Input};
use crate::record::observed::Observed;
use crate::search::{Lead, Scored, Search};
use crate::verdict::diagnosis::{self, Diagnosis};

mod unsupported_terms;

/// Fewest readings that anything can be said of.
const FEWEST_ROWS: usize = 8;

/// What is not as it usually is has to be likelier by so many nats: readings that were cut off instead of rounded, a part of
/// the plant file that the spring has not.
const CLEARLY: f64 = 3.0;

/// A longer record is searched on a part of its rows first, of about so many.
const LONG: usize = 5_000;
const ROWS_TO_SEARCH: usize = 2_500;

/// How to take a record.
#[derive(Clone, Debug)]
pub struct Options {
    /// What the voltage did between rows.
    pub input: Input,
    /// The simulation to be judged.
    pub base: Base,
}

impl Default for Options {
    /// Held voltage, the paper's plant.
    fn default() -> Self {
        Self { input: Input::Hold, base: Base::paper() }
    }
}

/// Finds out what the simulation gets wrong on a record.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a record without readings or with too few.
pub fn diagnose(record: &Record, options: &Options) -> Result<Report> {
    examine(record, options, |_| ()).map(|diagnosis| diagnosis.report)
}

/// As [`diagnose`], with all that is needed to draw it; `progress` hears of the best causes so far.
///
/// # Errors
/// As [`diagnose`].
pub fn examine(record: &Record, options: &Options, mut progress: impl FnMut(&str)) -> Result<Diagnosis> {
    let data = Data::new(record, options.input);
    if data.rows() < FEWEST_ROWS {
        bad_input!(
            "{}: {} row(s) with a reading; expected at least {FEWEST_ROWS} to tell causes apart",
            record.name,
            data.rows()
        );
    }
    let mut progress = |scored: &Scored| {
        let causes: Vec<&str> = scored.fit.model.blocks.iter().map(|(block, _)| block.cause()).collect();
        progress(&causes.join(", "));
    };
    let found = read(record, options, &data, &mut progress);
    Ok(unsupported_terms::taken_out(record, options, &data, found, &mut progress))
}

/// What a record says, its readings taken as they suit a spring best.
fn read(record: &Record, options: &Options, data: &Data, progress: &mut impl FnMut(&Scored)) -> Diagnosis {
    let observed = Observed::new(data);
    let rounded = judged(record, options, data, &observed, None, progress);
    // No reading tells whether it was rounded or cut off; a spring tells.
    let found = match observed.truncated().filter(|cut| suits(options, data, cut, &rounded)) {
        None => rounded,
        Some(cut) => {
            let cut = judged(record, options, data, &cut, rounded.lead.clone(), progress);
            if cut.score > rounded.score + CLEARLY { cut } else { rounded }
        }
    };
    // A plateau on a lattice looks like a bound until a model is seen that does not go beyond it.
    if found.believes_its_bounds() {
        return found;
    }
    let unbound = found.observed.without_bounds();
    judged(record, options, data, &unbound, found.lead, progress)
}

/// True if readings that were cut off suit the causes that were found without it better, a shift of them apart: that may stand
/// for what was cut off.
fn suits(options: &Options, data: &Data, cut: &Observed, found: &Diagnosis) -> bool {
    let shift = index_of("reading-offset").expect("an effect");
    let model = found.extended.model.without(shift);
    let likelihood = |observed| {
        let mut engine = Engine::new(data, observed, &options.base);
        engine.fit_twice(model.clone()).log_likelihood
    };
    likelihood(cut) > likelihood(&found.observed)
}

/// Searches, from what is `given` or else a long record in part first, and says what it found.
fn judged(
    record: &Record,
    options: &Options,
    data: &Data,
    observed: &Observed,
    given: Option<Lead>,
    progress: &mut impl FnMut(&Scored),
) -> Diagnosis {
    let every = if data.rows() > LONG { data.rows().div_ceil(ROWS_TO_SEARCH) } else { 1 };
    let searched = || {
        let thinned = Data::thinned(record, options.input, every);
        let observed = Observed::new(&thinned).with_conclusions_of(observed);
        let mut engine = Engine::new(&thinned, &observed, &options.base);
        let mut search = Search::new(&mut engine);
        search.run(&mut *progress);
        search.lead()
    };
    let given = given.or_else(|| (every > 1).then(searched));
    let mut engine = Engine::new(data, observed, &options.base);
    let held = options.input == Input::Hold;
    diagnosis::diagnose(data.clone(), observed, &mut engine, held, given, progress)
}
