//! The search for the best equation: from the best structures so far, one edit at a time, judged by held-out segments.
//!
//! ```text
//! score = log-likelihood of held-out readings - price per parameter,      price = ln(rows) / 2      [nats]
//! ```
//!
//! The best structure that is among the best [`BEAM`] and was not yet edited is edited next. Of the edits, all are fitted by a few
//! steps, the best of these to the end, and those are predicted on held-out segments.

use crate::equation::grammar::{edits, weighted};
use crate::equation::operator::{Kind, Operator};
use crate::equation::problem::{Fitted, Problem};
use crate::equation::structure::Structure;
use crate::noise::Noise;
use crate::stats::thresholds::probability::RIVAL_ODDS;

/// Number of best structures that are edited.
const BEAM: usize = 3;
/// Number of structures that are edited at most.
const MOST_EDITED: usize = 10;
/// Edits that are fitted to the end.
const FITTED: usize = 8;
/// Rounds of a first fit, of a fit to the end, and of a fit without a fold.
const ROUNDS: (usize, usize, usize) = (3, 14, 3);
/// A first edit that gains less in likelihood, in nats, is no improvement of the beam.
const LEAST_GAIN: f64 = 2.0;

/// An equation with its held-out prediction.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The equation, fitted to all rows.
    pub fit: Fitted,
    /// Reading minus prediction by fits without the segment.
    pub held_out: Vec<f64>,
    /// Held-out log-likelihood less the price of the parameters, in nats.
    pub score: f64,
    edited: bool,
}

/// Returns the equation with the fewest parameters among those that cannot be told from the best one, from several structures;
/// `None` if the work was used up before one was fitted.
pub(super) fn search(problem: &Problem, starts: Vec<Structure>) -> Option<Scored> {
    let used = problem.used(None);
    let rows = problem.reading.len() as f64;
    let price = 0.5 * rows.max(2.0).ln();
    let mean = problem.reading.iter().sum::<f64>() / rows;
    let near: Vec<f64> = problem.reading.iter().map(|reading| reading - mean).collect();
    let scored = |fit: Fitted| {
        let held_out = problem.held_out(&fit, ROUNDS.2);
        let log_likelihood = Noise::robust(&problem.observed.uncensored(&problem.observed.errors(&held_out)))
            .log_likelihood(&held_out, problem.observed);
        let score = log_likelihood - price * fit.structure.parameters(&problem.scale) as f64;
        Scored { fit, held_out, score, edited: false }
    };
    let mut pool: Vec<Scored> =
        starts.into_iter().map(|start| scored(problem.fit(start, &used, &near, ROUNDS.1))).collect();
    for _ in 0..MOST_EDITED {
        pool.sort_by(|a, b| b.score.total_cmp(&a.score));
        let Some(parent) = pool.iter_mut().take(BEAM).find(|of| !of.edited) else { break };
        if problem.budget.is_over() {
            break;
        }
        parent.edited = true;
        let parent = parent.fit.clone();
        let worth = |fit: &Fitted| fit.value - price * fit.structure.parameters(&problem.scale) as f64;
        let mut tried: Vec<Fitted> = Vec::new();
        for edit in edits(&parent, problem) {
            if problem.budget.is_over() {
                break;
            }
            let evaluated = edit.into_iter().map(|start| problem.evaluate(start, &used, &parent.residual).0);
            let Some(best) = evaluated.max_by(|a, b| a.value.total_cmp(&b.value)) else { continue };
            tried.push(problem.fit(weighted(&best), &used, &parent.residual, ROUNDS.0));
        }
        tried.retain(|fit| worth(fit) > worth(&parent) + LEAST_GAIN || is_smaller(fit, &parent, problem));
        tried.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
        tried.truncate(FITTED);
        for fit in tried {
            if problem.budget.is_over() {
                break;
            }
            let near = fit.residual.clone();
            let fit = problem.fit(weighted(&fit), &used, &near, ROUNDS.1);
            let found = scored(fit);
            let known = pool.iter_mut().find(|of| signature(&of.fit.structure) == signature(&found.fit.structure));
            match known {
                Some(known) if known.score < found.score => *known = Scored { edited: known.edited, ..found },
                Some(_) => (),
                None => pool.push(found),
            }
        }
    }
    pool.retain(|of| of.score.is_finite());
    let best = pool.iter().map(|of| of.score).max_by(f64::total_cmp)?;
    let near_best = pool.into_iter().filter(|of| of.score >= best - RIVAL_ODDS);
    near_best.min_by_key(|of| of.fit.structure.parameters(&problem.scale))
}

fn is_smaller(fit: &Fitted, parent: &Fitted, problem: &Problem) -> bool {
    let parameters = |of: &Fitted| of.structure.parameters(&problem.scale) as f64;
    let (fewer, lost) = (parameters(parent) - parameters(fit), parent.value - fit.value);
    fewer > 0.0 && lost < 0.5 * (problem.reading.len() as f64).ln() * fewer
}

/// The kinds of the operators in their places, which tell two structures apart.
fn signature(structure: &Structure) -> String {
    fn of(operator: &Operator) -> String {
        let mut chains: Vec<String> =
            operator.chains.iter().map(|chain| chain.iter().map(of).collect::<Vec<_>>().join(">")).collect();
        if operator.kind == Kind::Parallel {
            chains.sort();
        }
        format!("{:?}({})", operator.kind, chains.join("|"))
    }
    let chain: Vec<String> = structure.chain.iter().map(of).collect();
    let terms: Vec<String> = structure.terms.iter().map(|term| format!("{term:?}").chars().take(3).collect()).collect();
    format!("{} + {}", chain.join(">"), terms.join("+"))
}
