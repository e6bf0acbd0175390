//! Laws from the literature that nobody looked at while the diagnosis was made: a second test set besides
//! [`out_of_model`](super::out_of_model).
//!
//! In: a law and a seed. Out: a record with that law in it, as simulated and as written. Each law states which cause codes are true
//! of it, before any diagnosis. `unexplained` is an honest answer to all of them. A code may be one that the diagnosis does not have.
//!
//! | module | contents |
//! | --- | --- |
//! | [`law`] | one law with its names, and how a record of it is drawn |
//! | [`creep`] | relaxation, creep, leakage, a tank |
//! | [`hysteresis`], [`friction`] | hysteresis; friction, backlash, a gain by direction |
//! | [`curves`] | static curves, limits, heating |
//! | [`slow`] | changes over the record, clocks |
//! | [`sensor`] | lags, filters and modes of the sensor |
//! | [`readings`] | converters, lost samples, noise, disturbances |

pub mod creep;
pub mod curves;
pub mod friction;
pub mod hysteresis;
pub mod law;
pub mod readings;
pub mod sensor;
pub mod slow;

use self::law::Law;

/// All laws with the name of their family.
pub fn all() -> Vec<(&'static str, Law)> {
    let families: [(&str, &[Law]); 7] = [
        ("creep and leakage", &creep::LAWS),
        ("hysteresis", &hysteresis::LAWS),
        ("hysteresis", &friction::LAWS),
        ("curves and limits", &curves::LAWS),
        ("changes over the record", &slow::LAWS),
        ("dynamics of the sensor", &sensor::LAWS),
        ("readings", &readings::LAWS),
    ];
    families.into_iter().flat_map(|(family, laws)| laws.iter().map(move |law| (family, *law))).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::Schedule;
    use crate::out_of_model::chain::Chain;
    use crate::out_of_model::draw::Draw;
    use crate::out_of_model::form::STEPS;
    use crate::spring::Spring;

    /// A random source of laws of the given size for a record of 2000 rows in 200 s up to 500 V.
    pub(crate) fn draw(size: f64) -> Draw {
        let random = ChaCha8Rng::seed_from_u64(7);
        Draw { random, size, duration_s: 200.0, every_s: 0.1, full_v: 500.0, top_v: 500.0 }
    }

    fn furthest<'a>(a: impl IntoIterator<Item = &'a f64>, b: impl IntoIterator<Item = &'a f64>) -> f64 {
        a.into_iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn at_size_0_every_law_is_the_papers_spring_with_true_time_stamps() {
        are_the_papers_spring_at_size_0(&all());
    }

    pub(crate) fn are_the_papers_spring_at_size_0(laws: &[(&str, Law)]) {
        for (_, law) in laws {
            let (hidden, written) = law.at(40, 0.0, STEPS);
            let spring = Spring::default().run(&hidden.schedule, 20);
            let off = furthest(&hidden.readings.expected, &spring);
            assert!(off < 0.05, "{law:?}: {off} V");
            assert_eq!(written, hidden.record(), "{law:?}");
            let noisy: Vec<f64> =
                hidden.readings.read.iter().zip(&hidden.readings.expected).map(|(a, b)| a - b).collect();
            let rms = (noisy.iter().map(|x| x * x).sum::<f64>() / noisy.len() as f64).sqrt();
            assert!((0.9..1.1).contains(&rms), "{law:?}: noise of {rms} V");
        }
    }

    #[test]
    fn names_are_unique_and_every_law_exceeds_the_noise() {
        exceed_the_noise(&all());
    }

    pub(crate) fn exceed_the_noise(laws: &[(&str, Law)]) {
        assert!(laws.len() >= 30, "{}", laws.len());
        for (index, (_, law)) in laws.iter().enumerate() {
            assert!(laws[..index].iter().all(|(_, other)| other.name != law.name), "{law:?}");
            assert!(law.also.iter().all(|name| !law.first.contains(name)), "{law:?}");
            // The simulator's own causes, and the one that it does not simulate.
            let is_code = |name: &&str| *name == "stuck-sensor" || crate::Cause::named(name).is_some();
            assert!(law.first.iter().chain(law.also).all(is_code), "{law:?}");
            for seed in 50..52 {
                let (hidden, written) = law.draw(seed);
                let (none, _) = law.at(seed, 0.0, STEPS);
                let shown = furthest(&hidden.readings.read, &none.readings.read);
                let late = written.rows.iter().zip(&hidden.schedule.time_s).map(|(row, t)| (row.time_s - t).abs());
                let late = late.fold(0.0, f64::max);
                assert!((4.0..1500.0).contains(&shown) || late > 0.3 * hidden.schedule.every_s(), "{law:?}: {shown} V");
                assert!(written.rows.iter().all(|row| row.measured.is_some_and(f64::is_finite)), "{law:?}");
                assert!(written.rows.is_sorted_by(|a, b| a.time_s < b.time_s), "{law:?}");
            }
        }
    }

    #[test]
    fn finer_time_steps_change_no_more_than_the_noise() {
        do_not_depend_on_the_time_steps(&all());
    }

    pub(crate) fn do_not_depend_on_the_time_steps(laws: &[(&str, Law)]) {
        for (_, law) in laws {
            let [coarse, fine] = [STEPS, 3 * STEPS].map(|steps| law.at(60, 1.0, steps).0);
            let apart: f64 =
                coarse.readings.expected.iter().zip(&fine.readings.expected).map(|(a, b)| (a - b).powi(2)).sum();
            // A slip may come a row earlier or later, so single rows may differ by more.
            let rms = (apart / coarse.readings.expected.len() as f64).sqrt();
            assert!(rms < 1.5 * coarse.noise.sigma_v, "{law:?}: {rms} V");
        }
    }

    /// Settled stiffness at 250 V on the way up and down a slow loop from 0 to 500 V, by the law alone.
    fn branches(build: fn(&mut Draw) -> Chain, seed: u64) -> [f64; 2] {
        let mut source = draw(1.0);
        source.random = ChaCha8Rng::seed_from_u64(seed);
        let mut chain = build(&mut source);
        let up = (0..=500).map(f64::from);
        let course: Vec<f64> = up.clone().chain(up.clone().rev()).chain(up).collect();
        // 1000 s from row to row: relaxed.
        let schedule = Schedule { time_s: (0..course.len()).map(|k| 1000.0 * k as f64).collect(), voltage_v: course };
        let y = chain.stiffness(&schedule, 1);
        [1000 + 2 + 250, 500 + 250 + 1].map(|row| y[row])
    }

    #[test]
    fn every_hysteresis_has_a_loop_whose_branches_differ() {
        for law in hysteresis::LAWS.into_iter().chain(friction::LAWS) {
            for seed in 0..3 {
                let [up, down] = branches(law.build, seed);
                assert!((up - down).abs() > 8.0, "{law:?}: {up} {down}");
            }
        }
    }
}
