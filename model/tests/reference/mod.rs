//! Reference of the correction and its fault detection, written from their documentation in double precision.

use model::Feedback;

/// Result of the comparison of one reading with the model.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Good,
    Jumping,
    OutOfRange,
    Stuck,
}

#[derive(Clone, Debug)]
pub(crate) struct Reference {
    feedback: Feedback,
    tick_s: f64,
    /// Stiffness of the model at each tick, 0 V before the first.
    model: Vec<f64>,
    /// Lower and upper envelope of the model, and of the target.
    covered: (f64, f64),
    target: (f64, f64),
    correction: f64,
    innovations: (f64, f64),
    /// Tick at which the last reading was sampled.
    sampled: i64,
    accepted: f64,
    /// Mismatch of the last reading that was in range and not stuck.
    mismatch: f64,
    /// `None` while the sensor is trusted; `Some(None)` if readings are absent.
    failed: Option<Option<Verdict>>,
    bad: u32,
    good: u32,
    /// Value, model and number of identical readings.
    identical: Option<(f64, f64, u32)>,
    mean: f64,
    above: bool,
    amplitude: f64,
    last_amplitude: f64,
    crossings: u32,
    readings_since: f64,
    reductions: i32,
}

impl Reference {
    pub(crate) fn new(feedback: &Feedback, rate_hz: f64) -> Self {
        Self {
            feedback: *feedback,
            tick_s: 1.0 / rate_hz,
            model: vec![0.0],
            covered: (0.0, 0.0),
            target: (0.0, 0.0),
            correction: 0.0,
            innovations: (0.0, 0.0),
            sampled: 0,
            accepted: 0.0,
            mismatch: 0.0,
            failed: Some(None),
            bad: 0,
            good: 0,
            identical: None,
            mean: 0.0,
            above: false,
            amplitude: 0.0,
            last_amplitude: 0.0,
            crossings: 0,
            readings_since: 0.0,
            reductions: 0,
        }
    }

    pub(crate) fn trusted(&self) -> bool {
        self.failed.is_none()
    }

    pub(crate) fn correction(&self) -> f64 {
        self.correction
    }

    /// Records the model's stiffness of this tick.
    pub(crate) fn track_model(&mut self, model: f64) {
        self.model.push(model);
        self.covered = envelope(self.covered, model, self.tick_s);
    }

    fn noise_gate(&self) -> f64 {
        6.0 * self.feedback.noise_v
    }

    /// Processes the target, a reading and its age in ticks.
    pub(crate) fn update(&mut self, target: f64, measured: Option<(f64, u32)>) {
        self.target = envelope(self.target, target, self.tick_s);
        // The number of the first tick is 1.
        let now = self.model.len() as i64;
        let accepted = self.evaluate(now, measured);
        if !self.trusted() {
            self.correction *= (-self.tick_s / self.feedback.fade_s).exp();
        } else if let Some(mismatch) = accepted {
            let noise = self.noise_gate();
            self.detect_oscillation(mismatch, noise + 2.0 * (self.target.1 - self.target.0));
            let (innovation, model) = (mismatch - self.correction, self.model.last().copied().unwrap_or(0.0));
            self.innovations = envelope(self.innovations, innovation, self.feedback.interval_s);
            let bound = |moved: f64, opposite: f64| if opposite > noise { noise } else { noise + moved };
            let above = bound(model - self.covered.0, -self.innovations.0);
            let below = bound(self.covered.1 - model, self.innovations.1);
            self.correction += self.feedback.gain() * 0.25f64.powi(self.reductions) * innovation.clamp(-below, above);
        }
    }

