//! Controller, bank and adaptation in one loop, one tick at a time: what the MCU runs, in the same order.

use model::adaptation::{Observation, Parameters, Settings, State, Variant, Watch, settled_within};
use model::isolation::{self, bank};
use model::units::Signal;
use model::{OutOfRange, Output, SampleTime, ScaledStiffness, Validate, Volts, controller};

/// Controller, bank and adaptation with their states.
#[derive(Clone, Debug)]
pub struct Adaptive {
    control: controller::Settings,
    bank: isolation::Settings,
    settings: Option<Settings>,
    variant: Variant,
    state: controller::State,
    bank_state: isolation::State,
    watch: Watch,
    adaptation: State,
    proposed: Option<Parameters>,
    target: Volts,
    tolerance: Volts,
    exchanges: u32,
    /// Voltage and model of the tick before, to which the reading of a tick belongs.
    last: Option<(Volts, ScaledStiffness)>,
}

impl Adaptive {
    /// A loop at rest with the stored model; without settings nothing adapts.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field that is rejected.
    pub fn new(
        control: controller::Settings,
        bank: isolation::Settings,
        settings: Option<Settings>,
    ) -> Result<Self, OutOfRange> {
        let sample_time = SampleTime::from_rate(control.rate_hz)?;
        if let Some(settings) = &settings {
            settings.validate(sample_time)?;
            settings.check_for(&control, &bank)?;
        }
        Ok(Self {
            control,
            bank,
            settings,
            variant: Variant::new(&control, &bank, &Parameters::STORED)?,
            state: controller::State::default(),
            bank_state: isolation::State::default(),
            watch: Watch::NEW,
            adaptation: State::default(),
            proposed: None,
            target: Volts::ZERO,
            tolerance: settled_within(bank.range_v),
            exchanges: 0,
            last: None,
        })
    }

    /// Runs a tick towards `target` with the reading of the spring after the tick before.
    pub fn tick(&mut self, target: Volts, measured: Option<ScaledStiffness>) -> Output {
        let Variant { control, bank, scale } = &self.variant;
        self.target = target;
        let output = control.tick(&mut self.state, scale.input(target, measured));
        let model = ScaledStiffness(output.stiffness.0.saturating_sub(self.state.correction().0));
        if let Some((applied, model)) = self.last.replace((output.applied, model)) {
            bank.tick(&mut self.bank_state, applied, model, measured.map(|reading| scale.inward(reading)));
        }
        let output = scale.output(output);
        if self.watch.tick(bank, &self.bank_state, &output, self.tolerance) {
            self.end_of_block();
        }
        output
    }

    fn end_of_block(&mut self) {
        let Some(settings) = &self.settings else { return };
        let proposed = self.proposed.filter(|_| self.watch.settled());
        // Parameters within the bounds have been checked at the start.
        let next = proposed.and_then(|parameters| Variant::new(&self.control, &self.bank, &parameters).ok());
        if let Some(next) = next {
            next.take_over(&mut self.state, (&self.variant.control, &self.variant.scale), self.target);
            self.variant = next;
            self.bank_state.acknowledge();
            self.exchanges += 1;
        }
        let seen: Observation = self.watch.observe(&self.bank_state, next.is_some());
        let block_s = bank::block_s(self.control.rate_hz);
        self.proposed =
            self.adaptation.update(settings, &seen, self.control.plant, self.control.amplifier.max_v, block_s);
    }

    /// The adaptation's state.
    pub fn adaptation(&self) -> &State {
        &self.adaptation
    }

    /// The bank's state.
    pub fn bank(&self) -> &isolation::State {
        &self.bank_state
    }

    /// Number of exchanges so far.
    pub fn exchanges(&self) -> u32 {
        self.exchanges
    }
}

/// Returns a stiffness in V as the tick sees it.
pub fn reading(volts: f64) -> ScaledStiffness {
    ScaledStiffness(Signal::saturating_from_num(volts))
}
