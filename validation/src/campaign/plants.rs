//! Single effects in other springs: nominal time constants from 1 ms to 1 h, one to three of them, shares from 0 to 0.8, full scales
//! from 1 mV to 10 kV; stairs, random levels, multisines, chirps and ramps; white, coloured and rounded noise.
//!
//! The record is simulated in the paper's units and written in others, by [`scales`]. A record is drawn until an oracle
//! detector could isolate its effect in the paper's spring with the same schedule and noise, at most 8 times.

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::case::{Case, Expected};
use super::part::seed;
use super::scales;
use super::subject::{Nominal, Subject};
use super::{detectable, isolable};
use crate::ground_truth::noise::{Kind as NoiseKind, Noise};
use crate::ground_truth::physics::{Further, TAU_S};
use crate::ground_truth::schedule::{Kind, Sampling, Schedule};
use crate::ground_truth::{Cause, Effect, LabelledRecord};

/// Kinds of noise in turn: name, kind, range of the standard deviation in percent of full scale, step in standard deviations.
const NOISES: [(&str, NoiseKind, [f64; 2], f64); 5] = [
    ("white, 0.2 to 0.5 %", NoiseKind::White, [0.2, 0.5], 0.0),
    ("white, 0.5 to 2 %", NoiseKind::White, [0.5, 2.0], 0.0),
    ("AR(1), 0.2 to 1 %", NoiseKind::Coloured, [0.2, 1.0], 0.0),
    ("1/f, 0.2 to 1 %", NoiseKind::OneOverF, [0.2, 1.0], 0.0),
    ("white, 0.2 to 0.5 %, rounded", NoiseKind::White, [0.2, 0.5], 1.0),
];
/// Size relative to the smallest one that can be isolated in white noise.
const MARGIN: f64 = 1.5;
/// Size in coloured noise relative to the smallest one that can be isolated in white noise, since neighbouring readings are not
/// independent.
const COLOURED_MARGIN: f64 = 2.5;
/// Largest number of draws until an effect can be isolated; the strength of the noise shrinks from draw to draw.
const DRAWS: i32 = 8;

/// `count` records of each cause, and three times as many without an effect.
pub fn cases(first: u64, count: usize) -> Vec<Case> {
    let causes = Cause::ALL.into_iter().map(Some).chain([None; 3]);
    let each = causes.flat_map(|cause| std::iter::repeat_n(cause, count));
    each.enumerate().map(|(index, cause)| of(cause, index, seed(first, 17, index))).collect()
}

/// The `index`-th record of the set: schedules, noises and numbers of time constants in turn.
fn of(cause: Option<Cause>, index: usize, seed: u64) -> Case {
    let schedules = [Kind::UpDown, Kind::Random, Kind::Multisine, Kind::Chirp, Kind::Ramps];
    let noise = index % NOISES.len();
    // A slow schedule does not show what acts in steps.
    let shown: Vec<Kind> = schedules
        .into_iter()
        .filter(|kind| !(cause.is_some_and(|cause| cause.facts().needs_steps) && *kind == Kind::Ramps))
        .collect();
    let schedule = shown[(index / NOISES.len() + index) % shown.len()];
    let lags = 1 + index / 2 % 3;
    let mut expected = Expected::exactly(&cause.into_iter().collect::<Vec<_>>());
    if NOISES[noise].3 > 0.0 && cause != Some(Cause::Quantisation) {
        expected.also.push(Cause::Quantisation.name());
        expected.or_none = cause.is_none();
    }
    Case {
        group: cause.map_or("no effect", Cause::name).to_owned(),
        kinds: vec![schedule.name().to_owned(), NOISES[noise].0.to_owned(), lags.to_string()],
        seed,
        expected,
        draw: Box::new(move |seed| draw(cause, schedule, noise, lags, seed)),
    }
}

fn draw(cause: Option<Cause>, kind: Kind, noise: usize, lags: usize, seed: u64) -> Subject {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let paper = isolable_record(&mut random, cause, kind, noise, seed);
    let mut size = scales::size_for(&paper, &mut random);
    let mut further = [Further::default(); 2];
    for lag in &mut further[..lags - 1] {
        // Apart from the main time constant, and shorter than the record.
        let slower = random.random_bool(0.5);
        let ratio = if slower { random.random_range(2.5..5.0) } else { random.random_range(0.15..0.4) };
        *lag = Further { part: random.random_range(0.1..0.3), tau_s: TAU_S * ratio };
    }
    let mut hidden = paper.with_relaxation(size.share, further);
    // Rounding would destroy the lattice of a quantisation.
    let rounded = cause != Some(Cause::Quantisation);
    let rounding = if rounded { NOISES[noise].3 * hidden.noise.sigma_v } else { 0.0 };
    if rounding > 0.0 {
        hidden.readings.read.iter_mut().for_each(|y| *y = (*y / rounding).round() * rounding);
        // A converter without a zero of its own keeps its lattice only if the sensor's zero is on it.
        size.zero = 0.0;
    }
    let record = size.record(&hidden.record());
    let mut nominal = size.plant();
    if lags > 1 {
        let slower = further[..lags - 1].iter();
        let parts: Vec<f64> = slower.clone().map(|lag| lag.part).collect();
        let main = 1.0 - parts.iter().sum::<f64>();
        let time = size.tau_s / TAU_S;
        nominal.relaxation.tau_s.extend(slower.map(|lag| time * lag.tau_s));
        nominal.relaxation.weights = std::iter::once(main).chain(parts).map(|part| (1.0 - size.share) * part).collect();
    }
    Subject { hidden, record, nominal: Nominal::Known(Box::new(nominal)) }
}

