//! The spring and its amplifier: what may be told of them, and how their state changes.
//!
//! Command, delay, limit, slew -> voltage u -> memory, law, gain -> v -> relaxation (w, creep w2) -> leakage L ->
//! resonance p -> drift -> stiffness. A row's voltage is held until the next row; its stiffness is read just after it. [`moving`](super::moving) steps it
//! through time.

use super::effect::Effect;
use super::memory::Memory;
use super::moving::Moving;
use super::physics::{Creep, Drift, Law, Leakage, Resonance, SHARE, TAU_S, Tau};
use super::schedule::Schedule;

/// Everything that may be told of a spring and its amplifier. The default is the paper's plant behind an ideal amplifier.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "as in the modules `physics` and `memory`")]
pub struct Spring {
    /// In s.
    pub delay_s: f64,
    /// In V.
    pub limit_v: f64,
    /// In V/s.
    pub slew_v_per_s: f64,
    pub memory: Memory,
    pub law: Law,
    pub gain: f64,
    pub share: f64,
    pub tau: Tau,
    pub creep: Option<Creep>,
    pub leakage: Option<Leakage>,
    pub resonance: Option<Resonance>,
    pub drift: Option<Drift>,
}

impl Default for Spring {
    fn default() -> Self {
        Self {
            delay_s: 0.0,
            limit_v: f64::INFINITY,
            slew_v_per_s: f64::INFINITY,
            memory: Memory::None,
            law: Law::Straight,
            gain: 1.0,
            share: SHARE,
            tau: Tau::Linear { low_s: TAU_S, high_s: TAU_S },
            creep: None,
            leakage: None,
            resonance: None,
            drift: None,
        }
    }
}

/// What changes with time, memory aside: w, w2, L, p, p'.
pub(super) type State = [f64; 5];

impl Spring {
    /// With those of the effects that are not of the readings.
    pub fn with(effects: &[Effect]) -> Self {
        let mut spring = Self::default();
        // At size 0 it is the paper's plant itself, not a form of it that comes close.
        effects.iter().filter(|effect| effect.size > 0.0).for_each(|effect| effect.alter(&mut spring));
        spring
    }

    /// The stiffness at every row, `steps` time steps a row.
    pub fn run(&self, schedule: &Schedule, steps: usize) -> Vec<f64> {
        let mut last = schedule.time_s[0];
        let mut moving = Moving::new(self.clone(), last);
        let row = |(now, voltage)| {
            moving.go_to(now, (now - last) / steps as f64);
            last = now;
            moving.command(voltage);
            moving.stiffness()
        };
        schedule.rows().map(row).collect()
    }

    /// The response before resonance and drift, and what excites the resonance.
    pub(super) fn response(&self, v: f64, [w, w2, leaked, ..]: State) -> (f64, f64) {
        let immediate = self.share * v;
        let mut y = immediate + (1.0 - self.share) * w;
        match self.creep {
            None => {}
            Some(Creep { share, from_everything: true, .. }) => y += share * (w2 - y),
            Some(Creep { share, .. }) => y += share * (w2 - w),
        }
        y -= self.leakage.map_or(0.0, |leakage| leakage.share * leaked);
        (y, if self.resonance.is_some_and(|mode| mode.immediate) { immediate } else { y })
    }

    /// Rates of the state at voltage `u`, of which the relaxing parts see `v`.
    pub(super) fn rates(&self, u: f64, v: f64, state: State) -> State {
        let [w, w2, leaked, p, p_rate] = state;
        let (y, excites) = self.response(v, state);
        let creep = self.creep.map_or(0.0, |creep| (v - w2) / creep.tau_s);
        let leak = self.leakage.map_or(0.0, |Leakage { share, tau_s, before }| {
            // What would be there had nothing leaked, less what has: the share falls off the end.
            let source = if before { v } else { y + share * leaked };
            (source - leaked) / tau_s
        });
        let acceleration = self.resonance.map_or(0.0, |mode| {
            let omega = std::f64::consts::TAU * mode.freq_hz;
            omega * omega * (excites - p) - 2.0 * mode.zeta * omega * p_rate
        });
        [(v - w) / self.tau.at(u), creep, leak, p_rate, acceleration]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step() -> Schedule {
        Schedule { time_s: (0..400).map(|k| 0.1 * f64::from(k)).collect(), voltage_v: vec![500.0; 400] }
    }

    #[test]
    fn a_step_of_the_papers_spring_is_the_papers_formula() {
        for (t, y) in step().time_s.iter().zip(Spring::default().run(&step(), 20)) {
            assert!((y - 500.0 * (1.0 - 10.0 / 11.0 * (-t / TAU_S).exp())).abs() < 1e-6, "{t}: {y}");
        }
    }

    #[test]
    fn a_delay_that_falls_between_rows_shifts_the_same_step() {
        let late = Spring { delay_s: 0.237, ..Spring::default() }.run(&step(), 20);
        for (t, y) in step().time_s.iter().zip(late) {
            let since = t - 0.237;
            let expected = if since < 0.0 { 0.0 } else { 500.0 * (1.0 - 10.0 / 11.0 * (-since / TAU_S).exp()) };
            assert!((y - expected).abs() < 1e-6, "{t}: {y}");
        }
    }

    #[test]
    fn what_leaks_is_gone_and_what_creeps_arrives() {
        let hold = Schedule { time_s: (0..4000).map(f64::from).collect(), voltage_v: vec![500.0; 4000] };
        for flag in [false, true] {
            let leakage = Some(Leakage { share: 0.2, tau_s: 30.0, before: flag });
            let end = Spring { leakage, ..Spring::default() }.run(&hold, 20)[3999];
            assert!((end - 400.0).abs() < 1e-3, "{end}");
            let creep = Some(Creep { share: 0.2, tau_s: 30.0, from_everything: flag });
            let y = Spring { creep, ..Spring::default() }.run(&hold, 20);
            assert!((y[3999] - 500.0).abs() < 1e-3 && y[40] < 480.0);
        }
    }

    #[test]
    fn a_mode_in_series_overshoots_as_its_damping_says() {
        let mode = Resonance { freq_hz: 1.0, zeta: 0.1, participation: 1.0, immediate: false };
        let spring = Spring { share: 1.0, resonance: Some(mode), ..Spring::default() };
        let top = spring.run(&step(), 20).into_iter().fold(0.0, f64::max);
        // exp(-pi zeta/sqrt(1 - zeta^2)) = 72.9 %; rows hit the peak within a part of a percent.
        assert!((top / 500.0 - 1.729).abs() < 0.02, "{top}");
    }

    #[test]
    fn a_bounded_slew_takes_its_time() {
        let spring = Spring { share: 1.0, slew_v_per_s: 100.0, ..Spring::default() };
        let y = spring.run(&step(), 20);
        assert!(y[0] == 0.0 && (y[10] - 100.0).abs() < 1e-6 && (y[60] - 500.0).abs() < 1e-6);
    }
}
