//! Integration of the spring's differential equations over time by the fourth-order Runge-Kutta method.

use std::collections::VecDeque;

use super::hysteresis::Hysteresis;
use super::schedule::Schedule;
use super::spring::{Spring, State};

/// State of a spring and its amplifier at one time; it starts at rest at 0 V.
#[derive(Clone, Debug, PartialEq)]
pub struct Integrator {
    spring: Spring,
    start_s: f64,
    now_s: f64,
    /// Delayed commands: time of arrival in s, voltage in V.
    on_the_way: VecDeque<(f64, f64)>,
    /// Voltage that the amplifier has reached or slews to, in V.
    target: f64,
    hysteresis: Hysteresis,
    /// Voltage across the spring, in V.
    u: f64,
    /// Settled response to `u`: after hysteresis, law and gain, in V.
    v: f64,
    state: State,
    /// Outputs of the lags in series, in V.
    series: [f64; 2],
}

impl Integrator {
    /// A spring at rest at time `start_s`, in s.
    pub fn new(spring: Spring, start_s: f64) -> Self {
        let hysteresis = spring.hysteresis.clone();
        let (now_s, on_the_way) = (start_s, VecDeque::new());
        Self {
            spring,
            start_s,
            now_s,
            on_the_way,
            target: 0.0,
            hysteresis,
            u: 0.0,
            v: 0.0,
            state: [0.0; 7],
            series: [0.0; 2],
        }
    }

    /// Current time, in s.
    pub fn now_s(&self) -> f64 {
        self.now_s
    }

    /// Commands a voltage, in V, which is held until the next command.
    pub fn command(&mut self, voltage: f64) {
        self.on_the_way.push_back((self.now_s + self.spring.delay_s, voltage));
        self.arrive();
    }

    /// Integrates until `until_s` in steps of at most `step_s`, both in s. Delayed commands that arrive in between
    /// split a step.
    pub fn go_to(&mut self, until_s: f64, step_s: f64) {
        while let Some(&(arrival, _)) = self.on_the_way.front()
            && arrival <= until_s
        {
            self.go(arrival - self.now_s, step_s);
            self.now_s = self.now_s.max(arrival);
            self.arrive();
        }
        self.go(until_s - self.now_s, step_s);
        self.now_s = until_s;
    }

    /// Stiffness at the current time, after the last command, in V.
    pub fn stiffness(&mut self) -> f64 {
        if self.spring.slew_v_per_s.is_infinite() {
            self.apply(self.target);
        }
        let mut lags = self.spring.series_s.iter().zip(self.series).rev().filter(|(tau_s, _)| **tau_s > 0.0);
        let y = lags.next().map_or_else(|| self.unlagged(), |(_, output)| output);
        self.spring.drift.map_or(y, |drift| drift.of(y, self.now_s - self.start_s))
    }

    /// Stiffness before the lags in series and the drift, in V.
    fn unlagged(&self) -> f64 {
        let (y, excites) = self.spring.response(self.v, self.state);
        self.spring.resonance.map_or(y, |mode| y + mode.participation * (self.state[3] - excites))
    }

    /// Advances the lags in series by `h` s, in which the stiffness before them changes linearly from `from` to `to`, in V.
    fn lag(&mut self, h: f64, mut from: f64, mut to: f64) {
        let lags = self.spring.series_s.iter().zip(&mut self.series);
        for (tau_s, output) in lags.filter(|(tau_s, _)| **tau_s > 0.0) {
            let (slope, start) = ((to - from) / h, *output);
            // A ramp is followed late by the time constant, which the distance at the start decays to.
            *output = to - slope * tau_s + (start - from + slope * tau_s) * (-h / tau_s).exp();
            (from, to) = (start, *output);
        }
    }

    fn arrive(&mut self) {
        while let Some((_, voltage)) = self.on_the_way.pop_front_if(|&mut (arrival, _)| arrival <= self.now_s) {
            self.target = voltage.min(self.spring.limit_v);
        }
    }

