//! Rate-independent hysteresis: the ascending and descending branches differ.
//!
//! A [`PlayBank`] of play operators, each with a threshold `r`: `f = (1 - sum weights) u + sum weight play`. The mean line of a
//! large loop has the slope 1: what is linear belongs to `gain-error`. Rayleigh's law has a slope of its own, that of a small loop.
//!
//! | form | plays | coordinates |
//! | --- | --- | --- |
//! | whole | one, weight 1 | r |
//! | part | one | r, weight |
//! | bank | five, at r / 5 to r | r, weights |
//! | behind | one, weight 1, behind the relaxation: the sensor's backlash | r |
//! | cycled part, cycled bank | the same, with the initial condition on the descending branch | the same |
//! | Rayleigh, cycled Rayleigh | eight of equal weight, at all thresholds up to the full scale `U`: `slope u + part u^2 / U` from rest | slope, part |
//! | load | none: a [`LoadFriction`], whose branches differ in proportion to the voltage | part |
//!
//! The initial condition belongs to the record, not to the spring.

use model::extended::memory::MAX_PLAYS;

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity, table};
use crate::plant::chain::Chain;
use crate::plant::load_friction::LoadFriction;
use crate::plant::play_bank::PlayBank;
use crate::record::data::Data;
use crate::stats::sums::dot;
use crate::stats::thresholds::probability::NATS_WITHIN_INTERVAL;

pub(super) struct Hysteresis;

const WHOLE: usize = 0;
const BEHIND: usize = 5;
const LOAD: usize = 6;
const RAYLEIGH: usize = 7;
const CYCLED_RAYLEIGH: usize = 8;

/// Number of plays, and initial condition on the descending branch, for each form.
const FORMS: [(usize, bool); 9] = [
    (1, false),
    (1, false),
    (5, false),
    (1, true),
    (5, true),
    (1, false),
    (0, false),
    (RAYLEIGH_PLAYS, false),
    (RAYLEIGH_PLAYS, true),
];
/// Plays of Rayleigh's law, a Preisach model of even density: as many as a plant file holds.
const RAYLEIGH_PLAYS: usize = MAX_PLAYS;
/// Thresholds of a bank relative to `r`.
const PARTS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

fn is_rayleigh(form: usize) -> bool {
    matches!(form, RAYLEIGH | CYCLED_RAYLEIGH)
}

/// Returns the bank of a form at a point, for voltages up to `full_scale_v`.
fn bank(form: usize, point: &[f64], full_scale_v: f64) -> PlayBank {
    let (count, cycled) = FORMS[form];
    if is_rayleigh(form) {
        let threshold = |play: usize| full_scale_v * (play as f64 + 0.5) / count as f64;
        let weight = 2.0 * point[1] / count as f64;
        let bank = PlayBank::new(point[0], (0..count).map(|play| (threshold(play), weight)));
        return if cycled { bank.cycled() } else { bank };
    }
    let threshold = point[0].exp();
    let plays: Vec<(f64, f64)> = match (form, count) {
        (WHOLE | BEHIND, _) => vec![(threshold, 1.0)],
        (_, 1) => vec![(threshold, point[1])],
        _ => PARTS.iter().zip(&point[1..]).map(|(part, &weight)| (threshold * part, weight)).collect(),
    };
    let direct = 1.0 - plays.iter().map(|(_, weight)| weight).sum::<f64>();
    let bank = PlayBank::new(direct, plays);
    if cycled { bank.cycled() } else { bank }
}

