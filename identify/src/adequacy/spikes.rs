//! Check for large errors that are no outliers: they follow changes of the command, or come in runs.
//!
//! Outliers are independent of the command and of each other, and the error returns after each. A delay that varies leaves spikes of
//! one or two rows just after changes of the voltage; a reading that is held for some rows leaves runs of spikes of one sign; an
//! error that steps leaves one spike of the innovations at each step, after which it stays. A noise model with two
//! scales takes all for outliers. Of `n` far readings, independent ones leave about `n p` just after a change, `p` being the
//! fraction of all rows that are; and of neighbours that are both far, equally many have equal and opposite signs:
//!
//! ```text
//! z = (count - n p) / sqrt(n p (1 - p)),      z = (alike - unlike) / sqrt(alike + unlike)
//! ```

use crate::adequacy::check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
use crate::adequacy::localisation::Localisation;
use crate::fit::engine::{Engine, Fit};
use crate::noise::Noise;
use crate::record::changes::{changes, follow};
use crate::record::data::Data;
use crate::record::observed::Observed;
use crate::stats::median::median;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{FAR_OFF_SCALES, ROWS_AFTER_CHANGE, SHARE_AFTER_CHANGES, SHARE_IN_RUNS};
use crate::stats::thresholds::probability::Z_RARE;

/// Rows whose median is the level of the error before or after a far row.
const LEVEL: usize = 3;
/// Fewest steps of the error that are not a chance.
const FEWEST_STEPS: usize = 3;

/// The check of a fit whose noise is a mixture of two scales.
pub(super) struct Spikes;

impl Check for Spikes {
    fn name(&self) -> &'static str {
        "spikes"
    }

    fn test(&self, engine: &mut Engine, candidate: &Candidate) -> Option<Inadequacy> {
        spikes(engine, candidate.fit).map(Inadequacy::from)
    }
}

/// Returns the spikes of a fit, or `None` if its far readings are independent of the command and of each other.
pub(crate) fn spikes(engine: &Engine, fit: &Fit) -> Option<UnmodelledDynamics> {
    fit.noise.outliers?;
    let data = engine.data;
    let errors = engine.observed.errors(&fit.residual);
    let white = fit.noise.innovations(&errors);
    let far = far_off(&fit.noise, &white);
    let after = after_changes(data, fit.model.chain(engine.base(), data).delay_s);
    let place = if let Some(count) = count_after_changes(&far, &after) {
        format!("in {count} readings far off just after changes of the voltage")
    } else if let Some(count) = count_in_runs(&far, &white) {
        format!("in {count} readings far off that come in runs to one side")
    } else {
        format!(
            "in an error that steps at {} readings and stays there",
            count_of_steps(&far, &errors, fit.noise.sigma)?
        )
    };
    let far_ones: Vec<f64> = white.iter().zip(&far).map(|(white, far)| if *far { *white } else { 0.0 }).collect();
    // Compared with the innovations, because the autoregression may have been fitted to follow each spike.
    let of_far = dot(&far_ones, &far_ones);
    let place = place + &Localisation::new(data, &far_ones).words();
    let (share, rms) = (of_far / dot(&white, &white), (of_far / white.len() as f64).sqrt());
    Some(UnmodelledDynamics::certain_in_whitened(place, share, rms))
}

/// Number of far rows just after a change of the voltage, if it is significant.
fn count_after_changes(far: &[bool], after: &[bool]) -> Option<usize> {
    let all = far.iter().filter(|far| **far).count();
    let count = far.iter().zip(after).filter(|(far, after)| **far && **after).count();
    (count as f64 > SHARE_AFTER_CHANGES.get() * all as f64 && follow(all, count, after)).then_some(count)
}

/// Number of all far rows, if significantly many follow another of equal sign.
fn count_in_runs(far: &[bool], white: &[f64]) -> Option<usize> {
    let count = far.iter().filter(|far| **far).count();
    let neighbours = (1..far.len()).filter(|&row| far[row] && far[row - 1]);
    let (alike, unlike): (Vec<usize>, Vec<usize>) = neighbours.partition(|&row| white[row] * white[row - 1] > 0.0);
    let (alike, unlike) = (alike.len() as f64, unlike.len() as f64);
    let z = (alike - unlike) / (alike + unlike).sqrt();
    (alike > SHARE_IN_RUNS.get() * count as f64 && z > Z_RARE).then_some(count)
}

