//! The relaxation of a nominal spring that was identified from the record that is diagnosed. Causes that a linear model lacks bias it,
//! so that every set of causes is fitted together with it.
//!
//! | coordinates | of |
//! | --- | --- |
//! | share, logarithm of the time constant | the first lag |
//! | logarithm of the time constant, weight | each further lag |
//! | logarithms of frequency and damping ratio, both weights | each oscillation |
//!
//! Zero and gain of the reading are estimated for each model, as the initial state is: the prediction is linear in them.

use crate::effects::effect::Coordinate;
use crate::plant::relaxation::{Part, Relaxation, contributes};
use crate::record::data::Data;
use simulation::plant_file::Mode;

/// Causes that are linear dynamics of the spring, of which an identified one has its own.
pub const LINEAR_DYNAMICS: [&str; 5] = ["charge-leakage", "second-relaxation", "series-lag", "resonance", "delay"];

/// Place of the first time constant among the [`coordinates`].
pub const TIME_CONSTANT: usize = 1;
/// Largest change of a weight, relative to the static gain.
const MOST_OF_WEIGHT: f64 = 2.0;
/// Largest ratio of a frequency, and of a damping ratio, to the identified one.
const MOST_OF_FREQUENCY: f64 = 1.5;
const MOST_OF_DAMPING: f64 = 10.0;

/// Returns the coordinates of an identified relaxation with their values.
pub fn coordinates(relaxation: &Relaxation, data: &Data) -> Vec<(Coordinate, f64)> {
    let weight = |value: f64| (Coordinate::new(value - MOST_OF_WEIGHT, value + MOST_OF_WEIGHT), value);
    let tau = |tau_s: f64| {
        let (shortest, longest) = (0.2 * data.sample_s, 10.0 * data.duration_s());
        (Coordinate::log(shortest.min(tau_s), longest.max(tau_s)), tau_s.ln())
    };
    let near = |value: f64, most: f64| (Coordinate::log(value / most, value * most), value.ln());
    let mut all = vec![weight(relaxation.share), tau(relaxation.tau_s)];
    relaxation.parts().for_each(|part| all.extend([tau(part.tau_s), weight(part.part)]));
    relaxation.oscillations().for_each(|Mode { freq_hz, zeta, weight: of_state, rate_weight }| {
        all.extend([
            near(freq_hz, MOST_OF_FREQUENCY),
            near(zeta, MOST_OF_DAMPING),
            weight(of_state),
            weight(rate_weight),
        ]);
    });
    all
}

/// Returns the relaxation with other values of its [`coordinates`].
///
/// # Panics
/// With fewer values than coordinates.
pub fn moved(relaxation: &Relaxation, mut values: impl Iterator<Item = f64>) -> Relaxation {
    let mut next = || values.next().expect("a value for each coordinate");
    let mut moved = Relaxation { share: next(), ..*relaxation };
    let factor = next().exp() / relaxation.tau_s;
    moved.tau_s *= factor;
    moved.tau_high_s *= factor;
    for part in moved.further.iter_mut().filter(|part| part.part != 0.0) {
        *part = Part { tau_s: next().exp(), part: next() };
    }
    for mode in moved.modes.iter_mut().filter(|mode| contributes(mode)) {
        *mode = Mode { freq_hz: next().exp(), zeta: next().exp(), weight: next(), rate_weight: next() };
    }
    moved
}

/// Returns the [`coordinates`] without each of the further lags and oscillations that still have a weight: weights of 0 and the rest of
/// them are kept in a fit. Beside an oscillation also with the first lag as feedthrough: as fast as it may be, with a share of 0 beside
/// it. Empty without coordinates.
pub fn without_each(relaxation: &Relaxation, coordinates: &[(Coordinate, f64)]) -> Vec<Vec<(Coordinate, f64)>> {
    let lags = relaxation.parts().map(|_| (2, 1));
    let oscillations = relaxation.oscillations().map(|_| (4, 2));
    let mut first = TIME_CONSTANT + 1;
    let mut without = Vec::new();
    if coordinates.is_empty() {
        return without;
    }
    for (count, weights) in lags.chain(oscillations) {
        let mut kept = coordinates.to_vec();
        let own = &mut kept[first..first + count];
        first += count;
        if own.iter().any(|(coordinate, _)| !coordinate.fitted) {
            continue;
        }
        own.iter_mut().for_each(|(coordinate, _)| coordinate.fitted = false);
        own[count - weights..].iter_mut().for_each(|(_, weight)| *weight = 0.0);
        without.push(kept);
    }
    let oscillates = moved(relaxation, coordinates.iter().map(|(_, value)| *value)).oscillations().next().is_some();
    if oscillates && coordinates[TIME_CONSTANT].0.fitted {
        let mut kept = coordinates.to_vec();
        let fastest = kept[TIME_CONSTANT].0.lowest;
        for ((coordinate, value), fixed) in kept.iter_mut().zip([0.0, fastest]) {
            (coordinate.fitted, *value) = (false, fixed);
        }
        without.push(kept);
    }
    without
}