    fn evaluate(&mut self, now: i64, measured: Option<(f64, u32)>) -> Option<f64> {
        let oldest = (self.feedback.oldest_s / self.tick_s).round() as i64;
        let usable = measured.filter(|&(_, age)| i64::from(age) <= oldest && now - i64::from(age) > self.sampled);
        let Some((read, age)) = usable else {
            let intervals = (4.0 * self.feedback.interval_s / self.tick_s).round() as i64;
            if now - self.sampled > oldest + intervals {
                (self.failed, self.good, self.bad) = (Some(None), 0, 0);
            }
            return None;
        };
        self.sampled = now - i64::from(age);
        let model = self.model[(self.model.len() - 1).saturating_sub(age as usize)];
        let mismatch = read - model;
        let was_trusted = self.trusted();
        match (self.verdict(read, model), self.failed) {
            (Verdict::Good, _) => {
                self.bad = self.bad.saturating_sub(1);
                self.good += 1;
                self.accepted += 0.25 * (mismatch - self.accepted);
                if self.good >= 50 {
                    self.failed = None;
                }
                return was_trusted.then_some(mismatch);
            }
            (Verdict::Stuck, _) => (self.failed, self.good, self.bad) = (Some(Some(Verdict::Stuck)), 0, 0),
            (verdict, None) => {
                self.bad += 4;
                if self.bad >= 13 {
                    (self.failed, self.good, self.bad) = (Some(Some(verdict)), 0, 0);
                }
            }
            (_, Some(Some(Verdict::Jumping))) => {
                self.good = 0;
                let part = 1.0 - (-self.feedback.interval_s / 30.0).exp();
                self.accepted += part * (mismatch - self.accepted);
            }
            (_, Some(_)) => {
                self.good = 0;
                self.accepted = mismatch;
            }
        }
        None
    }

    fn verdict(&mut self, read: f64, model: f64) -> Verdict {
        let (_, first, times) = match self.identical {
            Some((last, first, times)) if last == read => (last, first, times + 1),
            _ => (read, model, 1),
        };
        self.identical = Some((read, first, times));
        let (noise, range) = (self.noise_gate(), self.covered.1 - self.covered.0);
        if read < self.feedback.lowest_v || read > self.feedback.highest_v {
            return Verdict::OutOfRange;
        }
        let varies = (model - first).abs() > noise || self.failed == Some(Some(Verdict::Stuck));
        if times >= if varies { 8 } else { 100 } {
            return Verdict::Stuck;
        }
        let gate = if self.failed == Some(Some(Verdict::Jumping)) { noise } else { noise + 2.0 * range };
        let swings = (std::f64::consts::TAU * 5.0 * self.feedback.interval_s).min(2.0) * range;
        let (away, since) = ((read - model - self.accepted).abs(), (read - model - self.mismatch).abs());
        self.mismatch = read - model;
        if away > gate || away.min(since) > 1.5 * noise + swings { Verdict::Jumping } else { Verdict::Good }
    }

    fn detect_oscillation(&mut self, mismatch: f64, gate: f64) {
        let away = mismatch - self.mean;
        self.mean += (1.0 - (-self.feedback.interval_s / 2.0).exp()) * away;
        self.readings_since += 1.0;
        if self.readings_since > 2.0 / self.feedback.interval_s {
            self.crossings = 0;
        }
        self.amplitude = self.amplitude.max(away.abs());
        if away * if self.above { -1.0 } else { 1.0 } > gate {
            self.above = !self.above;
            self.readings_since = 0.0;
            if self.amplitude >= self.last_amplitude * 15.0 / 16.0 {
                self.crossings += 1;
            }
            self.last_amplitude = self.amplitude;
            self.amplitude = 0.0;
            if self.crossings >= 6 && self.reductions < 3 {
                self.crossings = 0;
                self.reductions += 1;
            }
        }
    }
}

/// Returns the envelopes of a signal one interval later, when it is `now`.
fn envelope((lowest, highest): (f64, f64), now: f64, interval_s: f64) -> (f64, f64) {
    let back = |envelope: f64| now + (envelope - now) * (-2.0 * interval_s).exp();
    (back(lowest).min(now), back(highest).max(now))
}