/// Number of far rows at which the error steps from one level to another, if they are more than those at which it returns: levels
/// are medians of the rows before and after.
fn count_of_steps(far: &[bool], errors: &[f64], sigma: f64) -> Option<usize> {
    let (mut steps, mut spikes) = (0, 0);
    let level = |rows: &[f64]| median(&mut rows.to_vec());
    for row in (LEVEL..far.len().saturating_sub(LEVEL)).filter(|&row| far[row]) {
        let sides = [level(&errors[row - LEVEL..row]), level(&errors[row + 1..=row + LEVEL])];
        let [Some(before), Some(after)] = sides.map(|level| Some(errors[row] - level?)) else { continue };
        let is_far = |apart: f64| apart.abs() > 0.5 * FAR_OFF_SCALES.get() * sigma;
        // Neither is an echo of an earlier spike in the innovations.
        match (is_far(before), is_far(after)) {
            (true, true) if before * after > 0.0 => spikes += 1,
            (false, false) => {}
            _ => steps += 1,
        }
    }
    (steps > spikes && steps >= FEWEST_STEPS).then_some(steps)
}

/// What is known of the readings without the outliers of a fit, which are no error of a simulation; far readings that follow the command
/// or come in runs are one.
pub(crate) fn without_outliers(engine: &Engine, fit: &Fit) -> Observed {
    if fit.noise.outliers.is_none() || spikes(engine, fit).is_some() {
        return engine.observed.clone();
    }
    let errors = engine.observed.errors(&fit.residual);
    engine.observed.ignoring(&far_off(&fit.noise, &fit.noise.innovations(&errors)))
}

/// For each row, true if the reading is far off by its innovation, beyond what rounding makes of it.
pub(crate) fn far_off(noise: &Noise, innovations: &[f64]) -> Vec<bool> {
    let near_v = noise.half_step + FAR_OFF_SCALES.get() * noise.sigma;
    innovations.iter().map(|innovation| innovation.abs() > near_v).collect()
}

/// For each row, true if it is just after a change of the voltage, which leaves the amplifier `delay_s` seconds late.
fn after_changes(data: &Data, delay_s: f64) -> Vec<bool> {
    let mut after = vec![false; data.rows()];
    let first_from = |time: f64| data.time_s.partition_point(|&at| at < time);
    for (row, _) in changes(&data.voltage_v, data.full_scale_v) {
        // From the command on: the simulated delay may not be the spring's.
        let leaves = data.time_s[row] + delay_s;
        after[row..first_from(leaves + ROWS_AFTER_CHANGE.get() * data.sample_s)].fill(true);
    }
    after
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::model::Model;
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    const ROWS: usize = 800;
    const STAIR: usize = 80;

    /// Checks the paper's spring on a stair, where two readings of each step are off, `off(step)` rows after its start.
    fn checked(off: impl Fn(usize) -> usize) -> Option<UnmodelledDynamics> {
        let volts = |row: usize| 100.0 * (5 - (row / STAIR).abs_diff(5)) as f64;
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: volts(row), measured: Some(0.0) };
        let mut data = Data::new(&Record { name: String::new(), rows: (0..ROWS).map(row).collect() }, Input::Hold);
        let base = Base::paper();
        let mut readings = Vec::new();
        Simulator::new(&data, &base).run(&Model::default(), &mut readings);
        let spike = |row: usize| if row % STAIR / 2 == off(row / STAIR) / 2 { 30.0 } else { 0.0 };
        let rows = readings.into_iter().zip(normals(ROWS)).enumerate();
        data.reading = rows.map(|(row, (reading, noise))| reading + noise + spike(row)).collect();
        let observed = Observed::new(&data);
        let mut engine = Engine::new(&data, &observed, &base);
        let fit = engine.evaluate(Model::default());
        assert!(fit.noise.outliers.is_some(), "{:?}", fit.noise);
        spikes(&engine, &fit)
    }

    #[test]
    fn spikes_after_changes_of_the_command_are_no_outliers() {
        let left = checked(|_| 0).unwrap();
        assert!(left.significant && left.share > 0.5 && left.place.contains("18 readings"), "{left:?}");
        assert_eq!(checked(|stair| 6 + 7 * stair), None);
    }
}
