//! The stiffness of a linear spring as weights of the voltages between intervals.

use crate::spring_error::DifferingSpring;

/// Response of one spring to the voltages of the intervals.
pub(super) struct Linear {
    gain: f64,
    share: f64,
    /// Weight and time constant in s of each relaxation.
    lags: Vec<(f64, f64)>,
}

impl Linear {
    pub(super) fn of(differing: &DifferingSpring) -> Self {
        let relaxation = &differing.file.relaxation;
        let weights: Vec<f64> = match relaxation.weights.is_empty() {
            true => vec![1.0 - relaxation.share],
            false => relaxation.weights.clone(),
        };
        let lags = weights.into_iter().zip(relaxation.tau_s.iter().copied()).collect();
        Self { gain: differing.gain, share: relaxation.share, lags }
    }

    /// The weights of the voltages between the intervals in the stiffness at each of these times, and once settled.
    pub(super) fn responses(&self, intervals_s: &[f64]) -> Vec<Vec<f64>> {
        let count = intervals_s.len() + 1;
        let mut lagged = vec![vec![0.0; count]; self.lags.len()];
        let stiffness = |lagged: &[Vec<f64>], at: usize| {
            let mut sum = vec![0.0; count];
            sum[at] = self.gain * self.share;
            for (state, (weight, _)) in lagged.iter().zip(&self.lags) {
                sum.iter_mut().zip(state).for_each(|(sum, state)| *sum += self.gain * weight * state);
            }
            sum
        };
        let mut responses = vec![stiffness(&lagged, 0)];
        for (at, interval_s) in intervals_s.iter().enumerate() {
            for (state, (_, tau_s)) in lagged.iter_mut().zip(&self.lags) {
                let kept = (-interval_s / tau_s).exp();
                // Weight of the voltage at the end of a straight line.
                let ramp = 1.0 - tau_s / interval_s * (1.0 - kept);
                state.iter_mut().for_each(|state| *state *= kept);
                state[at] += 1.0 - kept - ramp;
                state[at + 1] += ramp;
            }
            responses.push(stiffness(&lagged, at + 1));
        }
        let mut settled = vec![0.0; count];
        settled[count - 1] = self.gain * (self.share + self.lags.iter().map(|(weight, _)| weight).sum::<f64>());
        responses.push(settled);
        responses
    }
}
