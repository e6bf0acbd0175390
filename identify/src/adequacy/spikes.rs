//! Spikes that are no outliers: they keep time with the command, or keep company.
//!
//! Outliers come at any time, each for itself. A delay that varies, or commands that are taken late, leave spikes of a row or
//! two just after changes of the voltage; a reading that is held for some rows leaves runs of spikes to one side. Noise of two
//! scales holds both for outliers. By chance, of `n` far readings about `n p` lie just after a change, `p` being the part of
//! all rows that do, and of neighbours that are both far as many are on one side as on both:
//!
//! ```text
//! z = (count - n p) / sqrt(n p (1 - p)),      z = (alike - unlike) / sqrt(alike + unlike)
//! ```

use crate::adequacy::localisation::whereabouts;
use crate::adequacy::unmodelled::{Leftover, RARE};
use crate::fit::engine::{Engine, Fit};
use crate::noise::Noise;
use crate::record::data::Data;
use crate::stats::sums::dot;

/// A reading this many of the noise's scales off is far off.
const FAR: f64 = 4.0;
/// A change of the voltage, as a part of the full scale.
const CHANGE: f64 = 0.01;
/// Rows from the change, as it leaves the amplifier, that are just after it.
const AFTER: f64 = 4.0;
/// Part of the far readings that must lie just after a change.
const MOST: f64 = 0.5;
/// Or must be beside one before them on the same side.
const IN_RUNS: f64 = 0.2;

/// What far readings tell, if they are just after changes of the voltage, or in runs, too often to be outliers.
pub fn test(engine: &Engine, fit: &Fit) -> Option<Leftover> {
    fit.noise.outliers?;
    let data = engine.data;
    let errors = engine.observed.errors(&fit.residual);
    let white = fit.noise.innovations(&errors);
    let far = far_off(&fit.noise, &white);
    let after = after_changes(data, fit.model.chain(engine.base(), data).delay_s);
    let count = in_time(&far, &after);
    let place = match count {
        Some(count) => format!("in {count} readings far off just after changes of the voltage"),
        None => format!("in {} readings far off that come in runs to one side", in_runs(&far, &white)?),
    };
    let far_ones: Vec<f64> = white.iter().zip(&far).map(|(white, far)| if *far { *white } else { 0.0 }).collect();
    // Beside what the noise's memory does not foretell: that may have learnt to follow from the spike on.
    let of_far = dot(&far_ones, &far_ones);
    Some(Leftover {
        place: place + &whereabouts(data, &far_ones),
        share: of_far / dot(&white, &white),
        rms: (of_far / white.len() as f64).sqrt(),
        significant: true,
        doubtful: true,
    })
}

/// How many far rows are just after a change of the voltage, if that is no chance.
fn in_time(far: &[bool], after: &[bool]) -> Option<usize> {
    let of_rows = |rows: &[bool]| rows.iter().filter(|row| **row).count();
    let count = far.iter().zip(after).filter(|(far, after)| **far && **after).count();
    let (all, part) = (of_rows(far) as f64, of_rows(after) as f64 / after.len() as f64);
    let surprise = (count as f64 - all * part) / (all * part * (1.0 - part)).sqrt();
    (count as f64 > MOST * all && surprise > RARE).then_some(count)
}

/// How many far rows there are, if so many are beside another on the same side that it is no chance.
fn in_runs(far: &[bool], white: &[f64]) -> Option<usize> {
    let count = far.iter().filter(|far| **far).count();
    let beside = (1..far.len()).filter(|&row| far[row] && far[row - 1]);
    let (alike, unlike): (Vec<usize>, Vec<usize>) = beside.partition(|&row| white[row] * white[row - 1] > 0.0);
    let (alike, unlike) = (alike.len() as f64, unlike.len() as f64);
    let surprise = (alike - unlike) / (alike + unlike).sqrt();
    (alike > IN_RUNS * count as f64 && surprise > RARE).then_some(count)
}

/// Rows whose readings are far off, by their innovations.
pub(crate) fn far_off(noise: &Noise, innovations: &[f64]) -> Vec<bool> {
    innovations.iter().map(|innovation| innovation.abs() > FAR * noise.sigma).collect()
}

/// Rows that are just after a change of the voltage, which leaves the amplifier `delay_s` late.
fn after_changes(data: &Data, delay_s: f64) -> Vec<bool> {
    let mut after = vec![false; data.rows()];
    let first_from = |time: f64| data.time_s.partition_point(|&at| at < time);
    for row in 1..data.rows() {
        if (data.voltage_v[row] - data.voltage_v[row - 1]).abs() <= CHANGE * data.full_scale_v {
            continue;
        }
        // From the command on: a delay that the simulation has may be none of the spring's.
        let leaves = data.time_s[row] + delay_s;
        after[row..first_from(leaves + AFTER * data.sample_s)].fill(true);
    }
    after
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::model::Model;
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::data::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    const ROWS: usize = 800;
    const STAIR: usize = 80;

    /// What is told of the paper's spring on a stair, where two readings of each stair are off, so many rows from its start.
    fn told(off: impl Fn(usize) -> usize) -> Option<Leftover> {
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
        test(&engine, &fit)
    }

    #[test]
    fn spikes_in_time_with_the_command_are_no_outliers() {
        let left = told(|_| 0).unwrap();
        assert!(left.significant && left.share > 0.5 && left.place.contains("18 readings"), "{left:?}");
        assert_eq!(told(|stair| 6 + 7 * stair), None);
    }
}
