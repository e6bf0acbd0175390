//! The best equation of a record, if it predicts held-out segments better than the extended simulation and every linear model.

use crate::answer::{Equation, HeldOutErrors};
use crate::dimension::Dimension;
use crate::equation::fitted::Fitted;
use crate::equation::intervals;
use crate::equation::plant::plant;
use crate::equation::problem::Problem;
use crate::equation::search::{Scored, search};
use crate::equation::starts;
use crate::equation::structure::Structure;
use crate::equation::text::text;
use crate::fit::budget::Budget;
use crate::linear::Poles;
use crate::noise::Noise;
use crate::record::data::Data;
use crate::record::observed::Observed;
use crate::stats::scale::root_mean_square;
use crate::stats::segments::SEGMENTS;
use crate::stats::thresholds::empirical::{FINEST_V, WORSE_THAN_LINEAR};
use crate::stats::thresholds::probability::RIVAL_ODDS;
use simulation::plant_file::PlantFile;

/// The models that an equation has to beat; each residual is reading minus prediction on held-out segments, in normalised V.
pub struct Rivals<'a> {
    /// The simulation as it is given, normalised.
    pub nominal: &'a PlantFile,
    /// Residual of the simulation as it is given.
    pub nominal_residual: &'a [f64],
    /// The extended simulation, normalised.
    pub extended: &'a PlantFile,
    /// Residual of the extended simulation.
    pub extended_residual: &'a [f64],
    /// Denominator and delay of the best linear model, in s.
    pub poles: &'a Poles,
    /// Residual of the best linear model.
    pub linear_residual: &'a [f64],
}

/// Searches the best equation of a normalised record; `None` if none beats both rivals beyond chance, or the work was used up.
pub fn equation(data: &Data, observed: &Observed, rivals: &Rivals, budget: &Budget) -> Option<(Fitted, Equation)> {
    if data.rows() < SEGMENTS || data.is_joined() {
        return None;
    }
    let problem = Problem::new(data, observed, budget);
    let best = search(&problem, starting_structures(&problem, rivals))?;
    let [ours, extended, linear] =
        [&best.held_out[..], rivals.extended_residual, rivals.linear_residual].map(|of| observed.errors(of));
    let finest = root_mean_square(&extended) <= FINEST_V.get();
    let beats = |theirs: &[f64]| root_mean_square(theirs) > WORSE_THAN_LINEAR.get() * root_mean_square(&ours);
    if finest || !beats(&extended) || !beats(&linear) {
        return None;
    }
    let law = Noise::fitted(&best.held_out, observed);
    let value = |residual: &[f64]| law.rescaled(residual, observed).1;
    let over = |residual: &[f64]| value(&best.held_out) - value(residual);
    let nats = [over(rivals.extended_residual), over(rivals.linear_residual)];
    let needed = RIVAL_ODDS + problem.price(&best.fit.structure);
    if nats.iter().any(|nats| *nats < needed) {
        return None;
    }
    let report = reported(&problem, &best, rivals, nats);
    Some((best.fit, report))
}

/// The structures from which the search starts, each once.
fn starting_structures(problem: &Problem, rivals: &Rivals) -> Vec<Structure> {
    let second_s = problem.data.scales().second_s;
    let mut starts = vec![starts::of_plant(rivals.nominal, &problem.scale)];
    for start in
        [starts::of_plant(rivals.extended, &problem.scale), starts::of_linear(rivals.poles, second_s, &problem.scale)]
    {
        if !starts.contains(&start) {
            starts.push(start);
        }
    }
    starts
}

fn reported(problem: &Problem, best: &Scored, rivals: &Rivals, nats: [f64; 2]) -> Equation {
    let scales = problem.data.scales();
    let fit = &best.fit;
    let words = text(&fit.structure, problem.data.initial_state_unknown);
    let size = |residual: &[f64]| scales.restored(Dimension::ReadingSize, problem.observed.rms(residual));
    let plant = plant(fit, rivals.nominal, scales.output, &problem.scale).map_err(str::to_owned).and_then(|file| {
        let file = problem.data.normalisation.restored_plant(&file);
        file.check().map_err(|error| error.to_string())?;
        file.to_toml().map_err(|error| error.to_string())
    });
    Equation {
        blocks: fit.structure.blocks(),
        definitions: words.definitions.iter().map(|&of| of.to_owned()).collect(),
        parameters: intervals::parameters(fit, problem, &words),
        rmse: size(&fit.residual),
        held_out: HeldOutErrors {
            nominal: size(rivals.nominal_residual),
            extended: size(rivals.extended_residual),
            linear: size(rivals.linear_residual),
            equation: size(&best.held_out),
        },
        nats_over_extended: nats[0],
        nats_over_linear: nats[1],
        no_plant: plant.as_ref().err().cloned(),
        plant: plant.ok(),
        text: words.equation,
    }
}
