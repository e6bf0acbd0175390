//! What a search asks about structures. An [`Engine`] answers from a record, a test from a table.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::HashSet;

use crate::adequacy;
use crate::effects::effect::{FitContext, Location};
use crate::effects::identified::LINEAR_DYNAMICS;
use crate::effects::model::{Block, Model};
use crate::effects::{EFFECTS, index_of};
use crate::fit::engine::{Engine, Fit};
use crate::noise::{Noise, autocorrelation};
use crate::nominal::PRICE_OF_POLE;
use crate::search::first_fits::{Start, first_fits};
use crate::search::initial_models::{initial_models, late_models};
use crate::search::joint_gain::joint_extensions;
use crate::search::penalty_factor::penalty_factor;
use crate::search::predicted_gain::GainPredictor;
use crate::stats::scale::{negligible, robust_scale, root_mean_square};
use crate::stats::thresholds::empirical::{
    GAIN_PER_PRICE, MISFIT_OF_FORM, MISFIT_PER_FLOOR, NATS_TO_FIT, PRICE_OF_BLOCK, PRICE_OF_COORDINATE,
};

/// Which extensions of a structure a search fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Breadth {
    /// True for effects, too, that the noise's autocorrelation may hide.
    pub exhaustive: bool,
    /// Which forms of an effect.
    pub forms: Forms,
}

/// Forms of an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Forms {
    /// The forms that every search tries.
    #[default]
    Common,
    /// The other forms, for a record in which the common ones leave structure or several effects are found.
    Rare,
}

/// Fits structures and evaluates them.
pub trait Evaluator {
    /// Returns the simulation as it is given.
    fn simulation(&self) -> Model {
        Model::default()
    }

    /// Returns the models from which the search starts in addition to the simulation as it is given.
    fn initial_models(&self) -> Vec<Model> {
        Vec::new()
    }

    /// Returns models with a delay, one of which is the best structure if the search finds none that is better.
    fn late_models(&self) -> Vec<Model> {
        Vec::new()
    }

    /// Returns the likeliest fit near the model's own point.
    fn fit(&mut self, model: Model) -> Fit;

    /// Returns the model at its own point, with the noise of its residual.
    fn at(&mut self, model: Model) -> Fit;

    /// Returns the likeliest fit near that of a first fit.
    fn refit(&mut self, first: Fit) -> Fit;

    /// Returns models that extend a fit by pairs and triples of blocks, of effects that are `wanted`, which promise most together under
    /// independent noise: at most `most` of each, before they are fitted.
    fn joint(&mut self, _fit: &Fit, _wanted: &dyn Fn(usize) -> bool, _most: usize) -> Vec<Model> {
        Vec::new()
    }

    /// Returns the likeliest fit near that of a first fit as if the noise were independent.
    fn fit_as_independent(&mut self, first: Fit) -> Fit {
        first
    }

    /// Log-likelihood of all rows, in nats, each predicted by a fit to the other folds.
    fn held_out(&mut self, fit: &Fit) -> f64;

    /// First fits of the structures with one block more, whose effect is `wanted`, in every form that is worth fitting.
    fn extended(&mut self, fit: &Fit, breadth: Breadth, wanted: &dyn Fn(usize) -> bool) -> Vec<Fit>;

    /// First fit of the structure with one effect more, in the form and from the start with the largest predicted gain; `None` if
    /// the effect has no start.
    fn extended_by(&mut self, _fit: &Fit, _effect: usize) -> Option<Fit> {
        None
    }

    /// Price of a block, in nats.
    fn price(&self, block: &Block) -> f64;

    /// Price of a block, in nats, that a comparison with other causes does not count: what linear dynamics cost more than as a part of the
    /// nominal spring, if that was identified from the same readings.
    fn excess_price(&self, _block: &Block) -> f64 {
        0.0
    }

