//! The search alone, on an evaluator with tabulated log-likelihoods.

use std::collections::BTreeSet;

use crate::effects::model::{Block, Model};
use crate::effects::{EFFECTS, index_of};
use crate::fit::engine::Fit;
use crate::noise::Noise;
use crate::search::evaluator::{Breadth, Forms};
use crate::search::{Evaluator, Search, WarmStart, effects};

/// Price of every block, in nats.
const PRICE: f64 = 10.0;

/// Log-likelihoods of sets of causes; another set has that of its best subset and 1 nat for every further cause.
struct Tabulated {
    worth: Vec<(BTreeSet<usize>, f64)>,
    penalty_factor: f64,
    /// Misfit of form at a noise floor of 1 V, in nats.
    misfit: f64,
    /// Effect without which noise of 10 V is left.
    quiet: Option<usize>,
    /// Log-likelihood from which nothing but noise is left.
    clean: f64,
    /// Effect that only an exhaustive search finds.
    hidden: Option<usize>,
    /// Effect that also has a form that is seldom needed, and the log-likelihood of every set with it.
    rare: Option<(usize, f64)>,
    /// True if the noise's autocorrelation follows all errors until nothing but noise is left.
    is_followed: bool,
    /// Effect that cannot be distinguished from another cause.
    another: Option<usize>,
    /// Effect that may belong to the nominal spring, and the part of its price that does not count in a comparison, in nats.
    of_nominal: Option<(usize, f64)>,
    /// Number of fits; evaluations at a given point are not counted.
    fits: isize,
    /// Number of fits at which the search has to end.
    most_fits: isize,
    /// Number of further fits with which it may go on.
    further_fits: isize,
}

fn effect(cause: &str) -> usize {
    index_of(cause).unwrap()
}

fn tabulated(worth: &[(&[&str], f64)]) -> Tabulated {
    let set = |causes: &[&str]| causes.iter().map(|cause| effect(cause)).collect();
    Tabulated {
        worth: worth.iter().map(|(causes, worth)| (set(causes), *worth)).collect(),
        penalty_factor: 1.0,
        misfit: 0.0,
        quiet: None,
        clean: f64::INFINITY,
        hidden: None,
        rare: None,
        is_followed: false,
        another: None,
        of_nominal: None,
        fits: 0,
        most_fits: isize::MAX,
        further_fits: 0,
    }
}

/// The form of an effect that is seldom needed.
fn rare_form(effect: usize) -> Block {
    Block { effect, form: 1 }
}

impl Evaluator for Tabulated {
    fn fit(&mut self, model: Model) -> Fit {
        self.fits += 1;
        let has: BTreeSet<usize> = effects(&model).into_iter().collect();
        let of_part = self.worth.iter().filter(|(part, _)| part.is_subset(&has));
        let log_likelihood =
            of_part.map(|(part, worth)| worth + (has.len() - part.len()) as f64).fold(has.len() as f64, f64::max);
        let is_rare = |effect| model.blocks.iter().any(|(block, _)| *block == rare_form(effect));
        let of_rare = self.rare.filter(|(effect, _)| is_rare(*effect)).map(|(_, worth)| worth);
        let log_likelihood = of_rare.map_or(log_likelihood, |worth| log_likelihood.max(worth));
        let white_noise_log_likelihood = log_likelihood;
        // What causes add under independent noise adds little where an autoregression follows it, until nothing else is left.
        let is_followed = self.is_followed && log_likelihood < self.clean;
        let log_likelihood = if is_followed { log_likelihood.min(1.0) } else { log_likelihood };
        let mut noise = Noise::default_robust();
        if is_followed {
            noise.autocorrelation.ar = vec![0.9];
        }
        noise.marginal = if self.quiet.is_none_or(|effect| has.contains(&effect)) { 1.0 } else { 10.0 };
        Fit { model, residual: Vec::new(), noise, log_likelihood, white_noise_log_likelihood, initial_state_cost: 0.0 }
    }

