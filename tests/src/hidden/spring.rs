//! The spring and its amplifier, stepped through time: fourth-order Runge-Kutta, at least 20 steps a row.
//!
//! Command, delay, limit, slew -> voltage u -> memory, law, gain -> v -> relaxation (w, creep w2) -> leakage L ->
//! resonance p -> drift -> stiffness. A row's voltage is held until the next row; its stiffness is read just after it.

use super::memory::Memory;
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
type State = [f64; 5];

impl Spring {
    /// The stiffness at every row, `steps` time steps a row.
    pub fn run(&self, schedule: &Schedule, steps: usize) -> Vec<f64> {
        let mut moving = Moving { spring: self, memory: self.memory.clone(), u: 0.0, v: 0.0, state: [0.0; 5] };
        let rows: Vec<(f64, f64)> = schedule.rows().collect();
        let mut stiffness = Vec::with_capacity(rows.len());
        let (mut arrived, mut target) = (0, 0.0);
        for (k, &(now, _)) in rows.iter().enumerate() {
            // Commands that arrive on the way here split the row.
            let mut at = if k == 0 { now } else { rows[k - 1].0 };
            let step_s = (now - at) / steps as f64;
            while arrived <= k && rows[arrived].0 + self.delay_s <= now {
                let arrival = rows[arrived].0 + self.delay_s;
                moving.go(target, arrival - at, step_s);
                at = at.max(arrival);
                target = rows[arrived].1.min(self.limit_v);
                arrived += 1;
            }
            moving.go(target, now - at, step_s);
            stiffness.push(moving.read(target, now - rows[0].0));
        }
        stiffness
    }

    /// The response before resonance and drift, and what excites the resonance.
    fn response(&self, v: f64, [w, w2, leaked, ..]: State) -> (f64, f64) {
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
    fn rates(&self, u: f64, v: f64, state: State) -> State {
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

/// A spring on its way.
struct Moving<'a> {
    spring: &'a Spring,
    memory: Memory,
    /// Across the spring, in V.
    u: f64,
    /// What memory, law and gain make of it.
    v: f64,
    state: State,
}

impl Moving<'_> {
    /// Through `duration` s with the command at `target`.
    fn go(&mut self, target: f64, duration: f64, step_s: f64) {
        if duration <= 0.0 {
            return;
        }
        let steps = (duration / step_s - 1e-6).ceil().max(1.0);
        let h = duration / steps;
        for _ in 0..steps as usize {
            let reach = self.spring.slew_v_per_s * h;
            if reach.is_infinite() {
                self.apply(target);
            }
            let (u, v) = (self.u, self.v);
            self.apply(target.clamp(u - reach, u + reach));
            self.integrate((u, v), h);
        }
    }

    fn apply(&mut self, u: f64) {
        if u != self.u {
            self.u = u;
            self.v = self.spring.gain * self.spring.law.at(self.memory.step(u));
        }
    }

    /// From the voltages `before` to the present ones, which between them are linear.
    fn integrate(&mut self, before: (f64, f64), h: f64) {
        let middle = (0.5 * (before.0 + self.u), 0.5 * (before.1 + self.v));
        let x = self.state;
        let rates = |at: (f64, f64), x| self.spring.rates(at.0, at.1, x);
        let along = |rates: State, h: f64| std::array::from_fn(|i| x[i] + h * rates[i]);
        let k1 = rates(before, x);
        let k2 = rates(middle, along(k1, h / 2.0));
        let k3 = rates(middle, along(k2, h / 2.0));
        let k4 = rates((self.u, self.v), along(k3, h));
        self.state = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }

    /// The stiffness `t` s after the start, just after a command for `target` arrived.
    fn read(&mut self, target: f64, t: f64) -> f64 {
        if self.spring.slew_v_per_s.is_infinite() {
            self.apply(target);
        }
        let (y, excites) = self.spring.response(self.v, self.state);
        let y = self.spring.resonance.map_or(y, |mode| y + mode.participation * (self.state[3] - excites));
        self.spring.drift.map_or(y, |drift| drift.of(y, t))
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