    /// The stage of the chain that a block changes at a point.
    fn location(&self, block: &Block, _point: &[f64]) -> Location {
        block.effect().location()
    }

    /// True if a block at a point cannot be distinguished from another cause, whose name it must not take, in readings with noise of the
    /// scale `sigma_v`.
    fn is_another_cause(&self, _block: &Block, _point: &[f64], _sigma_v: f64) -> bool {
        false
    }

    /// Log-likelihood, in nats, that a further block gains by correcting the form of the others, `times` as strong in power as
    /// assumed, above a noise floor of `floor_v` volts.
    fn misfit(&self, fit: &Fit, times: f64, floor_v: f64) -> f64;

    /// True if the residual of a fit may hold structure.
    fn doubts(&mut self, fit: &Fit) -> bool;

    /// True if the residual of a finished search's best fit may hold structure, by the checks of the report as well.
    fn leaves_structure(&mut self, fit: &Fit) -> bool {
        self.doubts(fit)
    }

    /// Models with a simpler block in place of one or two of a model: a special case of it, or one that includes the gain error.
    fn simpler(&self, _model: &Model) -> Vec<Model> {
        Vec::new()
    }

    /// Factor by which prices are multiplied for the residual of a fit, 1 or more.
    fn penalty_factor(&mut self, fit: &Fit) -> f64;

    /// Keeps work for forms that are seldom needed, until [`Evaluator::begin_rare_forms`].
    fn reserve_for_rare_forms(&mut self) {}

    /// Takes note that the search tries forms that are seldom needed from here on.
    fn begin_rare_forms(&mut self) {}

    /// Takes note that a structure with effects leaves nothing but noise, for which more work is allowed.
    fn found_adequate(&mut self);

    /// True if the work for the search is nearly done, so that it follows the most promising structures only.
    fn is_scarce(&self) -> bool;

    /// Gives a search that its work has ended more of it, once, if its best fit explains most of the errors; true if it did.
    fn go_on(&mut self, _best: &Fit) -> bool {
        false
    }

    /// Work that is left for the search.
    fn work_left(&self) -> u64 {
        if self.is_over() { 0 } else { u64::MAX }
    }

    /// True once the work for the search is done, or its end was requested: it ends with the best structure so far.
    fn is_over(&self) -> bool;
}

