//! The search for the best equation: from the best structures so far, one edit at a time, judged by held-out segments.
//!
//! ```text
//! score = log-likelihood of held-out readings - price per parameter,      price = ln(rows) / 2      [nats]
//! ```
//!
//! The best structure that is among the best `BEAM` and was not yet edited is edited next, in turn among all structures and among
//! those that were made from the first start, the simulation as it is given. Of the edits, all are fitted by a few steps, the best of
//! these to the end, and those are predicted on held-out segments.

use crate::equation::fitted::Fitted;
use crate::equation::grammar::edits;
use crate::equation::kind::Kind;
use crate::equation::operator::Operator;
use crate::equation::problem::Problem;
use crate::equation::smaller::taken_out;
use crate::equation::structure::Structure;
use crate::noise::Noise;
use crate::stats::thresholds::probability::RIVAL_ODDS;

/// Number of best structures that are edited, beside the starts.
const BEAM: usize = 3;
/// Number of structures that are edited at most.
const MOST_EDITED: usize = 12;
/// Edits that are fitted by a few steps, and to the end.
const FITTED: (usize, usize) = (20, 8);
/// Rounds of a fit: of every edit, of the better ones, to the end, and without a fold.
const ROUNDS: (usize, usize, usize, usize) = (1, 3, 14, 3);
/// Nats that a part of an equation has to gain beyond its price to stay: the odds against an equal rival, and the logarithm of the
/// number of edits among which it was chosen, about 80.
const NEEDED: f64 = RIVAL_ODDS + 4.4;
/// Share of the work for the search; the rest is for taking out what the best equation does not need.
const SHARE_OF_SEARCH: f64 = 0.75;

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
    /// True if it was made from the first start.
    of_first_start: bool,
}

/// Returns the best equation that edits of several structures lead to, without what it does not need; `None` if no structure could be
/// fitted.
pub(super) fn search(problem: &Problem, starts: Vec<Structure>) -> Option<Scored> {
    problem.budget.grant(SHARE_OF_SEARCH);
    let search = Search::new(problem);
    let mean = problem.reading.iter().sum::<f64>() / problem.reading.len() as f64;
    let near: Vec<f64> = problem.reading.iter().map(|reading| reading - mean).collect();
    let fitted = starts.into_iter().map(|start| search.scored(problem.fit(start, &search.used, &near, ROUNDS.2)));
    let mut pool: Vec<Scored> = fitted.collect();
    if let Some(first) = pool.first_mut() {
        first.of_first_start = true;
    }
    for edited in 0..MOST_EDITED {
        pool.sort_by(|a, b| b.score.total_cmp(&a.score));
        let best = |of: &&mut Scored| !of.edited;
        let next = match edited % 2 {
            0 => pool.iter_mut().filter(|of| of.of_first_start).take(BEAM).find(best),
            _ => None,
        };
        let next = match next {
            Some(next) => Some(next),
            None => pool.iter_mut().take(BEAM).find(best),
        };
        let Some(parent) = next.filter(|_| !problem.budget.is_over()) else { break };
        parent.edited = true;
        let (parent, of_first_start) = (parent.fit.clone(), parent.of_first_start);
        search.edit(&parent, of_first_start, &mut pool);
    }
    pool.retain(|of| of.score.is_finite());
    let best = pool.into_iter().max_by(|a, b| a.score.total_cmp(&b.score))?;
    problem.budget.grant(1.0);
    Some(search.without_needless(best))
}

struct Search<'p, 'a> {
    problem: &'p Problem<'a>,
    used: Vec<bool>,
}

impl<'p, 'a> Search<'p, 'a> {
    fn new(problem: &'p Problem<'a>) -> Self {
        Self { problem, used: problem.used(None) }
    }

    /// Log-likelihood of the rows that were fitted, less the price of the parameters.
    fn worth(&self, fit: &Fitted) -> f64 {
        fit.value - self.problem.price(&fit.structure)
    }

    fn scored(&self, fit: Fitted) -> Scored {
        let observed = self.problem.observed;
        let held_out = self.problem.held_out(&fit, ROUNDS.3);
        let law = Noise::robust(&observed.uncensored(&observed.errors(&held_out)));
        let score = law.log_likelihood(&held_out, observed) - self.problem.price(&fit.structure);
        Scored { fit, held_out, score, edited: false, of_first_start: false }
    }

    fn refined(&self, fit: &Fitted, rounds: usize) -> Fitted {
        self.problem.fit(fit.weighted(), &self.used, &fit.residual, rounds)
    }

    /// Adds the best edits of an equation to the pool.
    fn edit(&self, parent: &Fitted, of_first_start: bool, pool: &mut Vec<Scored>) {
        let problem = self.problem;
        let mut tried: Vec<Fitted> = Vec::new();
        for edit in edits(parent, problem) {
            if problem.budget.is_over() {
                return;
            }
            let evaluated = edit.into_iter().map(|start| problem.evaluate(start, &self.used, &parent.residual).0);
            if let Some(best) = evaluated.max_by(|a, b| a.value.total_cmp(&b.value)) {
                tried.push(self.refined(&best, ROUNDS.0));
            }
        }
        for (count, rounds) in [(FITTED.0, ROUNDS.1), (FITTED.1, ROUNDS.2)] {
            tried.sort_by(|a, b| self.worth(b).total_cmp(&self.worth(a)));
            tried.truncate(count);
            tried = tried.iter().map(|fit| self.refined(fit, rounds)).collect();
        }
        let price = |fit: &Fitted| problem.price(&fit.structure);
        let needed = |fit: &Fitted| if price(fit) > price(parent) { NEEDED } else { -NEEDED };
        tried.retain(|fit| self.worth(fit) > self.worth(parent) + needed(fit));
        for fit in tried {
            if problem.budget.is_over() {
                return;
            }
            let key = signature(&fit.structure);
            let known = pool.iter_mut().find(|of| signature(&of.fit.structure) == key);
            match known {
                Some(known) if known.fit.value >= fit.value => (),
                Some(known) => {
                    let of_first_start = of_first_start || known.of_first_start;
                    *known = Scored { edited: known.edited, of_first_start, ..self.scored(fit) };
                }
                None => pool.push(Scored { of_first_start, ..self.scored(fit) }),
            }
        }
    }

    /// Takes out, one after the other, what an equation predicts as well without.
    fn without_needless(&self, mut best: Scored) -> Scored {
        loop {
            if self.problem.budget.is_over() {
                return best;
            }
            let smaller = taken_out(&best.fit, self.problem).into_iter().map(|structure| {
                let near = &best.fit.residual;
                self.scored(self.problem.fit(structure, &self.used, near, ROUNDS.2))
            });
            let smaller = smaller.max_by(|a, b| a.score.total_cmp(&b.score));
            match smaller.filter(|of| of.score > best.score - NEEDED) {
                Some(smaller) => best = smaller,
                None => return best,
            }
        }
    }
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
