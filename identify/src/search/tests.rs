//! The search on its own: a judge that was told what each set of causes is worth.

use std::collections::BTreeSet;

use crate::effects::index_of;
use crate::noise::Noise;
use crate::search::*;

/// What every block costs.
const PRICE: f64 = 10.0;

/// Log-likelihoods of sets of causes; of other sets that of their best part, and a little for every further cause.
struct Told {
    worth: Vec<(BTreeSet<usize>, f64)>,
    caution: f64,
    /// Beside noise of 1 V.
    misfit: f64,
    /// Without this effect, noise of 10 V is left.
    quiet: Option<usize>,
    /// From this log-likelihood on, nothing but noise is left.
    clean: f64,
    /// Only the patient are told of this effect.
    secret: Option<usize>,
    /// Fits less looks at a point, which cost none.
    fits: isize,
}

fn effect(cause: &str) -> usize {
    index_of(cause).unwrap()
}

fn told(worth: &[(&[&str], f64)]) -> Told {
    let set = |causes: &[&str]| causes.iter().map(|cause| effect(cause)).collect();
    Told {
        worth: worth.iter().map(|(causes, worth)| (set(causes), *worth)).collect(),
        caution: 1.0,
        misfit: 0.0,
        quiet: None,
        clean: f64::INFINITY,
        secret: None,
        fits: 0,
    }
}

impl Judge for Told {
    fn fit(&mut self, model: Model) -> Fit {
        self.fits += 1;
        let has: BTreeSet<usize> = effects(&model).into_iter().collect();
        let of_part = self.worth.iter().filter(|(part, _)| part.is_subset(&has));
        let log_likelihood =
            of_part.map(|(part, worth)| worth + (has.len() - part.len()) as f64).fold(has.len() as f64, f64::max);
        let mut noise = Noise::default_robust();
        noise.marginal = if self.quiet.is_none_or(|effect| has.contains(&effect)) { 1.0 } else { 10.0 };
        Fit {
            model,
            residual: Vec::new(),
            noise,
            log_likelihood,
            white_noise_log_likelihood: log_likelihood,
            initial_state_cost: 0.0,
        }
    }

    fn at(&mut self, model: Model) -> Fit {
        self.fits -= 1;
        self.fit(model)
    }

    fn fit_again(&mut self, first: Fit) -> Fit {
        first
    }

    fn held_out(&mut self, fit: &Fit) -> f64 {
        fit.log_likelihood
    }

    fn extended(&mut self, fit: &Fit, patient: bool, wanted: &dyn Fn(usize) -> bool) -> Vec<Fit> {
        let told = |effect: &usize| wanted(*effect) && (patient || self.secret != Some(*effect));
        let blocks =
            (0..EFFECTS.len()).filter(told).collect::<Vec<_>>().into_iter().map(|effect| Block { effect, form: 0 });
        blocks.map(|block| self.fit(fit.model.with(block, Vec::new()))).collect()
    }

    fn price(&self, _: &Block) -> f64 {
        PRICE
    }

    fn misfit(&self, _: &Fit, times: f64, floor_v: f64) -> f64 {
        times * self.misfit / (floor_v * floor_v)
    }

    fn doubts(&mut self, fit: &Fit) -> bool {
        fit.log_likelihood < self.clean
    }

    fn caution(&mut self, _: &Fit) -> f64 {
        self.caution
    }
}

fn found(judge: &mut Told) -> Vec<&'static str> {
    let best = Search::new(judge).run(|_| ());
    best.fit.model.blocks.iter().map(|(block, _)| block.cause()).collect()
}

#[test]
fn it_adds_what_is_worth_its_price_and_stops() {
    assert!(found(&mut told(&[])).is_empty());
    assert!(found(&mut told(&[(&["hum"], 0.9 * PRICE)])).is_empty());
    let mut judge = told(&[(&["delay"], 50.0), (&["hum"], 30.0), (&["delay", "hum"], 80.0)]);
    assert_eq!(found(&mut judge), ["delay", "hum"]);
    // Each structure once as a first fit for each that it follows, and once judged.
    assert!(judge.fits < 200, "{} fits", judge.fits);
}

#[test]
fn it_takes_out_what_stood_in_for_two() {
    let pair: &[&str] = &["time-constant", "drift"];
    let worth: [(&[&str], f64); 4] =
        [(&["resonance"], 90.0), (&["time-constant"], 50.0), (&["drift"], 40.0), (pair, 200.0)];
    let mut judge = told(&worth);
    assert_eq!(found(&mut judge), pair);
    // It was no stand-in if it leaves nothing but noise, and then the search is shorter.
    let mut content = Told { clean: 80.0, ..told(&worth) };
    assert_eq!(found(&mut content), ["resonance"]);
    assert!(2 * content.fits < judge.fits, "{} {}", content.fits, judge.fits);
}

