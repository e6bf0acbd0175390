//! The feedthrough, the part of a step that is reached without delay, is not the nominal one.
//!
//! | form | |
//! | --- | --- |
//! | instantaneous | `y = share q + (1 - share) lag(tau; q)` |
//! | quick | `y = share_0 q + part lag(quick; q) + (1 - share_0 - part) lag(tau; q)`: a part takes a short time |
//!
//! A quick part that is negative is at most the share that it follows: with more, the response to a step would reverse, as a delay and a
//! lag in series nearly do.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::plant::relaxation::Part;
use crate::record::data::Data;
use crate::record::scales::REFERENCE_TIME_CONSTANT_S;

pub(super) struct InstantaneousShare;

const QUICK: usize = 1;
/// Shortest time of a quick part, in rows, and the longest, in reference time constants: a slower part is a relaxation.
const SHORTEST: f64 = 0.05;
const LONGEST: f64 = 0.1;

/// Bounds of the time of a quick part, in s.
fn times_s(data: &Data) -> (f64, f64) {
    let shortest = SHORTEST * data.sample_s;
    (shortest, (LONGEST * REFERENCE_TIME_CONSTANT_S).max(2.0 * shortest))
}

/// Bounds of a quick part: neither it nor what is left of the slow one reverses the response.
fn parts(data: &Data) -> [f64; 2] {
    let share = data.normalisation.share.clamp(0.0, LARGEST_SHARE);
    [-share, 1.0 - share]
}

/// Largest nominal share that bounds a quick part.
const LARGEST_SHARE: f64 = 0.95;

/// Distances of initial points from the nominal share: a predicted gain counts changes towards the point only. One on each side, as the
/// response is linear in the share: of two with the same predicted gain rounding would choose.
const INITIAL_CHANGES: [f64; 2] = [-0.1, 0.1];

impl Effect for InstantaneousShare {
    fn cause(&self) -> &'static str {
        "instantaneous-share"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn description(&self) -> &'static str {
        "the instantaneous part of a step (feedthrough) differs"
    }

    fn isolating_experiment(&self) -> &'static str {
        "steps read within a hundredth of the time constant"
    }

    fn forms(&self) -> usize {
        2
    }

    fn common_forms(&self) -> usize {
        1
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        if form == QUICK {
            let (shortest, longest) = times_s(data);
            let [low, high] = parts(data);
            return vec![Coordinate::new(low, high), Coordinate::log(shortest, longest)];
        }
        // A nominal share outside of 0 to 1 has room on both sides, too.
        let far = 2.0 * data.normalisation.share;
        vec![Coordinate::new(far.min(-0.2), far.max(1.0))]
    }

    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        if form == QUICK {
            let (shortest, longest) = times_s(context.data);
            let times = [4.0 * shortest, 20.0 * shortest].into_iter().filter(|time| *time < longest);
            let [low, _] = parts(context.data);
            let initial = || [0.1, 0.5 * low.max(-0.1)].into_iter().filter(|part| *part != 0.0);
            return times.flat_map(|time| initial().map(move |part| vec![part, time.ln()])).collect();
        }
        let nominal = context.data.normalisation.share;
        INITIAL_CHANGES.map(|change| vec![nominal + change]).into()
    }

    fn quantities(&self, form: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        let name = if form == QUICK { "quick_share" } else { "share" };
        let time = (form == QUICK).then(|| Quantity::new("quick_s", Dimension::Time, point[1].exp()));
        [Quantity::new(name, Dimension::Ratio, point[0])].into_iter().chain(time).collect()
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        if form == QUICK {
            chain.relaxation.take_from_first(Part { part: point[0], tau_s: point[1].exp() });
        } else {
            chain.relaxation.set_share(point[0]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::plant::base::Base;
    use crate::record::input::Input;
    use simulation::record::{Record, Row};

    fn data() -> Data {
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: 100.0, measured: Some(100.0) };
        Data::new(&Record { name: String::new(), rows: (0..20).map(row).collect() }, Input::Hold)
    }

    #[test]
    fn initial_points_lie_on_both_sides_of_every_nominal_share() {
        for share in [0.0, 0.04, 0.2, 0.24, 0.6, 1.0] {
            let mut data = data();
            data.normalisation.share = share;
            let points = InstantaneousShare.initial_points(0, &FitContext { data: &data, residual: &[], sigma: 1.0 });
            let nearest = |side: f64| points.iter().filter(|point| side * (point[0] - share) > 0.01).count();
            assert!(nearest(-1.0) > 0 && nearest(1.0) > 0, "{share}: {points:?}");
        }
    }

    #[test]
    fn a_quick_part_stays_beside_creep() {
        let quick = Block { effect: index_of("instantaneous-share").unwrap(), form: QUICK };
        let creep = Block { effect: index_of("second-relaxation").unwrap(), form: 0 };
        let model = Model::default().with(quick, vec![0.07, 0.02f64.ln()]).with(creep, vec![0.2, 90f64.ln()]);
        let times = model.chain(&Base::paper(), &data()).relaxation.further.map(|further| further.tau_s);
        assert!((times[0] / 0.02 - 1.0).abs() < 1e-12 && (times[1] / 90.0 - 1.0).abs() < 1e-12, "{times:?}");
    }

    /// The lags of the nominal spring keep the ratios of their weights under another share and under creep.
    #[test]
    fn nominal_lags_stay_beside_another_share_and_creep() {
        let mut file: simulation::plant_file::PlantFile = model::Plant::PAPER.into();
        file.relaxation.share = 0.2;
        file.relaxation.tau_s = vec![5.0, 40.0];
        file.relaxation.weights = vec![0.6, 0.2];
        let base = Base::new(file).unwrap();
        let share = Block { effect: index_of("instantaneous-share").unwrap(), form: 0 };
        let creep = Block { effect: index_of("second-relaxation").unwrap(), form: 0 };
        let with_share = Model::default().with(share, vec![0.4]);
        let parts = |model: &Model| model.chain(&base, &data()).relaxation.further.map(|further| further.part);
        let near = |parts: [f64; 3], expected: [f64; 3]| parts.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(parts(&with_share), [0.15, 0.0, 0.0]));
        assert!(near(parts(&with_share.with(creep, vec![0.2, 300f64.ln()])), [0.1, 0.2, 0.0]));
    }
}
