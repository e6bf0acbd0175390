//! Spikes that keep time with the command.
//!
//! Outliers come at any time. A delay that varies, or commands that are taken late, leave spikes of a row or two just after
//! changes of the voltage; noise of two scales holds them for outliers. By chance, of `n` far readings about `n p` lie just
//! after a change, `p` being the part of all rows that do:
//!
//! ```text
//! z = (count - n p) / sqrt(n p (1 - p))
//! ```

use super::data::Data;
use super::fit::{Engine, Fit};
use super::leftover::{Leftover, RARE};
use super::noise::Noise;
use super::sums::dot;

/// A reading this many of the noise's scales off is far off.
const FAR: f64 = 4.0;
/// A change of the voltage, as a part of the full scale.
const CHANGE: f64 = 0.01;
/// Rows from the change, as it leaves the amplifier, that are just after it.
const AFTER: f64 = 4.0;
/// Part of the far readings that must lie just after a change.
const MOST: f64 = 0.5;

/// What far readings tell, if they are just after changes of the voltage too often to be outliers.
pub fn test(engine: &Engine, fit: &Fit) -> Option<Leftover> {
    fit.noise.wide?;
    let data = engine.data;
    let errors = engine.observed.errors(&fit.residual);
    let white = fit.noise.innovations(&errors);
    let far = far_off(&fit.noise, &white);
    let after = after_changes(data, fit.model.chain(engine.simulator.base, data).delay_s);
    let count = far.iter().zip(&after).filter(|(far, after)| **far && **after).count() as f64;
    let of_rows = |rows: &[bool]| rows.iter().filter(|row| **row).count() as f64;
    let (all, part) = (of_rows(&far), of_rows(&after) / after.len() as f64);
    let surprise = (count - all * part) / (all * part * (1.0 - part)).sqrt();
    if !(count > MOST * all && surprise > RARE) {
        return None;
    }
    // Beside what the noise's memory does not foretell: that may have learnt to follow from the spike on.
    let of_far: f64 = white.iter().zip(&far).filter(|(_, far)| **far).map(|(white, _)| white * white).sum();
    Some(Leftover {
        place: format!("in {count} readings far off just after changes of the voltage"),
        share: of_far / dot(&white, &white),
        rms: (of_far / white.len() as f64).sqrt(),
        significant: true,
        doubtful: true,
    })
}

/// Rows whose readings are far off, by their innovations.
pub(super) fn far_off(noise: &Noise, innovations: &[f64]) -> Vec<bool> {
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
        let leaves = data.time_s[row] + delay_s;
        let rows = first_from(leaves - data.sample_s).max(row)..first_from(leaves + AFTER * data.sample_s);
        after[rows].fill(true);
    }
    after
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::base::Base;
    use crate::diagnose::data::Input;
    use crate::diagnose::model::{Model, Simulator};
    use crate::diagnose::noise::normals;
    use crate::diagnose::observed::Observed;
    use crate::record::{Record, Row};

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
        let mut engine = Engine::new(&data, &observed, Simulator::new(&data, &base));
        let fit = engine.at(Model::default());
        assert!(fit.noise.wide.is_some(), "{:?}", fit.noise);
        test(&engine, &fit)
    }

    #[test]
    fn spikes_in_time_with_the_command_are_no_outliers() {
        let left = told(|_| 0).unwrap();
        assert!(left.significant && left.share > 0.5 && left.place.contains("18 readings"), "{left:?}");
        assert_eq!(told(|stair| 6 + 7 * stair), None);
    }
}