    fn is_another_cause(&self, block: &Block, _: &[f64], _: f64) -> bool {
        self.another == Some(block.effect)
    }

    fn at(&mut self, model: Model) -> Fit {
        self.fits -= 1;
        self.fit(model)
    }

    fn refit(&mut self, first: Fit) -> Fit {
        first
    }

    fn held_out(&mut self, fit: &Fit) -> f64 {
        fit.log_likelihood
    }

    fn extended(
        &mut self,
        fit: &Fit,
        Breadth { exhaustive, forms }: Breadth,
        wanted: &dyn Fn(usize) -> bool,
    ) -> Vec<Fit> {
        if forms == Forms::Rare {
            let rare = self.rare.map(|(effect, _)| effect).filter(|effect| wanted(*effect));
            return rare.into_iter().map(|effect| self.fit(fit.model.with(rare_form(effect), Vec::new()))).collect();
        }
        let tried = |effect: &usize| wanted(*effect) && (exhaustive || self.hidden != Some(*effect));
        let blocks =
            (0..EFFECTS.len()).filter(tried).collect::<Vec<_>>().into_iter().map(|effect| Block { effect, form: 0 });
        blocks.map(|block| self.fit(fit.model.with(block, Vec::new()))).collect()
    }

    fn price(&self, _: &Block) -> f64 {
        PRICE
    }

    fn excess_price(&self, block: &Block) -> f64 {
        self.of_nominal.filter(|(effect, _)| *effect == block.effect).map_or(0.0, |(_, excess)| excess)
    }

    fn misfit(&self, _: &Fit, times: f64, floor_v: f64) -> f64 {
        times * self.misfit / (floor_v * floor_v)
    }

    fn doubts(&mut self, fit: &Fit) -> bool {
        fit.log_likelihood < self.clean
    }

    fn penalty_factor(&mut self, _: &Fit) -> f64 {
        self.penalty_factor
    }

    fn found_adequate(&mut self) {}

    fn go_on(&mut self, _: &Fit) -> bool {
        let may = self.is_over() && self.further_fits > 0;
        self.most_fits += std::mem::take(&mut self.further_fits);
        may
    }

    fn is_scarce(&self) -> bool {
        2 * self.fits >= self.most_fits
    }

    fn is_over(&self) -> bool {
        self.fits >= self.most_fits
    }
}

fn found(evaluator: &mut Tabulated) -> Vec<&'static str> {
    let best = Search::new(evaluator).run(|_| ());
    best.fit.model.blocks.iter().map(|(block, _)| block.cause()).collect()
}

#[test]
fn a_block_is_added_if_it_gains_more_than_its_price() {
    assert!(found(&mut tabulated(&[])).is_empty());
    assert!(found(&mut tabulated(&[(&["hum"], 0.9 * PRICE)])).is_empty());
    let mut evaluator = tabulated(&[(&["delay"], 50.0), (&["hum"], 30.0), (&["delay", "hum"], 80.0)]);
    assert_eq!(found(&mut evaluator), ["delay", "hum"]);
    // Each structure is fitted once for each that it extends, and evaluated once.
    assert!(evaluator.fits < 200, "{} fits", evaluator.fits);
}

#[test]
fn a_search_whose_work_ends_with_structure_left_goes_on() {
    let worth: &[(&[&str], f64)] = &[(&["delay"], 50.0), (&["hum"], 30.0), (&["delay", "hum"], 80.0)];
    let with = |further_fits, clean| Tabulated { most_fits: 30, further_fits, clean, ..tabulated(worth) };
    assert_eq!(found(&mut with(0, 70.0)), ["delay"], "its work has ended it");
    assert_eq!(found(&mut with(200, 70.0)), ["delay", "hum"]);
    let mut evaluator = with(200, 50.0);
    assert_eq!(found(&mut evaluator), ["delay"]);
    assert_eq!(evaluator.further_fits, 200, "it leaves no structure");
}