#[test]
fn it_changes_one_block_for_another() {
    // Neither is worth anything without the other, and the way there leads over a third.
    let pair: &[&str] = &["amplifier-slew", "charge-leakage"];
    let worth: [(&[&str], f64); 3] = [(&["delay"], 60.0), (&["delay", "charge-leakage"], 100.0), (pair, 150.0)];
    assert_eq!(found(&mut told(&worth)), pair);
}

#[test]
fn caution_makes_every_block_dearer() {
    let mut judge = told(&[(&["gain-error"], 500.0), (&["gain-error", "hum"], 525.0)]);
    assert_eq!(found(&mut judge), ["gain-error", "hum"]);
    judge.caution = 3.0;
    assert_eq!(found(&mut judge), ["gain-error"]);
}

/// What it costs is charged anew, what it is worth stays.
#[test]
fn another_pass_fits_nothing_anew() {
    let mut judge = told(&[(&["gain-error"], 500.0), (&["gain-error", "hum"], 550.0)]);
    assert_eq!(found(&mut judge), ["gain-error", "hum"]);
    let once = std::mem::take(&mut judge.fits);
    judge.caution = 1.5;
    assert_eq!(found(&mut judge), ["gain-error", "hum"]);
    assert_eq!(judge.fits, once);
}

#[test]
fn a_further_block_costs_what_the_form_of_the_others_may_leave() {
    let mut judge = told(&[(&["hysteresis"], 500.0), (&["hysteresis", "drift"], 520.0)]);
    assert_eq!(found(&mut judge), ["hysteresis", "drift"]);
    judge.misfit = 15.0;
    assert_eq!(found(&mut judge), ["hysteresis"]);
    // One of the same stage may be no more than the other's form.
    let mut alike = told(&[(&["hysteresis"], 500.0), (&["hysteresis", "static-nonlinearity"], 520.0)]);
    (judge.misfit, alike.misfit) = (1.0, 1.0);
    assert_eq!(found(&mut judge), ["hysteresis", "drift"]);
    assert_eq!(found(&mut alike), ["hysteresis"]);
}

#[test]
fn what_the_form_may_leave_shows_beside_the_least_noise_for_all() {
    let sets: [(&[&str], f64); 3] = [
        (&["amplifier-limit"], 300.0),
        (&["amplifier-limit", "charge-leakage"], 500.0),
        (&["amplifier-limit", "charge-leakage", "hum"], 700.0),
    ];
    // Whose noise is 10 V would pay a hundredth for it, and seem the better one.
    let mut judge = Told { misfit: 100.0, quiet: Some(effect("hum")), ..told(&sets) };
    assert_eq!(found(&mut judge), ["amplifier-limit", "charge-leakage", "hum"]);
    judge.misfit = 210.0;
    assert_eq!(found(&mut judge), ["amplifier-limit"]);
}

#[test]
fn a_special_case_is_not_added_to_what_contains_it() {
    let mut judge = told(&[(&["static-nonlinearity"], 90.0), (&["static-nonlinearity", "gain-error"], 300.0)]);
    assert_eq!(found(&mut judge), ["static-nonlinearity"]);
}

#[test]
fn a_lead_is_judged_and_extended() {
    let mut judge = told(&[(&["delay"], 50.0), (&["delay", "hum"], 90.0), (&["drift"], 40.0)]);
    let from = |judge: &mut Told| {
        let model = |cause: &str| Model::default().with(Block { effect: effect(cause), form: 0 }, Vec::new());
        Search::new(judge).from(Lead { models: vec![model("drift"), model("delay")], caution: 1.0 }, |_| ())
    };
    let best = from(&mut judge);
    assert_eq!(effects(&best.fit.model), [effect("delay"), effect("hum")]);
    assert!((best.score - (90.0 - 2.0 * PRICE)).abs() < 1e-9);
    // What hides in the noise's memory is looked for while something seems to be left.
    judge.secret = Some(effect("hum"));
    assert_eq!(effects(&from(&mut judge).fit.model), [effect("delay"), effect("hum")]);
    judge.clean = 50.0;
    assert_eq!(effects(&from(&mut judge).fit.model), [effect("delay")]);
    // All rows show a memory of the noise that the part did not.
    (judge.secret, judge.caution) = (None, 4.5);
    assert_eq!(effects(&from(&mut judge).fit.model), [effect("delay")]);
}
