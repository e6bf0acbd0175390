//! Rate-independent hysteresis: a bank of play operators (the Prandtl-Ishlinskii model; Brokate and Sprekels,
//! *Hysteresis and Phase Transitions*, 1996).
//!
//! ```text
//! play: z' = clamp(z, u - r, u + r)        p = direct u + sum weight z
//! ```
//!
//! For a spring that never had a voltage all `z` are 0. With an initial condition on the descending branch, after a
//! large voltage, each `z` is its `r`, and the output there counts as 0.
//! From rest upwards the output follows the loading curve `phi(u) = direct u + sum weight max(u - r, 0)`. If the
//! loading curve of a bank increases everywhere, its composition with a second bank is again a bank, whose loading
//! curve is the composition of both (Kuhnen, *European Journal of Control* 9, 2003).

use model::extended::memory::MAX_PLAYS;

use simulation::plant_file::Memory;

/// A bank of play operators; without plays and with `direct = 1` it is the identity.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayBank {
    /// Weight of the input itself.
    pub direct: f64,
    plays: Vec<Play>,
    /// Output that counts as 0 V, in V.
    zero: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Play {
    threshold: f64,
    weight: f64,
    value: f64,
}

impl PlayBank {
    /// Returns a bank of plays with the given thresholds, in V, and weights; those of weight 0 are left out.
    pub fn new(direct: f64, plays: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let plays = plays.into_iter().filter(|(_, weight)| *weight != 0.0);
        Self {
            direct,
            plays: plays.map(|(threshold, weight)| Play { threshold, weight, value: 0.0 }).collect(),
            zero: 0.0,
        }
    }

    /// Returns the same bank with its initial condition on the descending branch at 0 V, where its output is 0.
    pub fn cycled(mut self) -> Self {
        for play in &mut self.plays {
            play.value = play.threshold;
            self.zero += play.weight * play.threshold;
        }
        self
    }

    /// Returns the same bank before any voltage.
    pub fn at_rest(mut self) -> Self {
        self.zero = 0.0;
        self.plays.iter_mut().for_each(|play| play.value = 0.0);
        self
    }

    /// Returns the bank of a plant file.
    pub fn of(memory: Option<&Memory>) -> Self {
        match memory {
            None => Self::new(1.0, []),
            Some(Memory { direct, thresholds_v, weights }) => {
                Self::new(*direct, thresholds_v.iter().copied().zip(weights.iter().copied()))
            }
        }
    }

    /// Returns the table for a plant file; `None` for the identity.
    pub fn table(&self) -> Option<Memory> {
        let (thresholds_v, weights) = self.plays.iter().map(|play| (play.threshold, play.weight)).unzip();
        (*self != Self::new(1.0, [])).then_some(Memory { direct: self.direct, thresholds_v, weights })
    }

    /// Returns true if a plant file can hold the number of plays.
    pub fn fits_plant_file(&self) -> bool {
        self.plays.len() <= MAX_PLAYS
    }

    /// Returns true if the loading curve does not decrease anywhere.
    pub fn is_monotonic(&self) -> bool {
        self.lines().iter().all(|line| line.slope >= -1e-9)
    }

    /// Returns the composition of this bank with `first`, which acts before it and whose loading curve must not
    /// decrease.
    pub fn composed_with(&self, first: &Self) -> Self {
        if *first == Self::new(1.0, []) {
            return self.clone();
        }
        let (outer, inner) = (self.lines(), first.lines());
        // Voltages at which the output of the first bank reaches the thresholds of this one.
        let reached = outer.iter().map(|line| {
            let below = inner[inner.partition_point(|inner| inner.value <= line.start).max(1) - 1];
            below.start + (line.start - below.value) / below.slope
        });
        let mut starts: Vec<f64> = inner.iter().map(|line| line.start).chain(reached.filter(|v| *v > 0.0)).collect();
        starts.retain(|start| start.is_finite());
        starts.sort_by(f64::total_cmp);
        starts.dedup_by(|b, a| *b - *a < 1e-9);
        let mut bank = Self::new(0.0, []);
        let mut before = 0.0;
        for (index, &threshold) in starts.iter().enumerate() {
            // Evaluated within the interval, so that rounding cannot select a neighbour.
            let within = starts.get(index + 1).map_or(threshold + 1.0, |next| (threshold + next) / 2.0);
            let Line { start, value, slope } = line_at(&inner, within);
            let slope = slope * line_at(&outer, value + slope * (within - start)).slope;
            if index == 0 {
                bank.direct = slope;
            } else if slope != before {
                bank.plays.push(Play { threshold, weight: slope - before, value: 0.0 });
            }
            before = slope;
        }
        bank
    }