impl Evaluator for Engine<'_> {
    fn simulation(&self) -> Model {
        Engine::simulation(self)
    }

    fn initial_models(&self) -> Vec<Model> {
        let relaxation = &self.base().relaxation;
        initial_models(self.data, relaxation.tau_s, relaxation.share, |cause| self.allows(cause))
    }

    fn late_models(&self) -> Vec<Model> {
        late_models(self.data, self.base().relaxation.share, |cause| self.allows(cause))
    }

    fn fit(&mut self, model: Model) -> Fit {
        self.fit_twice(model)
    }

    fn at(&mut self, model: Model) -> Fit {
        Engine::evaluate(self, model)
    }

    fn refit(&mut self, first: Fit) -> Fit {
        Engine::refit(self, first)
    }

    fn joint(&mut self, fit: &Fit, wanted: &dyn Fn(usize) -> bool, most: usize) -> Vec<Model> {
        joint_extensions(self, fit, wanted, |engine, block| engine.price(block), most)
    }

    fn fit_as_independent(&mut self, first: Fit) -> Fit {
        Engine::fit(self, first.model, &Noise::default_robust())
    }

    fn held_out(&mut self, fit: &Fit) -> f64 {
        self.held_out_log_likelihood(fit)
    }

    fn extended(&mut self, fit: &Fit, breadth: Breadth, wanted: &dyn Fn(usize) -> bool) -> Vec<Fit> {
        let mut extensions = extensions(self, fit, breadth, wanted, NATS_TO_FIT.get());
        let exhaustive = breadth.exhaustive;
        // A search that is not exhaustive relies on the noise of the present fit, and on predicted gains.
        let law = if exhaustive { Noise::default_robust() } else { fit.noise.clone() };
        if !exhaustive {
            let misfit = if fit.model.blocks.is_empty() { 0.0 } else { self.misfit(fit, 1.0, fit.noise.floor_v()) };
            extensions
                .retain(|it| it.predicted_gain > GAIN_PER_PRICE.get() * (Evaluator::price(self, &it.block) + misfit));
        }
        let start = |Extension { block, point, .. }| Start { price: Evaluator::price(self, &block), block, point };
        let starts = best_of_each_first(extensions).into_iter().map(start).collect();
        first_fits(self, fit, &law, starts)
    }

    fn extended_by(&mut self, fit: &Fit, effect: usize) -> Option<Fit> {
        let extensions =
            extensions(self, fit, Breadth::default(), &|other| other == effect, f64::NEG_INFINITY).into_iter();
        let Extension { block, point, .. } = extensions.max_by(|a, b| a.predicted_gain.total_cmp(&b.predicted_gain))?;
        let known = self.known(fit, &fit.noise);
        let mut approach = self.approached(fit.model.with(block, point), &fit.noise, &known);
        self.approach_further(&mut approach, &fit.noise, &known);
        Some(self.completed(approach.model, &fit.noise, effect))
    }

    fn price(&self, block: &Block) -> f64 {
        let effect = block.effect();
        let forms = if block.form < effect.common_forms() { effect.common_forms() } else { effect.forms() };
        PRICE_OF_BLOCK.get()
            + PRICE_OF_COORDINATE.get() * block.fitted(self.data) as f64
            + effect.ln_candidates(block.form, self.data)
            + (forms as f64).ln()
    }

    fn excess_price(&self, block: &Block) -> f64 {
        if !self.data.normalisation.identified || !LINEAR_DYNAMICS.contains(&block.cause()) {
            return 0.0;
        }
        let of_identified = PRICE_OF_POLE * block.fitted(self.data).div_ceil(COORDINATES_OF_POLE) as f64;
        (Evaluator::price(self, block) - of_identified).max(0.0)
    }

    fn location(&self, block: &Block, point: &[f64]) -> Location {
        block.effect().location_at(block.form, point, self.data)
    }

    fn is_another_cause(&self, block: &Block, point: &[f64], sigma_v: f64) -> bool {
        block.effect().is_another_cause(block.form, point, self.data, sigma_v)
    }

    fn misfit(&self, fit: &Fit, times: f64, floor_v: f64) -> f64 {
        let explained: Vec<f64> =
            self.baseline_residual.iter().zip(&fit.residual).map(|(before, after)| before - after).collect();
        let part = MISFIT_OF_FORM
            .get()
            .min(MISFIT_PER_FLOOR.get() * floor_v / root_mean_square(&explained).max(f64::MIN_POSITIVE));
        autocorrelation::coding_cost(&explained, floor_v / (part * times.sqrt()))
    }

    fn doubts(&mut self, fit: &Fit) -> bool {
        // Before any effect is found, autocorrelation may be the effect's own; so it may where it predicts nearly all errors.
        let autocorrelated = !fit.noise.autocorrelation.is_white();
        autocorrelated && (fit.model.blocks.is_empty() || fit.strongly_autocorrelated()) || adequacy::doubts(self, fit)
    }

    fn leaves_structure(&mut self, fit: &Fit) -> bool {
        self.doubts(fit) || adequacy::first_significant(self, fit).is_some()
    }

    fn simpler(&self, model: &Model) -> Vec<Model> {
        let special_case = |(block, point): &(Block, Vec<f64>)| {
            let (cause, form, point) = block.effect().nearest_special_case(block.form, point, self.data)?;
            let effect = index_of(cause).filter(|effect| self.allows(cause) && !model.has(*effect))?;
            Some(model.without(block.effect).with(Block { effect, form }, point))
        };
        let mut simpler: Vec<Model> = model.blocks.iter().filter_map(special_case).collect();
        if let Some(gain_error) = index_of("gain-error")
            && let Some(&[gain]) = model.point(gain_error)
        {
            let rest = model.without(gain_error);
            let with_gain = |(block, point): &(Block, Vec<f64>)| {
                let (form, point) = block.effect().with_gain(block.form, point, gain, self.data)?;
                Some(rest.without(block.effect).with(Block { form, ..*block }, point))
            };
            simpler.extend(rest.blocks.iter().filter_map(with_gain));
        }
        simpler
    }

    fn penalty_factor(&mut self, fit: &Fit) -> f64 {
        if negligible(&fit.residual) { 1.0 } else { penalty_factor(&self.terms(&fit.noise, &fit.residual)) }
    }

    fn reserve_for_rare_forms(&mut self) {
        self.budget().reserve();
    }

    fn begin_rare_forms(&mut self) {
        self.budget().release();
    }

    fn found_adequate(&mut self) {
        self.budget().extend();
    }

    fn is_scarce(&self) -> bool {
        self.budget().is_scarce()
    }

    fn go_on(&mut self, best: &Fit) -> bool {
        // Beyond a bound of the sensor a residual is no error, and noise is no error of the simulation.
        let beyond_noise =
            |residual: &[f64]| (self.observed.rms(residual).powi(2) - best.noise.sigma.powi(2)).max(0.0).sqrt();
        let [left, before] = [&best.residual, &self.baseline_residual].map(|residual| beyond_noise(residual));
        !best.model.blocks.is_empty() && left < PART_LEFT * before && self.budget().go_on()
    }

    fn work_left(&self) -> u64 {
        self.budget().work_left()
    }

    fn is_over(&self) -> bool {
        self.budget().is_over()
    }
}

