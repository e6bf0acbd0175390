//! The controller with its sensor on a spring of the ground truth, and the bank after each of its ticks.

use model::isolation::{self, Finding, Tolerance, Verdict};
use model::{
    Config, Feedback, Input, OutOfRange, Reading, SampleTime, ScaledStiffness, Settings, State, Validate, Volts,
};
use simulation::isolation::reference::Bank;

use crate::ground_truth::{Effect, Live, Noise};

/// Ticks per second.
pub(super) const RATE_HZ: f64 = 1000.0;
/// Largest stiffness that the sensor sees, in V.
const TOP_V: f64 = 500.0;

/// The loop and the bank, one tick at a time.
pub(super) struct Watched {
    config: Config,
    state: State,
    settings: isolation::Settings,
    bank: isolation::Config,
    bank_state: isolation::State,
    live: Live,
    measured: Option<Reading>,
    last_read: f64,
    /// True if the sensor repeats its last reading.
    pub(super) stuck: bool,
    /// Standard deviation of a reading, in V.
    pub(super) noise_v: f64,
}

/// One tick, in V.
pub(super) struct Tick {
    /// Voltage across the spring.
    pub(super) applied: f64,
    /// The model's stiffness without the sensor's correction.
    pub(super) model: f64,
    /// The sensor's reading.
    pub(super) read: f64,
    /// The reading without noise.
    pub(super) expected: f64,
}

impl Watched {
    /// A spring without a fault at rest, for this number of ticks with white noise of a percentage of 500 V; `alarm_nats` is the
    /// threshold of the bank's sequential tests, `tolerance` the errors of the model that are no fault.
    ///
    /// # Errors
    /// The model rejects the settings.
    pub(super) fn new(
        percent: f64,
        alarm_nats: f64,
        tolerance: Tolerance,
        seed: u64,
        ticks: u32,
    ) -> Result<Self, OutOfRange> {
        let noise = Noise::white(percent);
        let noise_v = noise.sigma_v;
        let feedback = Some(Feedback { noise_v, ..Feedback::TYPICAL });
        let settings = isolation::Settings { noise_v, alarm_nats, tolerance, ..isolation::Settings::PAPER };
        Ok(Self {
            config: Settings { feedback, ..Settings::PAPER }.validate()?.quantize(),
            state: State::default(),
            settings,
            bank: settings.validate(SampleTime::from_rate(RATE_HZ)?)?.quantize(),
            bank_state: isolation::State::default(),
            live: Live::new(&[], noise, seed, TOP_V, ticks as usize),
            measured: None,
            last_read: 0.0,
            stuck: false,
            noise_v,
        })
    }

    /// Gives the spring and its sensor other effects from now on.
    pub(super) fn change(&mut self, effects: &[Effect]) {
        self.live.change(effects, TOP_V);
    }

    /// The spring as it is now, but with these effects from now on.
    pub(super) fn with(&self, effects: &[Effect]) -> Live {
        let mut live = self.live.clone();
        live.change(effects, TOP_V);
        live
    }

    /// Runs a tick of the controller and of the bank.
    ///
    /// # Errors
    /// Never: the reading is held within the range of a voltage.
    pub(super) fn tick(&mut self, target: Volts) -> Result<Tick, OutOfRange> {
        let output = self.config.tick(&mut self.state, Input { target, measured: self.measured });
        let model = ScaledStiffness(output.stiffness.0 - self.state.correction().0);
        let applied = output.applied.to_f64();
        let (_, reading) = self.live.hold(applied, 1.0 / RATE_HZ);
        let (read, expected) =
            if self.stuck { (self.last_read, self.last_read) } else { (reading.read, reading.expected) };
        self.last_read = read;
        let value = ScaledStiffness(Volts::new(read.clamp(-2000.0, 2000.0))?.0);
        self.measured = Reading::fresh(value);
        self.bank.tick(&mut self.bank_state, output.applied, model, Some(value));
        Ok(Tick { applied, model: model.to_f64(), read, expected })
    }

    /// What the bank reports of the cause that explains most.
    pub(super) fn finding(&self) -> Option<Finding> {
        self.bank_state.report().finding(&self.settings, RATE_HZ)
    }

    /// The bank in double precision, with the same settings.
    pub(super) fn reference(&self) -> Bank {
        Bank::new(self.settings, RATE_HZ)
    }

    /// Verdict of the bank.
    pub(super) fn verdict(&self) -> Verdict {
        self.bank_state.verdict()
    }

    /// Ends an alarm of the bank.
    pub(super) fn acknowledge(&mut self) {
        self.bank_state.acknowledge();
    }
}
