//! The extended spring in double precision, solved exactly for a voltage held for any time.
//!
//! ```text
//! p = direct v + sum weight_j play_j(v)     play: z' = clamp(z, v - r, v + r)
//! f = law(p)                                straight through its points and beyond both ends
//! q = f - share_l l                         l' = (f - l) / tau_l
//! y = share q + sum weight_k w_k            w_k' = (q - w_k) / tau_k
//! ```
//!
//! While the voltage is constant, so is `f`; `l` is then one exponential and each `w_k` a sum of two.

use model::ExtendedPlant;

/// An extended spring, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    direct: f64,
    /// Threshold in V and weight of each play operator.
    plays: Vec<(f64, f64)>,
    /// Input and output of each point, in V; empty for the identity.
    law: Vec<(f64, f64)>,
    /// Share, and time constant in s.
    leakage: (f64, f64),
    share: f64,
    /// Time constant in s and weight of each lag.
    lags: Vec<(f64, f64)>,
    /// The first time constant at 500 V, in s; `None` if it is constant.
    high_s: Option<f64>,
}

/// State of an extended spring, in V.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    voltage: f64,
    plays: Vec<f64>,
    leaked: f64,
    lags: Vec<f64>,
}

/// Effect of a change of the voltage by 1 V, dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reversal {
    /// Change of the stiffness at the end of the first tick.
    pub within_a_tick: f64,
    /// Further change in each later tick.
    pub in_each_later: f64,
    /// Part of its remaining distance that the slowest lag covers in a tick.
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
    /// The spring with its time constants and its share multiplied by these factors, at the same settled value.
    #[must_use]
    pub fn times(mut self, time_constant: f64, share: f64) -> Self {
        let (before, later) = (self.share, self.lags.iter().map(|(_, weight)| weight).sum::<f64>());
        self.share *= share;
        let left = if later == 0.0 { 1.0 } else { (later + before - self.share) / later };
        self.lags.iter_mut().for_each(|(tau, weight)| (*tau, *weight) = (time_constant * *tau, left * *weight));
        self.high_s = self.high_s.map(|tau| time_constant * tau);
        self
    }

    /// The state at rest at 0 V.
    pub fn at_rest(&self) -> State {
        State { voltage: 0.0, plays: vec![0.0; self.plays.len()], leaked: 0.0, lags: vec![0.0; self.lags.len()] }
    }

    /// Applies `volts` (V) across the spring.
    pub fn apply(&self, state: &mut State, volts: f64) {
        state.voltage = volts;
        for (place, (threshold, _)) in state.plays.iter_mut().zip(&self.plays) {
            *place = place.clamp(volts - threshold, volts + threshold);
        }
    }

    /// Stiffness as the equivalent static voltage, in V.
    pub fn stiffness(&self, state: &State) -> f64 {
        let charge = self.law_output(state) - self.leakage.0 * state.leaked;
        let later: f64 = self.lags.iter().zip(&state.lags).map(|((_, weight), lag)| weight * lag).sum();
        self.share * charge + later
    }

    /// Holds the voltage for `seconds`.
    pub fn hold(&self, state: &mut State, seconds: f64) {
        let answer = self.law_output(state);
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

    /// Largest instantaneous change of the stiffness per volt: all play operators move, on the steepest segment of the
    /// law.
    pub fn steepest_slope(&self) -> f64 {
        let plays: f64 = self.plays.iter().map(|(_, weight)| weight.max(0.0)).sum();
        let slopes = self.law.windows(2).map(|pair| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0));
        let law = if self.law.is_empty() { 1.0 } else { slopes.fold(0.0, f64::max) };
        self.share * law * (self.direct.max(0.0) + plays)
    }

    /// Time constant with which the voltage settles for a constant stiffness, in ticks of `seconds`.
    pub fn settling_ticks(&self, seconds: f64) -> f64 {
        let later: f64 = self.lags.iter().map(|&(tau, weight)| weight * (1.0 - (-seconds / tau).exp())).sum();
        self.share / later
    }

    /// Smallest effect of 1 V when the voltage turns back, for ticks of `seconds`.
    pub fn reversal(&self, seconds: f64) -> Reversal {
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
        Reversal {
            within_a_tick: slope * self.share * (1.0 - loss * made(leak_tau)) + in_each_later,
            in_each_later,
            relaxed: lags.iter().map(|lag| lag.0).fold(1.0, f64::min),
        }
    }

    /// Output of the static law after the play operators, in V.
    fn law_output(&self, state: &State) -> f64 {
        let plays: f64 = self.plays.iter().zip(&state.plays).map(|((_, weight), place)| weight * place).sum();
        let input = self.direct * state.voltage + plays;
        // The segment around the input, or the nearest one.
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

/// Time constant that is linear in the voltage, `low_s` at 0 V and `high_s` at 500 V, at least half of the shorter one.
fn varied(low_s: f64, high_s: f64, volts: f64) -> f64 {
    let straight = low_s * (1.0 - volts.max(0.0) / 500.0) + high_s * volts.max(0.0) / 500.0;
    straight.max(low_s.min(high_s) / 2.0)
}

/// Response after `seconds` of a lag with time constant `tau` to the input `exp(-t / fading)`.
fn decaying_input(seconds: f64, tau: f64, fading: f64) -> f64 {
    let difference = 1.0 / tau - 1.0 / fading;
    let x = difference * seconds;
    if x.abs() < 1e-4 {
        // Series of the difference of two almost equal exponentials.
        return seconds / tau * (-seconds / tau).exp() * (1.0 + x / 2.0 + x * x / 6.0);
    }
    ((-seconds / fading).exp() - (-seconds / tau).exp()) / (difference * tau)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant_file::parse;

    /// The example file, with equal time constants of leakage and second lag.
    fn example() -> Spring {
        let text = include_str!("../../../docs/plant.toml").replace("40.0", "7.0");
        Spring::from(parse("docs/plant.toml", &text).unwrap().extended())
    }

    /// One hold equals many small Euler steps, and two shorter holds.
    #[test]
    fn a_hold_agrees_with_small_steps_and_shorter_holds() {
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

        let (f, steps) = (spring.law_output(&state), 3_000_000);
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

    /// Computed by hand: up to 300 V, back to 290 V, and between and beyond the points of the law.
    #[test]
    fn play_operators_and_law_agree_with_hand_computation() {
        let spring = example();
        let mut state = spring.at_rest();
        spring.apply(&mut state, 300.0);
        // 0.8 * 300 + 0.15 * 290 + 0.05 * 275 = 297.25, on the line from (200, 190) to (300, 300)
        assert!((spring.law_output(&state) - (190.0 + 1.1 * 97.25)).abs() < 1e-9);
        spring.apply(&mut state, 290.0);
        // Both play operators stay.
        assert!((spring.law_output(&state) - (190.0 + 1.1 * 89.25)).abs() < 1e-9);
        spring.apply(&mut state, 700.0);
        // 560 + 103.5 + 33.75 = 697.25, beyond the last point on its line
        assert!((spring.law_output(&state) - (500.0 + 0.9 * 197.25)).abs() < 1e-9);
        spring.apply(&mut state, -100.0);
        // -80 - 13.5 - 3.75
        assert!((spring.law_output(&state) + 0.9 * 97.25).abs() < 1e-9);
        assert!((spring.steepest_slope() - 0.0909 * 1.1).abs() < 1e-12);
    }

    /// Rows at uneven times, the last after a long rest.
    #[test]
    fn simulate_returns_the_stiffness_at_each_row() {
        let spring = Spring::from(model::Plant { share: 0.2, time_constant_s: 2.0 });
        let got = simulate(&spring, &[0.0, 1.0, 3.0, 1003.0], &[0.0, 100.0, 50.0, 50.0]);
        let relaxed = 100.0 * (1.0 - (-1f64).exp());
        for (got, expected) in got.into_iter().zip([0.0, 20.0, 10.0 + 0.8 * relaxed, 50.0]) {
            assert!((got - expected).abs() < 1e-9, "{got} {expected}");
        }
    }
}
