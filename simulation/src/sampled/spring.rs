//! The extended spring in double precision, for a voltage held as long as one likes: exact, not a tick.
//!
//! ```text
//! p = direct v + sum weight_j play_j(v)     play: z' = clamp(z, v - r, v + r)
//! f = law(p)                                straight through its points and beyond both ends
//! q = f - share_l l                         l' = (f - l) / tau_l
//! y = share q + sum weight_k w_k            w_k' = (q - w_k) / tau_k
//! ```
//!
//! While the voltage holds, `f` does too, `l` is one exponential, and each `w_k`, driven by it, two.

use model::ExtendedPlant;

/// A spring, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    direct: f64,
    /// Threshold in V, and weight.
    plays: Vec<(f64, f64)>,
    /// Input and output in V; empty: the output is the input.
    law: Vec<(f64, f64)>,
    /// Share, and time constant in s.
    leakage: (f64, f64),
    share: f64,
    /// Time constant in s, and weight.
    lags: Vec<(f64, f64)>,
    /// The first time constant at 500 V, in s.
    high_s: Option<f64>,
}

/// Where a spring is, in V.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    voltage: f64,
    plays: Vec<f64>,
    leaked: f64,
    lags: Vec<f64>,
}

/// What a change of the voltage does, in V/V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning {
    /// At the end of the first tick.
    pub within_a_tick: f64,
    /// More, in each later tick.
    pub in_each_later: f64,
    /// What part of its distance the slowest lag makes in a tick.
    pub relaxed: f64,
}

impl State {
    /// The voltage across the spring, in V.
    pub fn voltage(&self) -> f64 {
        self.voltage
    }
}

impl From<ExtendedPlant<'_>> for Spring {
    fn from(plant: ExtendedPlant<'_>) -> Self {
        let pairs = |a: &[f64], b: &[f64]| a.iter().copied().zip(b.iter().copied()).collect();
        Self {
            direct: plant.memory.map_or(1.0, |memory| memory.direct),
            plays: plant.memory.map_or_else(Vec::new, |memory| pairs(memory.thresholds_v, memory.weights)),
            law: plant.law.map_or_else(Vec::new, |law| pairs(law.voltage_v, law.stiffness)),
            leakage: plant.leakage.map_or((0.0, 1.0), |leakage| (leakage.share, leakage.time_constant_s)),
            share: plant.relaxation.share,
            lags: plant.relaxation.lags().collect(),
            high_s: plant.relaxation.time_constant_high_s,
        }
    }
}

impl From<model::Plant> for Spring {
    fn from(plant: model::Plant) -> Self {
        Self {
            direct: 1.0,
            plays: Vec::new(),
            law: Vec::new(),
            leakage: (0.0, 1.0),
            share: plant.share,
            lags: vec![(plant.time_constant_s, 1.0 - plant.share)],
            high_s: None,
        }
    }
}

impl Spring {
    /// Without voltage, settled.
    pub fn at_rest(&self) -> State {
        State { voltage: 0.0, plays: vec![0.0; self.plays.len()], leaked: 0.0, lags: vec![0.0; self.lags.len()] }
    }

    /// `volts` are put across the spring.
    pub fn apply(&self, state: &mut State, volts: f64) {
        state.voltage = volts;
        for (place, (threshold, _)) in state.plays.iter_mut().zip(&self.plays) {
            *place = place.clamp(volts - threshold, volts + threshold);
        }
    }

    /// The stiffness now, in V.
    pub fn stiffness(&self, state: &State) -> f64 {
        let charge = self.answer(state) - self.leakage.0 * state.leaked;
        let later: f64 = self.lags.iter().zip(&state.lags).map(|((_, weight), lag)| weight * lag).sum();
        self.share * charge + later
    }