#[test]
fn a_block_that_is_another_cause_is_neither_found_nor_ranked() {
    let mut evaluator = tabulated(&[(&["resonance"], 90.0), (&["series-lag"], 60.0)]);
    assert_eq!(found(&mut evaluator), ["resonance"]);
    evaluator.another = Some(effect("resonance"));
    let mut search = Search::new(&mut evaluator);
    let best = search.run(|_| ());
    assert!(best.fit.model.has(effect("series-lag")) && !best.fit.model.has(effect("resonance")));
    assert!(search.ranked().iter().all(|scored| !scored.fit.model.has(effect("resonance"))));
}

#[test]
fn a_block_that_stands_in_for_two_is_replaced_by_them() {
    let pair: &[&str] = &["time-constant", "drift"];
    let worth: [(&[&str], f64); 4] =
        [(&["resonance"], 90.0), (&["time-constant"], 50.0), (&["drift"], 40.0), (pair, 200.0)];
    let mut evaluator = tabulated(&worth);
    assert_eq!(found(&mut evaluator), pair);
    // If it leaves nothing but noise it stays, and the search is shorter.
    let mut adequate = Tabulated { clean: 80.0, ..tabulated(&worth) };
    assert_eq!(found(&mut adequate), ["resonance"]);
    assert!(2 * adequate.fits < evaluator.fits, "{} {}", adequate.fits, evaluator.fits);
}

/// Nothing but noise is left by the common forms of two causes, and of one.
#[test]
fn a_rare_form_of_one_cause_replaces_common_forms_of_several() {
    let pair: &[&str] = &["gain-error", "charge-leakage"];
    let worth: [(&[&str], f64); 2] = [(&["gain-error"], 60.0), (pair, 100.0)];
    let of_rare = |worth_of_rare: f64, worth: &[(&[&str], f64)]| {
        let rare = Some((effect("instantaneous-share"), worth_of_rare));
        found(&mut Tabulated { rare, clean: 90.0, ..tabulated(worth) })
    };
    assert_eq!(of_rare(95.0, &worth), ["instantaneous-share"]);
    assert_eq!(of_rare(85.0, &worth), pair, "it has the smaller score");
    assert_eq!(of_rare(105.0, &[(&["gain-error"], 100.0)]), ["gain-error"], "it is not simpler");
    assert_eq!(of_rare(95.0, &[(&["gain-error"], 80.0)]), ["instantaneous-share"], "the other leaves structure");
}

#[test]
fn blocks_are_exchanged() {
    // Neither gains anything without the other, and they are reached through a third.
    let pair: &[&str] = &["amplifier-slew", "charge-leakage"];
    let worth: [(&[&str], f64); 3] = [(&["delay"], 60.0), (&["delay", "charge-leakage"], 100.0), (pair, 150.0)];
    assert_eq!(found(&mut tabulated(&worth)), pair);
}

/// An autoregression follows the error until all three causes are there.
#[test]
fn causes_are_found_whose_error_the_noise_follows() {
    let three: &[&str] = &["gain-error", "second-relaxation", "drift"];
    let worth: [(&[&str], f64); 5] = [
        (&["gain-error"], 60.0),
        (&["gain-error", "hum"], 100.0),
        (&["gain-error", "hum", "drift"], 140.0),
        (&["gain-error", "hum", "drift", "second-relaxation"], 201.0),
        (three, 200.0),
    ];
    let mut evaluator = Tabulated { is_followed: true, clean: 190.0, ..tabulated(&worth) };
    let best = Search::new(&mut evaluator).run(|_| ());
    let wanted: BTreeSet<usize> = three.iter().map(|cause| effect(cause)).collect();
    assert_eq!(effects(&best.fit.model).into_iter().collect::<BTreeSet<_>>(), wanted);
    // What leaves structure whatever is added is not found.
    assert_eq!(found(&mut Tabulated { is_followed: true, clean: 250.0, ..tabulated(&worth) }), [""; 0]);
}