/// Largest part of the errors beyond the noise, root mean square, that a search may leave to get more work: where nothing fits, more is no
/// use.
const PART_LEFT: f64 = 0.5;
/// Coordinates of a pole: its place and its weight.
const COORDINATES_OF_POLE: usize = 2;
/// Work for each piece of the voltage from which all starts and forms are tried.
const WORK_PER_PIECE: u64 = 40_000;
/// Starts of each form that are tried while work is scarce.
const STARTS_IF_SCARCE: usize = 16;
/// Number of forms of [`Forms::Rare`] that are fitted.
const RARE_FORMS_FITTED: usize = 6;
/// Smallest predicted gain of what is fitted beside one of these, relative to its own.
const PART_OF_BEST: f64 = 0.1;
/// Predicted gain of one of these, relative to its price, for which a search gets more work.
const PROMISING_GAIN: f64 = 10.0;
/// Predicted gain of one of these, relative to the largest of a common form, for which it is fitted with these.
const FAR_ABOVE: f64 = 10.0;
/// Work of a predicted gain for each row, in units of one piece of the voltage through one lag.
const PREDICTION: u64 = 5;

/// A block that could be added, at one start.
struct Extension {
    block: Block,
    point: Vec<f64>,
    /// Predicted gain in log-likelihood, in nats.
    predicted_gain: f64,
}

/// Blocks that could be added, each at the starts with the largest predicted gain; only of effects of which a form gains more than
/// `least`, in nats.
fn extensions(
    engine: &mut Engine,
    fit: &Fit,
    Breadth { exhaustive, forms }: Breadth,
    wanted: &dyn Fn(usize) -> bool,
    least: f64,
) -> Vec<Extension> {
    let screening = Screening::new(engine, fit, exhaustive);
    if forms == Forms::Rare {
        let rare = rare(screening.extensions(engine, forms, wanted, least));
        if rare.first().is_some_and(|it| is_promising(engine, it)) {
            engine.budget().extend();
        }
        return rare;
    }
    let mut found = screening.extensions(engine, forms, wanted, least);
    if exhaustive && fit.model.blocks.is_empty() && engine.doubts(fit) {
        // Before all common forms are fitted in vain.
        let best = found.iter().map(|it| it.predicted_gain).fold(0.0, f64::max);
        let mut rare = rare(screening.extensions(engine, Forms::Rare, wanted, least));
        rare.retain(|it| it.predicted_gain > FAR_ABOVE * best && is_promising(engine, it));
        if let Some(most) = rare.first().map(|it| it.predicted_gain) {
            found.retain(|it| it.predicted_gain > PART_OF_BEST * most);
            found.extend(rare);
        }
    }
    found
}