    /// The voltage holds for `seconds`.
    pub fn hold(&self, state: &mut State, seconds: f64) {
        let answer = self.answer(state);
        let (leak_share, leak_tau) = self.leakage;
        let still_to_leak = leak_share * (answer - state.leaked);
        let settled = (1.0 - leak_share) * answer;
        for (index, (lag, &(tau, _))) in state.lags.iter_mut().zip(&self.lags).enumerate() {
            let tau = match self.high_s {
                Some(high_s) if index == 0 => varied(tau, high_s, state.voltage),
                _ => tau,
            };
            let kept = (-seconds / tau).exp();
            let leaking = still_to_leak * decaying_input(seconds, tau, leak_tau);
            *lag = settled + (*lag - settled) * kept + leaking;
        }
        state.leaked = answer + (state.leaked - answer) * (-seconds / leak_tau).exp();
    }

    /// What one volt more gives at once, where it gives most: every play moves, on the steepest line of the law.
    pub fn steepest(&self) -> f64 {
        let plays: f64 = self.plays.iter().map(|(_, weight)| weight.max(0.0)).sum();
        let slopes = self.law.windows(2).map(|pair| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0));
        let law = if self.law.is_empty() { 1.0 } else { slopes.fold(0.0, f64::max) };
        self.share * law * (self.direct.max(0.0) + plays)
    }

    /// What one volt less does at the least when the voltage turns back, in ticks of `seconds`.
    pub fn turning(&self, seconds: f64) -> Turning {
        let slopes = self.law.windows(2).map(|pair| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0));
        let law = slopes.reduce(f64::min).unwrap_or(1.0);
        let all: f64 = self.plays.iter().map(|(_, weight)| weight).sum::<f64>() + self.direct;
        let slope = law * self.direct.max(all / 4.0);
        let (loss, leak_tau) = self.leakage;
        let made = |tau: f64| 1.0 - (-seconds / tau).exp();
        let mean_loss = loss * (1.0 - made(leak_tau) * leak_tau / seconds);
        let slowest = |index: usize, tau: f64| match self.high_s {
            Some(high_s) if index == 0 => tau.max(varied(tau, high_s, 1000.0)),
            _ => tau,
        };
        let lags: Vec<(f64, f64)> =
            self.lags.iter().enumerate().map(|(index, &(tau, weight))| (made(slowest(index, tau)), weight)).collect();
        let later: f64 = lags.iter().map(|(made, weight)| made * weight).sum();
        let in_each_later = slope * (1.0 - mean_loss) * later;
        Turning {
            within_a_tick: slope * self.share * (1.0 - loss * made(leak_tau)) + in_each_later,
            in_each_later,
            relaxed: lags.iter().map(|lag| lag.0).fold(1.0, f64::min),
        }
    }

    /// The law's answer to the memory of the voltage.
    fn answer(&self, state: &State) -> f64 {
        let plays: f64 = self.plays.iter().zip(&state.plays).map(|((_, weight), place)| weight * place).sum();
        let input = self.direct * state.voltage + plays;
        // The pair of points around the input, or the nearest pair.
        let after = self.law.partition_point(|point| point.0 <= input);
        match self.law.len() {
            0 => input,
            points => {
                let last = after.clamp(1, points - 1);
                let ((from, at_from), (to, at_to)) = (self.law[last - 1], self.law[last]);
                at_from + (at_to - at_from) * (input - from) / (to - from)
            }
        }
    }
}

/// Simulates the spring without a controller, from rest at 0 V: returns its stiffness in V at the increasing times `time_s`
/// (s), each just after `voltage_v` (V) of the same index was applied; every voltage is held until the next time.
pub fn simulate(spring: &Spring, time_s: &[f64], voltage_v: &[f64]) -> Vec<f64> {
    let mut state = spring.at_rest();
    let lasts = time_s.windows(2).map(|pair| pair[1] - pair[0]).chain([0.0]);
    let points = voltage_v.iter().zip(lasts);
    let at = |(&voltage, lasts): (&f64, f64)| {
        spring.apply(&mut state, voltage);
        let stiffness = spring.stiffness(&state);
        spring.hold(&mut state, lasts);
        stiffness
    };
    points.map(at).collect()
}

/// A time constant that goes straight from `low_s` at 0 V through `high_s` at 500 V, never below half of the shorter.
fn varied(low_s: f64, high_s: f64, volts: f64) -> f64 {
    let straight = low_s * (1.0 - volts.max(0.0) / 500.0) + high_s * volts.max(0.0) / 500.0;
    straight.max(low_s.min(high_s) / 2.0)
}

