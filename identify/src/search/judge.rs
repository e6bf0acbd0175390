//! What a search asks about structures: an [`Engine`] answers from a record, a test from what it was told.

use crate::adequacy::absorbed_by_noise;
use crate::adequacy::unmodelled;
use crate::effects::EFFECTS;
use crate::effects::effect::FitContext;
use crate::effects::model::{Block, Model};
use crate::fit::engine::{Engine, Fit};
use crate::noise::{Noise, autocorrelation};
use crate::search::caution::long_memory;
use crate::search::promise::Metric;
use crate::stats::scale::{negligible, robust_scale, root_mean_square};

/// What a block costs, in nats, beside its places and forms: so many are tried.
const PRICE: f64 = 4.3;
/// And each of its coordinates, beyond what held-out rows charge: a wider block must not take a narrower one's place.
const PRICE_OF_COORDINATE: f64 = 1.8;
/// Part of what blocks change that may be off because the spring's form is another than theirs.
const MISFIT: f64 = 0.005;
/// And no more than this part of the noise: a larger misfit would be seen as a memory of its own.
const MISFIT_SEEN: f64 = 0.3;
/// An effect that promises less in all its forms, in nats, is not fitted.
const PROMISE: f64 = 2.5;
/// And to those who are not patient must promise this part of its price.
const PART_OF_PRICE: f64 = 0.5;

/// Fits structures and judges them.
pub trait Judge {
    /// The likeliest point near the model's own.
    fn fit(&mut self, model: Model) -> Fit;

    /// A model at its own point.
    fn at(&mut self, model: Model) -> Fit;

    /// The likeliest point near that of a first fit.
    fn fit_again(&mut self, first: Fit) -> Fit;

    /// Log-likelihood of all rows, each unseen by its fit.
    fn held_out(&mut self, fit: &Fit) -> f64;

    /// First fits of the structures with one block more, whose effect is wanted, in every form that is worth fitting; to the
    /// `patient` also where the noise's memory hides what it is worth.
    fn extended(&mut self, fit: &Fit, patient: bool, wanted: &dyn Fn(usize) -> bool) -> Vec<Fit>;

    /// What a block costs, in nats.
    fn price(&self, block: &Block) -> f64;

    /// What the blocks of a fit leave for being of another form than the spring's, in nats, so many `times` as strong in
    /// power, beside noise of `floor_v`: each further block costs it.
    fn misfit(&self, fit: &Fit, times: f64, floor_v: f64) -> f64;

    /// True if what a fit leaves may be structure.
    fn doubts(&mut self, fit: &Fit) -> bool;

    /// What prices have to be multiplied by for what a fit leaves, at least 1.
    fn caution(&mut self, fit: &Fit) -> f64;
}

