//! A spring on its way through time: fourth-order Runge-Kutta.

use std::collections::VecDeque;

use super::memory::Memory;
use super::spring::{Spring, State};

/// A spring and its amplifier at one time; it starts at rest, without voltage.
#[derive(Clone, Debug, PartialEq)]
pub struct Moving {
    spring: Spring,
    start_s: f64,
    now_s: f64,
    /// Commands that have not yet arrived: when they will, and their voltage.
    on_the_way: VecDeque<(f64, f64)>,
    /// What the amplifier is at, or slews to, in V.
    target: f64,
    memory: Memory,
    /// Across the spring, in V.
    u: f64,
    /// What memory, law and gain make of it.
    v: f64,
    state: State,
}

impl Moving {
    /// At rest at `start_s`.
    pub fn new(spring: Spring, start_s: f64) -> Self {
        let memory = spring.memory.clone();
        let (now_s, on_the_way) = (start_s, VecDeque::new());
        Self { spring, start_s, now_s, on_the_way, target: 0.0, memory, u: 0.0, v: 0.0, state: [0.0; 5] }
    }

    /// Since when it moves, in s.
    pub fn now_s(&self) -> f64 {
        self.now_s
    }

    /// The amplifier is told a voltage; it is held until it is told another one.
    pub fn command(&mut self, voltage: f64) {
        self.on_the_way.push_back((self.now_s + self.spring.delay_s, voltage));
        self.arrive();
    }

    /// Lets time pass until `until_s`, in steps of at most `step_s`. Commands that arrive on the way split it.
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

    /// Now, just after what has been commanded.
    pub fn stiffness(&mut self) -> f64 {
        if self.spring.slew_v_per_s.is_infinite() {
            self.apply(self.target);
        }
        let (y, excites) = self.spring.response(self.v, self.state);
        let y = self.spring.resonance.map_or(y, |mode| y + mode.participation * (self.state[3] - excites));
        self.spring.drift.map_or(y, |drift| drift.of(y, self.now_s - self.start_s))
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
            let (u, v) = (self.u, self.v);
            self.apply(self.target.clamp(u - reach, u + reach));
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
}
