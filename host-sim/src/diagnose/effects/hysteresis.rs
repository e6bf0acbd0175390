//! Rate-independent memory: the branches up and down differ.
//!
//! A bank of play operators (the Prandtl-Ishlinskii model; Brokate and Sprekels, *Hysteresis and Phase Transitions*,
//! 1996), each with a threshold `r`:
//!
//! ```text
//! play: z' = clamp(z, u - r, u + r)        f = gain ((1 - sum weights) u + sum weight play)
//! ```
//!
//! | form | plays | coordinates |
//! | --- | --- | --- |
//! | whole | one, weight 1 | r |
//! | part | one | r, weight |
//! | bank | three, at r / 3, r and 3 r | r, weights |
//! | part with gain, bank with gain | the same, with the gain of the loop's mean line | and the gain |

use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};
use crate::diagnose::signal::Signal;
use crate::plant_file::{Memory, PlantFile};

pub(super) struct Hysteresis;

const WHOLE: usize = 0;
/// Number of plays and own gain, by form.
const FORMS: [(usize, bool); 5] = [(1, false), (1, false), (3, false), (1, true), (3, true)];

/// A bank of play operators.
#[derive(Clone, Debug)]
struct Bank {
    gain: f64,
    direct: f64,
    plays: [Play; 3],
}

#[derive(Clone, Copy, Debug, Default)]
struct Play {
    threshold: f64,
    weight: f64,
    value: f64,
}

impl Bank {
    fn new(form: usize, point: &[f64]) -> Self {
        let (count, own_gain) = FORMS[form];
        let threshold = point[0].exp();
        let mut plays = [Play::default(); 3];
        if count == 1 {
            plays[0] = Play { threshold, weight: if form == WHOLE { 1.0 } else { point[1] }, value: 0.0 };
        } else {
            for ((play, &weight), factor) in plays.iter_mut().zip(&point[1..4]).zip([1.0 / 3.0, 1.0, 3.0]) {
                *play = Play { threshold: threshold * factor, weight, value: 0.0 };
            }
        }
        let gain = if own_gain { point[point.len() - 1] } else { 1.0 };
        Self { gain, direct: 1.0 - plays.iter().map(|play| play.weight).sum::<f64>(), plays }
    }

    fn at(&mut self, voltage: f64) -> f64 {
        let mut sum = self.direct * voltage;
        for play in &mut self.plays {
            play.value = play.value.clamp(voltage - play.threshold, voltage + play.threshold);
            sum += play.weight * play.value;
        }
        self.gain * sum
    }

    /// Largest distance along the voltage axis between the branches of a slow loop from 0 to `top` and back, in V.
    fn width(mut self, top: f64) -> f64 {
        const STEPS: usize = 400;
        let voltage = |step: usize| top * step as f64 / STEPS as f64;
        // Once around first, so that the loop closes.
        for step in (0..=STEPS).chain((0..STEPS).rev()) {
            self.at(voltage(step));
        }
        let up: Vec<f64> = (0..=STEPS).map(|step| self.at(voltage(step))).collect();
        let mut down: Vec<f64> = (0..=STEPS).rev().map(|step| self.at(voltage(step))).collect();
        down.reverse();
        // Both rise with the voltage: the voltage of the branch up at the same stiffness, by interpolation.
        let mut at = 0;
        let mut widest = 0.0f64;
        for (step, &value) in down.iter().enumerate() {
            while at + 1 < STEPS && up[at + 1] < value {
                at += 1;
            }
            let rise = up[at + 1] - up[at];
            let part = if rise > 0.0 { ((value - up[at]) / rise).clamp(0.0, 1.0) } else { 1.0 };
            widest = widest.max(voltage(at) + part * top / STEPS as f64 - voltage(step));
        }
        widest
    }
}

impl Effect for Hysteresis {
    fn cause(&self) -> &'static str {
        "hysteresis"
    }

    fn stage(&self) -> Stage {
        Stage::Static
    }

    fn meaning(&self) -> &'static str {
        "the branches up and down differ, however slowly they are run"
    }

    fn experiment(&self) -> &'static str {
        "a slow stair up and down again: only under hysteresis the branches stay apart, however long each step is held"
    }

    fn forms(&self) -> usize {
        FORMS.len()
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let (count, own_gain) = FORMS[form];
        let mut coordinates = vec![Coordinate::log(1e-4 * data.full_scale_v, 0.5 * data.full_scale_v)];
        if form != WHOLE {
            coordinates.resize(1 + count, Coordinate::new(0.0, 2.0));
        }
        if own_gain {
            coordinates.push(Coordinate::new(0.2, 5.0));
        }
        coordinates
    }

    fn starts(&self, form: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        let (count, own_gain) = FORMS[form];
        let start = |part: f64, weight: f64| {
            let mut point = vec![(part * data.full_scale_v).ln()];
            if form != WHOLE {
                point.resize(1 + count, weight / count as f64);
            }
            if own_gain {
                point.push(1.0);
            }
            point
        };
        let parts: &[f64] = if count == 1 { &[0.004, 0.01, 0.02, 0.04, 0.08, 0.16, 0.3] } else { &[0.02, 0.07, 0.2] };
        parts.iter().map(|&part| start(part, 0.4)).collect()
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        vec![Quantity::new("width_v", "V", Bank::new(form, point).width(data.full_scale_v))]
    }

    fn extend(&self, form: usize, point: &[f64], _: &Data, file: &mut PlantFile) {
        let Bank { gain, direct, plays } = Bank::new(form, point);
        let plays = plays.into_iter().filter(|play| play.weight != 0.0);
        let (thresholds_v, weights) = plays.map(|play| (play.threshold, gain * play.weight)).unzip();
        file.memory = Some(Memory { direct: gain * direct, thresholds_v, weights });
    }

    fn drive(&self, form: usize, point: &[f64], _: &Data, signal: &mut Signal) {
        let mut bank = Bank::new(form, point);
        signal.before = bank.at(signal.before);
        signal.pass(|piece| {
            let from = bank.at(piece.from);
            (from, if piece.to == piece.from { from } else { bank.at(piece.to) })
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One play of weight 1 lags by its threshold on both branches.
    #[test]
    fn a_whole_play_is_twice_its_threshold_wide() {
        let width = Bank::new(WHOLE, &[20f64.ln()]).width(500.0);
        assert!((width - 40.0).abs() < 0.5, "{width}");
    }
}