/// The rare forms that are worth fitting, those with the largest predicted gains first: the best of each effect, then others as long as
/// there is room.
fn rare(mut found: Vec<Extension>) -> Vec<Extension> {
    let best = found.iter().map(|it| it.predicted_gain).fold(0.0, f64::max);
    // Before any is left out for want of room: what promises next to nothing needs none.
    found.retain(|it| it.predicted_gain > PART_OF_BEST * best);
    let mut kept = best_of_each_first(found);
    kept.truncate(RARE_FORMS_FITTED);
    kept.sort_by(by_gain);
    kept
}

/// The best of each effect, then the others, both in the order of their predicted gains.
fn best_of_each_first(mut found: Vec<Extension>) -> Vec<Extension> {
    found.sort_by(by_gain);
    let mut seen = HashSet::new();
    let (mut first, others): (Vec<_>, Vec<_>) = found.into_iter().partition(|it| seen.insert(it.block.effect));
    first.extend(others);
    first
}

/// The larger predicted gain first.
fn by_gain(a: &Extension, b: &Extension) -> Ordering {
    b.predicted_gain.total_cmp(&a.predicted_gain)
}

/// True if a form would gain many times its price.
fn is_promising(engine: &Engine, it: &Extension) -> bool {
    it.predicted_gain > PROMISING_GAIN * Evaluator::price(engine, &it.block)
}

/// Predicts the gains of what could be added to one fit.
struct Screening<'f> {
    fit: &'f Fit,
    residual: Cow<'f, [f64]>,
    predictors: Vec<GainPredictor>,
    from_rest: Vec<f64>,
    sigma: f64,
    exhaustive: bool,
}

impl<'f> Screening<'f> {
    fn new(engine: &mut Engine, fit: &'f Fit, exhaustive: bool) -> Self {
        let mut predictors = Vec::new();
        let (autocorrelated, rounded) = (!fit.noise.autocorrelation.is_white(), fit.noise.half_step > 0.0);
        // The rounding error depends on the voltage, so that every effect would seem to explain it.
        if !rounded && (exhaustive || !autocorrelated) {
            let known = engine.observed.known(&fit.residual);
            predictors.push(GainPredictor::new(engine, fit, Noise::robust(&known)));
        }
        if autocorrelated || rounded {
            predictors.push(GainPredictor::new(engine, fit, fit.noise.clone()));
        }
        let from_rest = engine.residual_from_rest(&fit.model);
        let residual = engine.observed.outside(&fit.residual);
        let sigma = robust_scale(&engine.observed.known(&fit.residual));
        Self { fit, residual, predictors, from_rest, sigma, exhaustive }
    }