/// What a lag of `tau` makes of an input `exp(-t / fading)` in `seconds`.
fn decaying_input(seconds: f64, tau: f64, fading: f64) -> f64 {
    let difference = 1.0 / tau - 1.0 / fading;
    let x = difference * seconds;
    if x.abs() < 1e-4 {
        // The difference of two almost equal exponentials, as a series.
        return seconds / tau * (-seconds / tau).exp() * (1.0 + x / 2.0 + x * x / 6.0);
    }
    ((-seconds / fading).exp() - (-seconds / tau).exp()) / (difference * tau)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant_file::parse;

    /// The example, its leakage and its second lag just as fast.
    fn example() -> Spring {
        let text = include_str!("../../../docs/plant.toml").replace("40.0", "7.0");
        Spring::from(parse("docs/plant.toml", &text).unwrap().extended())
    }

    /// One hold of seconds is the same as very many small steps by Euler's method, and as two shorter holds.
    #[test]
    fn a_hold_is_exact() {
        let spring = example();
        let mut state = spring.at_rest();
        spring.apply(&mut state, 400.0);
        spring.hold(&mut state, 2.0);
        spring.apply(&mut state, 150.0);
        let (mut long, mut short) = (state.clone(), state.clone());
        spring.hold(&mut long, 3.0);
        spring.hold(&mut short, 1.25);
        spring.hold(&mut short, 1.75);
        assert!((spring.stiffness(&long) - spring.stiffness(&short)).abs() < 1e-9);

        let (f, steps) = (spring.answer(&state), 3_000_000);
        let h = 3.0 / f64::from(steps);
        for _ in 0..steps {
            let q = f - 0.1 * state.leaked;
            state.lags[0] += h * (q - state.lags[0]) / (5.5 + 2.5 * 150.0 / 500.0);
            state.lags[1] += h * (q - state.lags[1]) / 7.0;
            state.leaked += h * (f - state.leaked) / 7.0;
        }
        let (exact, euler) = (spring.stiffness(&long), spring.stiffness(&state));
        assert!((exact - euler).abs() < 1e-4, "{exact} {euler}");
    }

    /// Numbers by hand: up to 300 V, back to 290 V, and the law between and beyond its points.
    #[test]
    fn memory_and_law_by_hand() {
        let spring = example();
        let mut state = spring.at_rest();
        spring.apply(&mut state, 300.0);
        // 0.8 * 300 + 0.15 * 290 + 0.05 * 275 = 297.25, on the line from (200, 190) to (300, 300)
        assert!((spring.answer(&state) - (190.0 + 1.1 * 97.25)).abs() < 1e-9);
        spring.apply(&mut state, 290.0);
        // Both plays stay.
        assert!((spring.answer(&state) - (190.0 + 1.1 * 89.25)).abs() < 1e-9);
        spring.apply(&mut state, 700.0);
        // 560 + 103.5 + 33.75 = 697.25, beyond the last point on its line
        assert!((spring.answer(&state) - (500.0 + 0.9 * 197.25)).abs() < 1e-9);
        spring.apply(&mut state, -100.0);
        // -80 - 13.5 - 3.75
        assert!((spring.answer(&state) + 0.9 * 97.25).abs() < 1e-9);
        assert!((spring.steepest() - 0.0909 * 1.1).abs() < 1e-12);
    }

    /// Rows any time apart, the last of a long rest.
    #[test]
    fn simulate_gives_one_stiffness_a_row() {
        let spring = Spring::from(model::Plant { share: 0.2, time_constant_s: 2.0 });
        let got = simulate(&spring, &[0.0, 1.0, 3.0, 1003.0], &[0.0, 100.0, 50.0, 50.0]);
        let relaxed = 100.0 * (1.0 - (-1f64).exp());
        for (got, expected) in got.into_iter().zip([0.0, 20.0, 10.0 + 0.8 * relaxed, 50.0]) {
            assert!((got - expected).abs() < 1e-9, "{got} {expected}");
        }
    }
}
