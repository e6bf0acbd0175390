//! A second edition of the set [`unforeseen`](super::unforeseen): other laws from the literature of actuators, smart materials, process
//! dynamics, sensors and instrumentation, none of which is in any other set.
//!
//! Equations, sizes and true cause codes come from an author who had not read the diagnosis, and were fixed before the first run.
//!
//! | module | contents |
//! | --- | --- |
//! | [`relaxation`] | relaxation, creep, leakage, heat |
//! | [`hysteresis`] | hysteresis, friction, switching |
//! | [`curves`] | static curves, bounds |
//! | [`dynamics`] | slew, transport, lags, filters and modes of amplifier and sensor |
//! | [`slow`] | changes over the record |
//! | [`readings`] | converters, disturbances, single readings |

pub mod curves;
pub mod dynamics;
pub mod hysteresis;
pub mod readings;
pub mod relaxation;
pub mod slow;

use crate::unforeseen::law::Law;

/// All laws with the name of their family.
pub fn all() -> Vec<(&'static str, Law)> {
    let families: [(&str, &[Law]); 6] = [
        ("relaxation and leakage", &relaxation::LAWS),
        ("hysteresis", &hysteresis::LAWS),
        ("curves and bounds", &curves::LAWS),
        ("dynamics of amplifier and sensor", &dynamics::LAWS),
        ("changes over the record", &slow::LAWS),
        ("readings", &readings::LAWS),
    ];
    families.into_iter().flat_map(|(family, laws)| laws.iter().map(move |law| (family, *law))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{out_of_model, unforeseen};

    #[test]
    fn no_law_has_the_name_of_one_in_another_set() {
        let others = unforeseen::all().into_iter().map(|(_, law)| law.name);
        let others: Vec<&str> = others.chain(out_of_model::all().iter().map(|form| form.name)).collect();
        assert!(all().iter().all(|(_, law)| !others.contains(&law.name)));
    }

    #[test]
    fn at_size_0_every_law_is_the_papers_spring_with_true_time_stamps() {
        unforeseen::tests::are_the_papers_spring_at_size_0(&all());
    }

    #[test]
    fn names_are_unique_and_every_law_exceeds_the_noise() {
        unforeseen::tests::exceed_the_noise(&all());
    }

    #[test]
    fn finer_time_steps_change_no_more_than_the_noise() {
        unforeseen::tests::do_not_depend_on_the_time_steps(&all());
    }

    #[test]
    fn the_same_seed_gives_the_same_record_to_the_bit() {
        for (_, law) in all() {
            assert_eq!(law.draw(3), law.draw(3), "{law:?}");
            assert_ne!(law.draw(3).1, law.draw(4).1, "{law:?}");
        }
    }

    #[test]
    fn every_law_adds_at_least_the_variance_of_the_noise() {
        for (_, law) in all() {
            for seed in 100..104 {
                let [with, none] = [1.0, 0.0].map(|size| law.at(seed, size, out_of_model::form::STEPS).0);
                let off = with.readings.read.iter().zip(&none.readings.read).map(|(a, b)| (a - b).powi(2));
                let rms = (off.sum::<f64>() / with.readings.read.len() as f64).sqrt();
                assert!(rms > with.noise.sigma_v, "{law:?}, seed {seed}: {rms} V");
            }
        }
    }
}