    /// The blocks in some of their forms, as [`extensions`] returns them.
    fn extensions(
        &self,
        engine: &mut Engine,
        wanted_forms: Forms,
        wanted: &dyn Fn(usize) -> bool,
        least: f64,
    ) -> Vec<Extension> {
        // Where the voltage has many pieces, screening every start would leave no work for fits.
        let dear = self.exhaustive && engine.budget().granted() < WORK_PER_PIECE * engine.data.command.len() as u64;
        let scarce = engine.is_scarce() || dear;
        let mut found: Vec<Extension> = Vec::new();
        let allowed =
            EFFECTS.iter().enumerate().filter(|(index, effect)| wanted(*index) && engine.allows(effect.cause()));
        for (index, effect) in allowed.collect::<Vec<_>>() {
            let mut of_effect: Vec<Extension> = Vec::new();
            let forms = match wanted_forms {
                Forms::Common => 0..effect.common_forms(),
                Forms::Rare => effect.common_forms()..effect.forms(),
            };
            for form in forms.clone() {
                let block = Block { effect: index, form };
                let scene = FitContext { data: engine.data, residual: &self.residual, sigma: self.sigma };
                let points = effect.initial_points(form, &scene);
                let every = if scarce { points.len().div_ceil(STARTS_IF_SCARCE) } else { 1 };
                let mut starts = Vec::new();
                for point in points.into_iter().step_by(every.max(1)) {
                    if engine.is_over() {
                        return Vec::new();
                    }
                    let predicted_gain = self.predicted_gain(engine, block, &point);
                    starts.push(Extension { block, point, predicted_gain });
                }
                starts.sort_by(|a, b| b.predicted_gain.total_cmp(&a.predicted_gain));
                // Two starts where the first may be a local maximum.
                starts.truncate(1 + usize::from(starts.len() > 4 && forms.len() == 1));
                of_effect.extend(starts);
            }
            if scarce {
                of_effect.sort_by(|a, b| b.predicted_gain.total_cmp(&a.predicted_gain));
                of_effect.truncate(1);
            }
            // Predicted gains rank the forms of an effect poorly: if one form is worth fitting, all are fitted.
            if of_effect.iter().any(|extension| extension.predicted_gain > least) {
                found.extend(of_effect);
            }
        }
        found
    }