/// Returns true for a cause that would be another value of what is estimated with an identified relaxation.
pub fn contains(relaxation: &Relaxation, cause: &str) -> bool {
    match cause {
        "gain-error" | "time-constant" | "instantaneous-share" => true,
        "second-relaxation" => relaxation.parts().next().is_some(),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use simulation::record::Record;

    /// A relaxation and its coordinates.
    fn two_lags_and_an_oscillation() -> (Relaxation, Vec<(Coordinate, f64)>) {
        let rows: String = (0..20).map(|row| format!("{row},{},0\n", 100 * (row / 5 % 2))).collect();
        let record = Record::parse("r", &format!("time_s,voltage_v,stiffness\n{rows}"), "stiffness").unwrap();
        let mut relaxation = Relaxation::plain(0.1, 4.0);
        relaxation.further[0] = Part { part: -0.3, tau_s: 0.7 };
        relaxation.modes[0] = Mode { freq_hz: 0.2, zeta: 0.1, weight: 0.4, rate_weight: -0.05 };
        (relaxation, coordinates(&relaxation, &Data::new(&record, Input::Hold)))
    }

    #[test]
    fn coordinates_of_a_relaxation_give_it_back() {
        let (relaxation, coordinates) = two_lags_and_an_oscillation();
        assert_eq!(coordinates.len(), 8);
        assert!(coordinates.iter().all(|(of, value)| of.lowest < *value && *value < of.highest), "{coordinates:?}");
        let back = moved(&relaxation, coordinates.iter().map(|(_, value)| *value));
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        assert!(near(back.tau_s, 4.0) && near(back.tau_high_s, 4.0) && back.share == 0.1, "{back:?}");
        assert!(near(back.further[0].tau_s, 0.7) && back.further[0].part == -0.3, "{back:?}");
        assert!(near(back.modes[0].freq_hz, 0.2) && near(back.modes[0].zeta, 0.1), "{back:?}");
        assert_eq!((back.modes[0].weight, back.modes[0].rate_weight), (0.4, -0.05));
    }

    #[test]
    fn each_lag_and_oscillation_is_left_out_once() {
        let (relaxation, all) = two_lags_and_an_oscillation();
        assert!(without_each(&relaxation, &[]).is_empty());
        let without = without_each(&relaxation, &all);
        let fixed = |of: &[(Coordinate, f64)]| -> Vec<usize> { (0..8).filter(|&at| !of[at].0.fitted).collect() };
        let each = [vec![2, 3], vec![4, 5, 6, 7], vec![0, 1]];
        assert_eq!(without.iter().map(|of| fixed(of)).collect::<Vec<_>>(), each);
        let of = |kept: &[(Coordinate, f64)]| moved(&relaxation, kept.iter().map(|(_, value)| *value));
        assert_eq!((of(&without[0]).parts().count(), of(&without[0]).oscillations().count()), (0, 1));
        assert_eq!((of(&without[1]).parts().count(), of(&without[1]).oscillations().count()), (1, 0));
        let feedthrough = of(&without[2]);
        assert_eq!((feedthrough.share, feedthrough.tau_s), (0.0, all[1].0.lowest.exp()));
        let more = |of: &[(Coordinate, f64)]| without_each(&relaxation, of);
        let fewer: Vec<_> = more(&without[0]).iter().map(|of| fixed(of)).collect();
        assert_eq!(fewer, [vec![2, 3, 4, 5, 6, 7], vec![0, 1, 2, 3]]);
        let neither = more(&without[1]);
        assert_eq!(neither.iter().map(|of| fixed(of)).collect::<Vec<_>>(), [vec![2, 3, 4, 5, 6, 7]]);
        assert!(without_each(&relaxation, &neither[0]).is_empty());
    }

    #[test]
    fn causes_that_are_estimated_are_no_causes() {
        let mut relaxation = Relaxation::plain(0.1, 4.0);
        assert!(contains(&relaxation, "gain-error") && !contains(&relaxation, "second-relaxation"));
        assert!(!contains(&relaxation, "hysteresis"));
        relaxation.further[0] = Part { part: 0.3, tau_s: 9.0 };
        assert!(contains(&relaxation, "second-relaxation"));
    }
}