#[test]
fn a_search_that_has_to_end_returns_the_best_so_far() {
    let worth: [(&[&str], f64); 3] = [(&["delay"], 50.0), (&["hum"], 30.0), (&["delay", "hum"], 80.0)];
    let whole = {
        let mut evaluator = tabulated(&worth);
        assert_eq!(found(&mut evaluator), ["delay", "hum"]);
        evaluator.fits
    };
    let mut of_fits = (0..=whole).map(|most_fits| {
        let mut evaluator = Tabulated { most_fits, ..tabulated(&worth) };
        let found = found(&mut evaluator);
        assert!(evaluator.fits <= most_fits + EFFECTS.len() as isize, "{} {most_fits}", evaluator.fits);
        found.len()
    });
    // More work never gives a worse answer.
    assert!(of_fits.by_ref().is_sorted() && found(&mut tabulated(&worth)).len() == 2);
}

#[test]
fn the_penalty_factor_multiplies_every_price() {
    let mut evaluator = tabulated(&[(&["gain-error"], 500.0), (&["gain-error", "hum"], 525.0)]);
    assert_eq!(found(&mut evaluator), ["gain-error", "hum"]);
    evaluator.penalty_factor = 3.0;
    assert_eq!(found(&mut evaluator), ["gain-error"]);
}

/// Only the prices are computed again.
#[test]
fn another_pass_needs_no_new_fit() {
    let mut evaluator = tabulated(&[(&["gain-error"], 500.0), (&["gain-error", "hum"], 550.0)]);
    assert_eq!(found(&mut evaluator), ["gain-error", "hum"]);
    let once = std::mem::take(&mut evaluator.fits);
    evaluator.penalty_factor = 1.5;
    assert_eq!(found(&mut evaluator), ["gain-error", "hum"]);
    assert_eq!(evaluator.fits, once);
}

#[test]
fn the_misfit_of_form_is_charged_for_each_further_block() {
    let mut evaluator = tabulated(&[(&["hysteresis"], 500.0), (&["hysteresis", "drift"], 520.0)]);
    assert_eq!(found(&mut evaluator), ["hysteresis", "drift"]);
    evaluator.misfit = 15.0;
    assert_eq!(found(&mut evaluator), ["hysteresis"]);
    // A block in the same stage is charged more, for it may correct the form of the other.
    let mut alike = tabulated(&[(&["hysteresis"], 500.0), (&["hysteresis", "static-nonlinearity"], 520.0)]);
    (evaluator.misfit, alike.misfit) = (1.0, 1.0);
    assert_eq!(found(&mut evaluator), ["hysteresis", "drift"]);
    assert_eq!(found(&mut alike), ["hysteresis"]);
}

#[test]
fn the_misfit_of_form_is_compared_with_the_smallest_noise_floor_for_all() {
    let sets: [(&[&str], f64); 3] = [
        (&["amplifier-limit"], 300.0),
        (&["amplifier-limit", "charge-leakage"], 500.0),
        (&["amplifier-limit", "charge-leakage", "hum"], 700.0),
    ];
    // Compared with its own noise of 10 V, a structure would be charged a hundredth and win.
    let mut evaluator = Tabulated { misfit: 100.0, quiet: Some(effect("hum")), ..tabulated(&sets) };
    assert_eq!(found(&mut evaluator), ["amplifier-limit", "charge-leakage", "hum"]);
    evaluator.misfit = 210.0;
    assert_eq!(found(&mut evaluator), ["amplifier-limit"]);
}

#[test]
fn a_special_case_is_not_added_to_what_contains_it() {
    let mut evaluator = tabulated(&[
        (&["voltage-dependent-time-constant"], 90.0),
        (&["voltage-dependent-time-constant", "time-constant"], 300.0),
    ]);
    assert_eq!(found(&mut evaluator), ["voltage-dependent-time-constant"]);
}