    /// Predicted gain of a block at a start, in nats.
    fn predicted_gain(&self, engine: &mut Engine, block: Block, point: &[f64]) -> f64 {
        let there = engine.residual_from_rest(&self.fit.model.with(block, point.to_vec()));
        let change: Vec<f64> = self.from_rest.iter().zip(&there).map(|(a, b)| a - b).collect();
        engine.budget().spend(PREDICTION * change.len() as u64);
        self.predictors.iter().map(|predictor| predictor.predicted_gain(&change)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::budget::{Budget, Effort};
    use crate::fit::stop::Stop;
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::{Kind, Observed};
    use simulation::record::{Record, Row};

    /// A spring at 100 V.
    fn data() -> Data {
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: 100.0, measured: Some(100.0) };
        Data::new(&Record { name: String::new(), rows: (0..20).map(row).collect() }, Input::Hold)
    }

    #[test]
    fn a_constant_time_constant_is_simpler_than_one_that_depends_on_the_voltage() {
        let data = data();
        let (observed, base) = (Observed::new(&data), Base::paper());
        let block = |cause: &str, form| Block { effect: index_of(cause).unwrap(), form };
        let offset = Model::default().with(block("hysteresis", 0), vec![3.0]);
        let varying = offset.with(block("voltage-dependent-time-constant", 1), vec![2f64.ln(), 8f64.ln()]);
        let simpler = Evaluator::simpler(&Engine::new(&data, &observed, &base), &varying);
        assert_eq!(simpler.len(), 1);
        assert_eq!(simpler[0].structure(), offset.with(block("time-constant", 0), vec![4f64.ln()]).structure());
        assert!((simpler[0].point(block("time-constant", 0).effect).unwrap()[0] - 4f64.ln()).abs() < 1e-12);
        assert!(Evaluator::simpler(&Engine::new(&data, &observed, &base), &offset).is_empty());
    }

    /// In a record that stays far below the voltage at which a curve has the nominal gain, it may be a straight line.
    #[test]
    fn a_gain_is_simpler_than_a_curve() {
        let data = data();
        let (observed, base) = (Observed::new(&data), Base::paper());
        let engine = Engine::new(&data, &observed, &base);
        let block = |cause: &str, form| Block { effect: index_of(cause).unwrap(), form };
        let of = |form, point| {
            Evaluator::simpler(&engine, &Model::default().with(block("static-nonlinearity", form), point))
        };
        // 1 + a (x - X) at 100 V, where x = 1 and X = 5.
        assert_eq!(of(0, vec![-0.04]), [Model::default().with(block("gain-error", 0), vec![1.16])]);
        // A restoring force changes the lag as well.
        assert!(of(11, vec![0.1, 0.0]).is_empty());
    }

    #[test]
    fn a_lag_in_front_is_simpler_than_an_amplifier_that_never_reaches_its_rate() {
        let data = data();
        let (observed, base) = (Observed::new(&data), Base::paper());
        let engine = Engine::new(&data, &observed, &base);
        let block = |cause: &str, form| Block { effect: index_of(cause).unwrap(), form };
        let amplifier = Model::default().with(block("amplifier-slew", 3), vec![1e6f64.ln(), 2f64.ln()]);
        let lag = Model::default().with(block("series-lag", 2), vec![2f64.ln()]);
        assert_eq!(Evaluator::simpler(&engine, &amplifier), [lag]);
        // Another lag has its place.
        let both = amplifier.with(block("series-lag", 0), vec![0.0]);
        assert!(Evaluator::simpler(&engine, &both).is_empty());
    }

    /// A search whose work has ended at a residual, of a simulation that leaves 2 V without causes.
    #[test]
    fn a_search_goes_on_that_leaves_little_beyond_the_noise() {
        let data = data();
        let (plain, base) = (Observed::new(&data), Base::paper());
        let goes_on = |observed: &Observed, causes: bool, left: f64, noise: f64| {
            let budget = Budget::new(Effort::Normal, data.rows(), Stop::default());
            budget.grant(1.0);
            budget.spend(budget.granted());
            let mut engine = Engine::within(&data, observed, &base, &budget);
            engine.baseline_residual = vec![2f64.copysign(left); 20];
            let hysteresis = Block { effect: index_of("hysteresis").unwrap(), form: 0 };
            let model = if causes { Model::default().with(hysteresis, vec![3.0]) } else { Model::default() };
            let mut best = engine.evaluate(model);
            best.residual = vec![left; 20];
            best.noise.sigma = noise;
            Evaluator::go_on(&mut engine, &best)
        };
        assert!(goes_on(&plain, true, 0.9, 0.0) && !goes_on(&plain, true, 1.1, 0.0));
        // Of 1.1 V, 0.9 V are noise.
        assert!(goes_on(&plain, true, 1.1, 0.9) && !goes_on(&plain, true, 1.5, 0.9));
        assert!(!goes_on(&plain, false, 0.9, 0.0), "no cause was found");
        // Readings that stopped at the upper bound, below the prediction.
        let bounded = Observed { kinds: vec![Kind::AtLeast; 20], ..plain.clone() };
        assert!(!goes_on(&bounded, true, -0.9, 0.0), "nothing was left from the beginning");
    }

    /// Five forms of one effect promise more than one of another.
    #[test]
    fn rare_forms_of_one_effect_leave_room_for_another() {
        let of = |effect, form, predicted_gain| Extension {
            block: Block { effect, form },
            point: Vec::new(),
            predicted_gain,
        };
        let mut found: Vec<Extension> = (1..=5).map(|form| of(3, form, 100.0 + form as f64)).collect();
        found.extend([of(7, 2, 60.0), of(8, 1, 5.0)]);
        let kept: Vec<(usize, usize)> = rare(found).iter().map(|it| (it.block.effect, it.block.form)).collect();
        // That of the third effect promises less than a tenth.
        assert_eq!(kept, [(3, 5), (3, 4), (3, 3), (3, 2), (3, 1), (7, 2)]);
    }
}