    /// Returns the output when the input moves monotonically to `voltage`, both in V; NaN for NaN, which a model whose numbers
    /// overflow may have.
    pub fn at(&mut self, voltage: f64) -> f64 {
        if voltage.is_nan() {
            return voltage;
        }
        let mut sum = self.direct * voltage - self.zero;
        for play in &mut self.plays {
            play.value = play.value.clamp(voltage - play.threshold, voltage + play.threshold);
            sum += play.weight * play.value;
        }
        sum
    }

    /// Returns the largest distance along the voltage axis between the branches of a slow loop from 0 to `top` and
    /// back, in V.
    pub fn width(mut self, top: f64) -> f64 {
        const STEPS: usize = 400;
        let voltage = |step: usize| top * step as f64 / STEPS as f64;
        // The first cycle closes the loop.
        for step in (0..=STEPS).chain((0..STEPS).rev()) {
            self.at(voltage(step));
        }
        let up: Vec<f64> = (0..=STEPS).map(|step| self.at(voltage(step))).collect();
        let mut down: Vec<f64> = (0..=STEPS).rev().map(|step| self.at(voltage(step))).collect();
        down.reverse();
        // Both branches increase with the voltage; the voltage of the ascending branch at the same output is
        // interpolated.
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

    /// Returns the lines of the loading curve for rising voltage from 0 V.
    fn lines(&self) -> Vec<Line> {
        let mut plays = self.plays.clone();
        plays.sort_by(|a, b| a.threshold.total_cmp(&b.threshold));
        let mut lines = vec![Line { start: 0.0, value: 0.0, slope: self.direct }];
        for Play { threshold, weight, .. } in plays {
            let Line { start, value, slope } = lines[lines.len() - 1];
            lines.push(Line { start: threshold, value: value + slope * (threshold - start), slope: slope + weight });
        }
        lines
    }
}

/// One line of a loading curve, from `start` to the next.
#[derive(Clone, Copy, Debug)]
struct Line {
    start: f64,
    value: f64,
    slope: f64,
}

fn line_at(lines: &[Line], at: f64) -> Line {
    lines[lines.partition_point(|line| line.start <= at).max(1) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_has_no_output() {
        let mut bank = PlayBank::new(0.5, [(10.0, 0.5)]);
        assert!(bank.at(f64::NAN).is_nan());
        assert_eq!(bank.at(20.0), 0.5 * 20.0 + 0.5 * 10.0);
    }

    /// A play of weight 1 lags by its threshold on both branches.
    #[test]
    fn loop_of_one_play_is_twice_its_threshold_wide() {
        let width = PlayBank::new(0.0, [(20.0, 1.0)]).width(500.0);
        assert!((width - 40.0).abs() < 0.5, "{width}");
    }

    /// After one large voltage, both initial conditions give the same changes of the output.
    #[test]
    fn cycled_bank_starts_on_the_descending_branch() {
        let mut fresh = PlayBank::new(0.6, [(20.0, 0.1), (60.0, 0.3)]);
        let mut cycled = fresh.clone().cycled();
        assert_eq!(cycled.clone().at_rest(), fresh);
        assert_eq!(cycled.clone().at(0.0), 0.0);
        fresh.at(500.0);
        let held = fresh.at(0.0);
        for voltage in [30.0, 170.0, 90.0] {
            assert!((fresh.at(voltage) - held - cycled.at(voltage)).abs() < 1e-9);
        }
    }

    #[test]
    fn composition_of_two_banks_is_one_bank() {
        let first = PlayBank::new(0.5, [(20.0, 0.3), (45.0, 0.4)]);
        let none = PlayBank::new(1.0, []);
        assert_eq!(first.composed_with(&none), first);
        let whole = PlayBank::new(0.0, [(15.0, 0.5), (15.0, 0.5)]);
        for second in
            [whole, PlayBank::new(0.0, [(30.0, 1.0)]), PlayBank::new(-0.3, [(10.0, 0.9), (30.0, 0.2), (90.0, 0.4)])]
        {
            let mut both = second.composed_with(&first);
            let (mut first, mut second) = (first.clone(), second.clone());
            for step in 0..4000 {
                let voltage = 300.0 * (0.01 * f64::from(step)).sin() + 200.0 * (0.0371 * f64::from(step)).sin();
                let expected = second.at(first.at(voltage));
                let got = both.at(voltage);
                assert!((got - expected).abs() < 1e-9, "{got} {expected} at {voltage}");
            }
        }
    }
}