#[test]
fn a_warm_start_is_evaluated_and_extended() {
    let mut evaluator = tabulated(&[(&["delay"], 50.0), (&["delay", "hum"], 90.0), (&["drift"], 40.0)]);
    let search_from = |evaluator: &mut Tabulated| {
        let model = |cause: &str| Model::default().with(Block { effect: effect(cause), form: 0 }, Vec::new());
        Search::new(evaluator)
            .run_from(WarmStart { models: vec![model("drift"), model("delay")], penalty_factor: 1.0 }, |_| ())
    };
    let best = search_from(&mut evaluator);
    assert_eq!(effects(&best.fit.model), [effect("delay"), effect("hum")]);
    assert!((best.score - (90.0 - 2.0 * PRICE)).abs() < 1e-9);
    // An effect that autocorrelation hides is searched for while the residual may hold structure.
    evaluator.hidden = Some(effect("hum"));
    assert_eq!(effects(&search_from(&mut evaluator).fit.model), [effect("delay"), effect("hum")]);
    evaluator.clean = 50.0;
    assert_eq!(effects(&search_from(&mut evaluator).fit.model), [effect("delay")]);
    // All rows show autocorrelation that a part of them did not.
    (evaluator.hidden, evaluator.penalty_factor) = (None, 4.5);
    assert_eq!(effects(&search_from(&mut evaluator).fit.model), [effect("delay")]);
}

/// Held-out errors by the causes: the likeliest set predicts worse than the simulation as it is given.
#[test]
fn of_structures_that_do_not_predict_the_next_likely_one_that_does_is_taken() {
    let mut evaluator = tabulated(&[(&["drift"], 90.0), (&["delay"], 60.0), (&["resonance"], 50.0)]);
    let mut search = Search::new(&mut evaluator);
    let best = search.run(|_| ());
    assert_eq!(effects(&best.fit.model), [effect("drift")]);
    let mut taken = |of_drift: f64, of_delay: f64, larger: &[&str]| {
        let errors = [("drift", of_drift), ("delay", of_delay), ("resonance", 0.5)];
        let is_larger = |fit: &Fit| larger.iter().any(|cause| effects(&fit.model) == [effect(cause)]);
        let held_out = |_: &mut Tabulated, fit: &Fit| match effects(&fit.model)[..] {
            [] => 1.0,
            [only] => errors.iter().find(|(cause, _)| effect(cause) == only).map_or(2.0, |(_, error)| *error),
            _ => 2.0,
        };
        effects(&search.predicting(best.clone(), is_larger, held_out).fit.model)
    };
    assert_eq!(taken(0.9, 0.3, &[]), [effect("drift")], "it predicts");
    assert_eq!(taken(1.1, 0.3, &[]), [effect("delay")]);
    assert_eq!(taken(0.9, 0.7, &["drift"]), [effect("resonance")], "the one that predicts best");
    assert_eq!(taken(1.1, 1.2, &["resonance"]), [0; 0], "the simulation as it is given");
}

/// A drift is likelier than a lag by 4 nats at the same price.
#[test]
fn what_may_belong_to_the_nominal_spring_is_compared_at_its_price_there() {
    let drift = vec![effect("drift")];
    let rival_of = |of_nominal| -> (Vec<usize>, f64, Vec<Vec<usize>>) {
        let worth: &[(&[&str], f64)] = &[(&["drift"], 104.0), (&["series-lag"], 100.0), (&["hum"], 50.0)];
        let mut evaluator = Tabulated { of_nominal, ..tabulated(worth) };
        let mut search = Search::new(&mut evaluator);
        let best = search.run(|_| ());
        assert_eq!(effects(&best.fit.model), drift);
        let without = search.best_without(effect("drift"));
        let odds = search.compared(&best) - search.compared(&without);
        let near = search.near(&best, 3.0).iter().map(|scored| effects(&scored.fit.model)).collect();
        (effects(&without.fit.model), odds, near)
    };
    let lag = vec![effect("series-lag")];
    assert_eq!(rival_of(None), (lag.clone(), 4.0, vec![drift.clone()]));
    assert_eq!(rival_of(Some((lag[0], 6.0))), (lag.clone(), -2.0, vec![lag.clone(), drift.clone()]));
    // One that is far less likely comes no nearer.
    assert_eq!(rival_of(Some((effect("hum"), 6.0))), (lag, 4.0, vec![drift.clone()]));
}