impl Effect for Hysteresis {
    fn cause(&self) -> &'static str {
        "hysteresis"
    }

    fn location(&self) -> Location {
        Location::Static
    }

    fn affects(&self, form: usize) -> Affects {
        if form == BEHIND { Affects::Relaxation } else { Affects::StaticResponse }
    }

    fn description(&self) -> &'static str {
        "the rising and falling branches differ, however slowly the voltage changes"
    }

    fn isolating_experiment(&self) -> &'static str {
        "a slow stair up and down again: only with hysteresis do the branches stay apart, however long each step is held"
    }

    fn forms(&self) -> usize {
        FORMS.len()
    }

    fn common_forms(&self) -> usize {
        6
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        if form == LOAD {
            return vec![Coordinate::new(-0.5, 0.5)];
        }
        if is_rayleigh(form) {
            return vec![Coordinate::new(0.05, 5.0), Coordinate::new(0.0, 5.0)];
        }
        let (count, _) = FORMS[form];
        let mut coordinates = vec![Coordinate::log(1e-4 * data.full_scale_v, 0.5 * data.full_scale_v)];
        if !matches!(form, WHOLE | BEHIND) {
            coordinates.resize(1 + count, Coordinate::new(0.0, 2.0));
        }
        coordinates
    }

    /// Rayleigh's law without plays is a gain.
    fn nearest_special_case(&self, form: usize, point: &[f64], _: &Data) -> Option<(&'static str, usize, Vec<f64>)> {
        is_rayleigh(form).then(|| ("gain-error", 0, vec![point[0] + point[1]]))
    }

    /// The play behind the relaxation and the friction under load have no initial condition that is estimated: they are not tried where
    /// it is unknown.
    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        if matches!(form, BEHIND | LOAD) && data.initial_state_unknown {
            return Vec::new();
        }
        if form == LOAD {
            return vec![vec![-0.02], vec![0.02]];
        }
        if is_rayleigh(form) {
            return vec![vec![0.9, 0.1], vec![0.7, 0.3]];
        }
        let (count, _) = FORMS[form];
        let start = |part: f64, weight: f64| {
            let mut point = vec![(part * data.full_scale_v).ln()];
            if !matches!(form, WHOLE | BEHIND) {
                point.resize(1 + count, weight / count as f64);
            }
            point
        };
        let parts: &[f64] = if count == 1 { &[0.004, 0.01, 0.02, 0.04, 0.08, 0.16, 0.3] } else { &[0.02, 0.07, 0.2] };
        parts.iter().map(|&part| start(part, 0.4)).collect()
    }

    /// Plays that stand still, as one whose threshold is half the largest voltage does on the descending branch, or move by less than the
    /// noise of all rows shows, leave no loop but a gain.
    fn is_another_cause(&self, form: usize, point: &[f64], data: &Data, sigma_v: f64) -> bool {
        if matches!(form, BEHIND | LOAD) {
            return false;
        }
        let (voltages, mut bank) = (&data.voltage_v, bank(form, point, data.full_scale_v));
        let outputs: Vec<f64> = voltages.iter().map(|voltage| bank.at(*voltage)).collect();
        let gain = dot(&outputs, voltages) / dot(voltages, voltages);
        let of_loop: f64 =
            outputs.iter().zip(voltages).map(|(output, voltage)| (output - gain * voltage).powi(2)).sum();
        0.5 * of_loop < NATS_WITHIN_INTERVAL * sigma_v * sigma_v
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        let width = match form {
            LOAD => LoadFriction::new(point[0]).width(data.full_scale_v),
            _ => bank(form, point, data.full_scale_v).width(data.full_scale_v),
        };
        let slope = is_rayleigh(form).then(|| Quantity::new("slope", Dimension::Ratio, point[0]));
        [Quantity::new("width_v", Dimension::Voltage, width)].into_iter().chain(slope).collect()
    }

    /// A plant file holds a limited number of plays, before the relaxation.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, chain: &Chain) -> Option<toml::Value> {
        (matches!(form, BEHIND | LOAD) || !chain.memory.fits_plant_file()).then(|| table(self, form, point, data))
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], data: &'a Data, chain: &mut Chain<'a>) {
        if form == BEHIND {
            chain.memory_behind = bank(form, point, data.full_scale_v);
            return;
        }
        if form == LOAD {
            chain.friction = LoadFriction::new(point[0]);
            return;
        }
        chain.memory = bank(form, point, data.full_scale_v).composed_with(&chain.memory);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use simulation::record::{Record, Row};

    #[test]
    fn plays_that_stand_still_are_a_gain_and_no_hysteresis() {
        let voltage_v = |row: usize| [0.0, 120.0, 500.0, 60.0, 333.0, 480.0, 20.0, 250.0][row / 25 % 8];
        let row = |row| Row { line: 0, time_s: 0.1 * row as f64, voltage_v: voltage_v(row), measured: Some(0.0) };
        let data = Data::new(&Record { name: String::new(), rows: (0..800).map(row).collect() }, Input::Hold);
        let is_gain = |form: usize, point: &[f64]| Hysteresis.is_another_cause(form, point, &data, 0.7);
        const CYCLED_PART: usize = 3;
        const PART: usize = 1;
        let half = (0.5 * data.full_scale_v).ln();
        assert!(is_gain(CYCLED_PART, &[half, 0.22]));
        assert!(is_gain(RAYLEIGH, &[0.78, 1e-6]) && is_gain(CYCLED_RAYLEIGH, &[0.78, 0.0]));
        // From rest a play of that threshold does follow.
        assert!(!is_gain(PART, &[half, 0.22]));
        assert!(!is_gain(CYCLED_PART, &[half - 0.1, 0.22]));
        assert!(!is_gain(WHOLE, &[3f64.ln()]) && !is_gain(RAYLEIGH, &[0.78, 0.02]));
        assert!(!is_gain(BEHIND, &[3f64.ln()]) && !is_gain(LOAD, &[0.02]));
    }
}
