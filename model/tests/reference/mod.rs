//! The correction and its watch as the documentation says them, in double precision and without regard to cost.

use model::Feedback;

/// What became of one reading.
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
    /// What the model said, tick by tick; at rest before the first.
    model: Vec<f64>,
    /// Lowest and highest of late.
    covered: (f64, f64),
    asked: (f64, f64),
    correction: f64,
    /// When the last reading was sampled.
    sampled: i64,
    believed: f64,
    /// Trusted, or the last word against it: `None` stands for silence.
    failed: Option<Option<Verdict>>,
    bad: u32,
    good: u32,
    /// Value, model and number of equal readings.
    equal: Option<(f64, f64, u32)>,
    mean: f64,
    above: bool,
    reach: f64,
    last_reach: f64,
    crossings: u32,
    readings_since: f64,
    quartered: i32,
}

impl Reference {
    pub(crate) fn new(feedback: &Feedback, rate_hz: f64) -> Self {
        Self {
            feedback: *feedback,
            tick_s: 1.0 / rate_hz,
            model: vec![0.0],
            covered: (0.0, 0.0),
            asked: (0.0, 0.0),
            correction: 0.0,
            sampled: 0,
            believed: 0.0,
            failed: Some(None),
            bad: 0,
            good: 0,
            equal: None,
            mean: 0.0,
            above: false,
            reach: 0.0,
            last_reach: 0.0,
            crossings: 0,
            readings_since: 0.0,
            quartered: 0,
        }
    }

    pub(crate) fn trusted(&self) -> bool {
        self.failed.is_none()
    }

    pub(crate) fn correction(&self) -> f64 {
        self.correction
    }

    /// The model's stiffness of this tick.
    pub(crate) fn moved(&mut self, model: f64) {
        self.model.push(model);
        self.covered = self.cover(self.covered, model);
    }

    fn cover(&self, (lowest, highest): (f64, f64), now: f64) -> (f64, f64) {
        let back = |envelope: f64| now + (envelope - now) * (-2.0 * self.tick_s).exp();
        (back(lowest).min(now), back(highest).max(now))
    }

    fn noise_gate(&self) -> f64 {
        6.0 * self.feedback.noise_v
    }

    fn gate(&self) -> f64 {
        self.noise_gate() + 2.0 * (self.covered.1 - self.covered.0)
    }

    /// The target, a reading and its age in ticks.
    pub(crate) fn hear(&mut self, target: f64, measured: Option<(f64, u32)>) {
        self.asked = self.cover(self.asked, target);
        // The first tick is 1.
        let now = self.model.len() as i64;
        let believed = self.judge(now, measured);
        if !self.trusted() {
            self.correction *= (-self.tick_s / self.feedback.fade_s).exp();
        } else if let Some(mismatch) = believed {
            let gate = self.gate();
            self.swing(mismatch, self.noise_gate() + 2.0 * (self.asked.1 - self.asked.0));
            let innovation = (mismatch - self.correction).clamp(-gate, gate);
            self.correction += self.feedback.gain() * 0.25f64.powi(self.quartered) * innovation;
        }
    }

    fn judge(&mut self, now: i64, measured: Option<(f64, u32)>) -> Option<f64> {
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
                self.believed += 0.25 * (mismatch - self.believed);
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
                self.believed += part * (mismatch - self.believed);
            }
            (_, Some(_)) => {
                self.good = 0;
                self.believed = mismatch;
            }
        }
        None
    }

    fn verdict(&mut self, read: f64, model: f64) -> Verdict {
        let (_, first, times) = match self.equal {
            Some((last, first, times)) if last == read => (last, first, times + 1),
            _ => (read, model, 1),
        };
        self.equal = Some((read, first, times));
        let gate = if self.failed == Some(Some(Verdict::Jumping)) { self.noise_gate() } else { self.gate() };
        if read < self.feedback.lowest_v || read > self.feedback.highest_v {
            Verdict::OutOfRange
        } else if times >= 8 && (model - first).abs() > self.noise_gate() {
            Verdict::Stuck
        } else if (read - model - self.believed).abs() > gate {
            Verdict::Jumping
        } else {
            Verdict::Good
        }
    }

    fn swing(&mut self, mismatch: f64, gate: f64) {
        let away = mismatch - self.mean;
        self.mean += (1.0 - (-self.feedback.interval_s / 2.0).exp()) * away;
        self.readings_since += 1.0;
        if self.readings_since > 2.0 / self.feedback.interval_s {
            self.crossings = 0;
        }
        self.reach = self.reach.max(away.abs());
        if away * if self.above { -1.0 } else { 1.0 } > gate {
            self.above = !self.above;
            self.readings_since = 0.0;
            if self.reach >= self.last_reach * 15.0 / 16.0 {
                self.crossings += 1;
            }
            self.last_reach = self.reach;
            self.reach = 0.0;
            if self.crossings >= 6 && self.quartered < 3 {
                self.crossings = 0;
                self.quartered += 1;
            }
        }
    }
}