/// A record of the paper's spring whose effect, if it has one, an oracle detector could isolate; or the last draw.
fn isolable_record(
    random: &mut ChaCha8Rng,
    cause: Option<Cause>,
    kind: Kind,
    noise: usize,
    seed: u64,
) -> LabelledRecord {
    let (_, colour, [low, high], _) = NOISES[noise];
    let mut draw = 0;
    loop {
        let most = low + (high - low) * 0.7f64.powi(draw);
        draw += 1;
        let rows = *[1001, 1601, 2401].choose(random).expect("three numbers");
        let sampling = Sampling::draw(random, rows, false);
        let schedule = Schedule::draw(random, kind, sampling, 500.0);
        let noise = Noise::white(random.random_range(low..most)).of(colour);
        let effects: Vec<Effect> =
            cause.iter().map(|&cause| Effect::draw(random, cause, 0, &schedule, noise.sigma_v)).collect();
        let record = LabelledRecord::new(schedule, effects, noise, seed);
        let margin = if colour == NoiseKind::White { MARGIN } else { COLOURED_MARGIN };
        let isolated = |record: &LabelledRecord| {
            detectable::size(record).is_some_and(|size| margin * size * isolable::factor(record, size) < 1.0)
        };
        if cause.is_none() || draw == DRAWS || isolated(&record) {
            return record;
        }
    }
}

#[cfg(test)]
mod tests {
    use simulation::plant_file::PlantFile;

    use super::*;
    use crate::ground_truth::spring::Spring;

    /// The plant file of the nominal spring.
    fn plant(subject: &Subject) -> PlantFile {
        let Nominal::Known(plant) = &subject.nominal else { panic!("{:?}", subject.nominal) };
        (**plant).clone()
    }

    /// Response of a nominal spring of the plant file at the record's rows by exact exponentials, in the reading's unit.
    fn nominal_readings(subject: &Subject) -> Vec<f64> {
        let plant = plant(subject);
        let (relaxation, reading) = (&plant.relaxation, plant.reading.unwrap());
        let weights =
            if relaxation.weights.is_empty() { vec![1.0 - relaxation.share] } else { relaxation.weights.clone() };
        let mut lags = vec![0.0; weights.len()];
        let mut last: Option<(f64, f64)> = None;
        let row = |row: &simulation::record::Row| {
            if let Some((time, voltage)) = last {
                for (lag, tau) in lags.iter_mut().zip(&relaxation.tau_s) {
                    *lag = voltage + (*lag - voltage) * (-(row.time_s - time) / tau).exp();
                }
            }
            last = Some((row.time_s, row.voltage_v));
            let relaxed: f64 = lags.iter().zip(&weights).map(|(lag, weight)| lag * weight).sum();
            reading.zero + reading.gain * (relaxation.share * row.voltage_v + relaxed)
        };
        subject.record.rows.iter().map(row).collect()
    }

    #[test]
    fn without_an_effect_the_readings_are_those_of_the_nominal_spring_in_noise() {
        for case in cases(5, 4).into_iter().filter(|case| case.group == "no effect") {
            let subject = (case.draw)(case.seed);
            let reading = plant(&subject).reading.unwrap();
            let span = subject.record.rows.iter().map(|row| row.voltage_v).fold(0.0, f64::max);
            let unit = (reading.gain * span / 500.0).abs();
            let squares: f64 = nominal_readings(&subject)
                .iter()
                .zip(&subject.record.rows)
                .map(|(y, row)| ((row.measured.unwrap() - y) / unit / subject.hidden.noise.sigma_v).powi(2))
                .sum();
            let rms = (squares / subject.record.rows.len() as f64).sqrt();
            assert!((0.6..1.5).contains(&rms), "{case:?}: {rms}");
        }
    }

    #[test]
    fn every_schedule_noise_and_number_of_time_constants_occurs_with_every_cause() {
        let cases = cases(1, 30);
        for table in 0..3 {
            let mut kinds: Vec<&str> = cases.iter().map(|case| case.kinds[table].as_str()).collect();
            kinds.sort_unstable();
            kinds.dedup();
            assert_eq!(kinds.len(), [5, 5, 3][table], "{kinds:?}");
            for cause in Cause::ALL {
                let own = cases.iter().filter(|case| case.group == cause.name());
                let mut own: Vec<&str> = own.map(|case| case.kinds[table].as_str()).collect();
                own.sort_unstable();
                own.dedup();
                assert!(own.len() >= [4, 5, 3][table], "{cause}: {own:?}");
            }
        }
    }

    #[test]
    fn further_lags_settle_and_slow_the_response() {
        let time_s: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
        let hold = Schedule { voltage_v: vec![500.0; 3000], time_s };
        let further = [Further { part: 0.3, tau_s: 20.0 }, Further { part: 0.1, tau_s: 1.0 }];
        let spring = Spring { further, ..Spring::default() };
        let y = spring.run(&hold, 20);
        let at = |t: f64| {
            let left = 0.6 * (-t / TAU_S).exp() + 0.3 * (-t / 20.0).exp() + 0.1 * (-t).exp();
            500.0 * (1.0 - 10.0 / 11.0 * left)
        };
        assert!((y[100] - at(10.0)).abs() < 1e-3 && (y[2999] - 500.0).abs() < 0.01, "{} {}", y[100], at(10.0));
    }
}