    fn go(&mut self, duration: f64, step_s: f64) {
        if duration <= 0.0 {
            return;
        }
        let steps = (duration / step_s - 1e-6).ceil().max(1.0);
        let h = duration / steps;
        for _ in 0..steps as usize {
            let reach = self.spring.slew_v_per_s * h;
            if reach.is_infinite() {
                self.apply(self.target);
            }
            let (u, v, from) = (self.u, self.v, self.unlagged());
            self.apply(self.target.clamp(u - reach, u + reach));
            self.integrate((u, v), h);
            self.lag(h, from, self.unlagged());
        }
    }

    fn apply(&mut self, u: f64) {
        if u != self.u {
            self.u = u;
            self.v = self.spring.gain * self.spring.law.at(self.hysteresis.step(u));
        }
    }

    /// One Runge-Kutta step of `h` s; the voltages change linearly from `before` to their current values.
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
}

impl Spring {
    /// Stiffness of every row, in V, just after the row's command; each row is integrated in `steps` time steps.
    pub fn run(&self, schedule: &Schedule, steps: usize) -> Vec<f64> {
        let mut last = schedule.time_s[0];
        let mut integrator = Integrator::new(self.clone(), last);
        let row = |(now, voltage)| {
            integrator.go_to(now, (now - last) / steps as f64);
            last = now;
            integrator.command(voltage);
            integrator.stiffness()
        };
        schedule.rows().map(row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{Creep, Leakage, Resonance, TAU_S};

    fn step() -> Schedule {
        Schedule { time_s: (0..400).map(|k| 0.1 * f64::from(k)).collect(), voltage_v: vec![500.0; 400] }
    }

    #[test]
    fn step_response_of_the_papers_spring_is_the_papers_formula() {
        for (t, y) in step().time_s.iter().zip(Spring::default().run(&step(), 20)) {
            assert!((y - 500.0 * (1.0 - 10.0 / 11.0 * (-t / TAU_S).exp())).abs() < 1e-6, "{t}: {y}");
        }
    }

    #[test]
    fn delay_between_two_rows_shifts_the_step_response() {
        let late = Spring { delay_s: 0.237, ..Spring::default() }.run(&step(), 20);
        for (t, y) in step().time_s.iter().zip(late) {
            let since = t - 0.237;
            let expected = if since < 0.0 { 0.0 } else { 500.0 * (1.0 - 10.0 / 11.0 * (-since / TAU_S).exp()) };
            assert!((y - expected).abs() < 1e-6, "{t}: {y}");
        }
    }

    #[test]
    fn leakage_loses_its_share_and_creep_reaches_the_full_response() {
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
    fn overshoot_of_a_mode_in_series_follows_from_its_damping() {
        let mode = Resonance { freq_hz: 1.0, zeta: 0.1, participation: 1.0, immediate: false };
        let spring = Spring { share: 1.0, resonance: Some(mode), ..Spring::default() };
        let top = spring.run(&step(), 20).into_iter().fold(0.0, f64::max);
        // exp(-pi zeta/sqrt(1 - zeta^2)) = 72.9 %; the rows sample the peak to a fraction of a percent.
        assert!((top / 500.0 - 1.729).abs() < 0.02, "{top}");
    }

    #[test]
    fn lag_in_series_makes_the_step_response_a_sum_of_two_exponentials() {
        let lagged = Spring { share: 0.0, series_s: [1.5, 0.0], ..Spring::default() }.run(&step(), 20);
        for (t, y) in step().time_s.iter().zip(lagged) {
            let exact = 1.0 - (TAU_S * (-t / TAU_S).exp() - 1.5 * (-t / 1.5).exp()) / (TAU_S - 1.5);
            assert!((y - 500.0 * exact).abs() < 1e-3, "{t}: {y}");
        }
    }

    #[test]
    fn slew_limit_turns_a_step_into_a_ramp() {
        let spring = Spring { share: 1.0, slew_v_per_s: 100.0, ..Spring::default() };
        let y = spring.run(&step(), 20);
        assert!(y[0] == 0.0 && (y[10] - 100.0).abs() < 1e-6 && (y[60] - 500.0).abs() < 1e-6);
    }
}