impl Judge for Engine<'_> {
    fn fit(&mut self, model: Model) -> Fit {
        self.fit_twice(model)
    }

    fn at(&mut self, model: Model) -> Fit {
        Engine::evaluate(self, model)
    }

    fn fit_again(&mut self, first: Fit) -> Fit {
        Engine::refit(self, first)
    }

    fn held_out(&mut self, fit: &Fit) -> f64 {
        self.held_out_log_likelihood(fit)
    }

    fn extended(&mut self, fit: &Fit, patient: bool, wanted: &dyn Fn(usize) -> bool) -> Vec<Fit> {
        let mut extensions = extensions(self, fit, patient, wanted);
        // Who is not patient trusts the law of the noise, and a promise.
        let law = if patient { Noise::default_robust() } else { fit.noise.clone() };
        if !patient {
            let misfit = if fit.model.blocks.is_empty() { 0.0 } else { self.misfit(fit, 1.0, fit.noise.floor_v()) };
            extensions.retain(|it| it.promise > PART_OF_PRICE * (Judge::price(self, &it.block) + misfit));
        }
        let extensions = extensions.into_iter();
        extensions.map(|Extension { block, point, .. }| self.fit(fit.model.with(block, point), &law)).collect()
    }

    fn price(&self, block: &Block) -> f64 {
        let effect = block.effect();
        let fitted = block.coordinates(self.data).iter().filter(|coordinate| coordinate.fitted).count();
        PRICE
            + PRICE_OF_COORDINATE * fitted as f64
            + effect.ln_candidates(block.form, self.data)
            + (effect.forms() as f64).ln()
    }

    fn misfit(&self, fit: &Fit, times: f64, floor_v: f64) -> f64 {
        let explained: Vec<f64> =
            self.baseline_residual.iter().zip(&fit.residual).map(|(before, after)| before - after).collect();
        let part = MISFIT.min(MISFIT_SEEN * floor_v / root_mean_square(&explained).max(f64::MIN_POSITIVE));
        autocorrelation::coding_cost(&explained, floor_v / (part * times.sqrt()))
    }

    fn doubts(&mut self, fit: &Fit) -> bool {
        // Before any effect is found, a memory may be the effect's own; and one that is to foretell nearly all that is left.
        let remembers = !fit.noise.autocorrelation.is_white();
        let unfound = remembers && (fit.model.blocks.is_empty() || fit.strongly_autocorrelated());
        let errors = self.observed.errors(&fit.residual);
        let swallowed = || absorbed_by_noise::test(self.data, &errors, &fit.noise.autocorrelation).is_some();
        unfound || swallowed() || unmodelled::test(self, fit).is_none_or(|left| left.doubtful)
    }

    fn caution(&mut self, fit: &Fit) -> f64 {
        if negligible(&fit.residual) { 1.0 } else { long_memory(&self.terms(&fit.noise, &fit.residual)) }
    }
}

/// A block that could be added, from one start.
struct Extension {
    block: Block,
    point: Vec<f64>,
    promise: f64,
}

/// Blocks that might be added, each from its most promising starts.
fn extensions(engine: &mut Engine, fit: &Fit, patient: bool, wanted: &dyn Fn(usize) -> bool) -> Vec<Extension> {
    let mut metrics = Vec::new();
    let (remembers, rounded) = (!fit.noise.autocorrelation.is_white(), fit.noise.half_step > 0.0);
    // What rounding leaves keeps time with the voltage, and would promise everything.
    if !rounded && (patient || !remembers) {
        metrics.push(Metric::new(engine, fit, Noise::robust(&fit.residual)));
    }
    if remembers || rounded {
        metrics.push(Metric::new(engine, fit, fit.noise.clone()));
    }
    let sigma = robust_scale(&fit.residual);
    let mut found: Vec<Extension> = Vec::new();
    for (index, effect) in EFFECTS.iter().enumerate().filter(|(index, _)| wanted(*index)) {
        let mut of_effect: Vec<Extension> = Vec::new();
        for form in 0..effect.forms() {
            let block = Block { effect: index, form };
            let scene = FitContext { data: engine.data, residual: &fit.residual, sigma };
            let starts = effect.initial_points(form, &scene).into_iter().map(|point| {
                let there = engine.residual(&fit.model.with(block, point.clone()));
                let change: Vec<f64> = fit.residual.iter().zip(&there).map(|(a, b)| a - b).collect();
                let promise = metrics.iter().map(|metric| metric.promise(&change)).fold(0.0, f64::max);
                Extension { block, point, promise }
            });
            let mut starts: Vec<Extension> = starts.collect();
            starts.sort_by(|a, b| b.promise.total_cmp(&a.promise));
            // A second start where the first may be a lesser peak.
            starts.truncate(1 + usize::from(starts.len() > 4 && effect.forms() == 1));
            of_effect.extend(starts);
        }
        // A promise is a poor judge of a form: if one form is worth fitting, all are.
        if of_effect.iter().any(|extension| extension.promise > PROMISE) {
            found.extend(of_effect);
        }
    }
    found
}
