//! The spring and its amplifier as differential equations.
//!
//! Command, delay, limit, slew -> voltage u -> hysteresis, law, gain -> v -> relaxation (w, w3, w4, creep w2) -> leakage L ->
//! resonance p -> lags in series -> drift -> stiffness. A row's voltage is held until the next row; its stiffness is read just
//! after the command. [`integrator`](super::integrator) integrates the equations over time.

use super::cause::Cause;
use super::effect::Effect;
use super::hysteresis::Hysteresis;
use super::physics::{Creep, Drift, Further, Law, Leakage, Resonance, SHARE, TAU_S, Tau};

/// Parameters of a spring and its amplifier. The default is the paper's plant behind an ideal amplifier.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "described in the modules `physics` and `hysteresis`")]
pub struct Spring {
    /// Time from a command to the amplifier's reaction, in s.
    pub delay_s: f64,
    /// Largest voltage of the amplifier, in V.
    pub limit_v: f64,
    /// Largest rate of the amplifier's voltage, in V/s.
    pub slew_v_per_s: f64,
    pub hysteresis: Hysteresis,
    pub law: Law,
    pub gain: f64,
    pub share: f64,
    pub tau: Tau,
    pub further: [Further; 2],
    pub creep: Option<Creep>,
    pub leakage: Option<Leakage>,
    pub resonance: Option<Resonance>,
    /// Time constants of lags in series behind the spring, in s; 0 for none.
    pub series_s: [f64; 2],
    pub drift: Option<Drift>,
}

impl Default for Spring {
    fn default() -> Self {
        Self {
            delay_s: 0.0,
            limit_v: f64::INFINITY,
            slew_v_per_s: f64::INFINITY,
            hysteresis: Hysteresis::None,
            law: Law::Straight,
            gain: 1.0,
            share: SHARE,
            tau: Tau::Linear { low_s: TAU_S, high_s: TAU_S },
            further: [Further::default(); 2],
            creep: None,
            leakage: None,
            resonance: None,
            series_s: [0.0; 2],
            drift: None,
        }
    }
}

/// State of the differential equations, without that of the hysteresis: w, w2, L, p, p', w3, w4.
pub(super) type State = [f64; 7];

impl Spring {
    /// The paper's spring with those of the effects that act before the sensor.
    pub fn with(effects: &[Effect]) -> Self {
        let mut spring = Self::default();
        // At size 0 it is exactly the paper's plant, not a form of the cause that approximates it.
        effects.iter().filter(|effect| effect.size > 0.0).for_each(|effect| spring.apply(effect));
        spring
    }

    /// Applies an effect to the parameters; effects on the readings change nothing.
    fn apply(&mut self, effect: &Effect) {
        let form = effect.form;
        match (effect.cause, effect.values().as_slice()) {
            (Cause::GainError, &[gain]) => self.gain = gain,
            (Cause::InstantaneousShare, &[share]) => self.share = share,
            (Cause::TimeConstant, &[tau_s]) => self.tau = Tau::Linear { low_s: tau_s, high_s: tau_s },
            (Cause::SecondRelaxation, &[share, tau_s]) => {
                self.creep = Some(Creep { share, tau_s, from_everything: form == 1 });
            }
            (Cause::VoltageDependentTimeConstant, &[low_s, high_s]) => {
                self.tau = if form == 0 { Tau::Linear { low_s, high_s } } else { Tau::Exponential { low_s, high_s } };
            }
            (Cause::StaticNonlinearity, _) => self.law = effect.law().expect("a static nonlinearity has a law"),
            (Cause::Hysteresis, _) => self.hysteresis = effect.hysteresis().expect("a hysteresis has an operator"),
            (Cause::ChargeLeakage, &[share, tau_s]) => {
                self.leakage = Some(Leakage { share, tau_s, before: form == 1 });
            }
            (Cause::Drift, &[per_s]) => {
                self.drift = Some([Drift::Multiplicative, Drift::Exponential, Drift::Additive][form](per_s));
            }
            (Cause::Resonance, &[freq_hz, zeta, participation]) => {
                self.resonance = Some(Resonance { freq_hz, zeta, participation, immediate: form == 1 });
            }
            (Cause::SeriesLag, &[tau_s]) => self.series_s = [tau_s, if form == 1 { tau_s } else { 0.0 }],
            (Cause::Delay, &[delay_s]) => self.delay_s = delay_s,
            (Cause::AmplifierLimit, &[limit_v]) => self.limit_v = limit_v,
            (Cause::AmplifierSlew, &[s_per_v]) => self.slew_v_per_s = 1.0 / s_per_v,
            (
                Cause::SensorSaturation | Cause::Quantisation | Cause::Hum | Cause::ReadingOffset | Cause::Outliers,
                _,
            ) => {}
            (cause, values) => unreachable!("{cause} with values {values:?}"),
        }
    }

    /// Response before resonance and drift, and the excitation of the resonance, both in V.
    pub(super) fn response(&self, v: f64, [w, w2, leaked, _, _, further @ ..]: State) -> (f64, f64) {
        let immediate = self.share * v;
        let slower = self.further.iter().zip(further).map(|(lag, at)| lag.part * (at - w)).sum::<f64>();
        let w = w + slower;
        let mut y = immediate + (1.0 - self.share) * w;
        match self.creep {
            None => {}
            Some(Creep { share, from_everything: true, .. }) => y += share * (w2 - y),
            Some(Creep { share, .. }) => y += share * (w2 - w),
        }
        y -= self.leakage.map_or(0.0, |leakage| leakage.share * leaked);
        (y, if self.resonance.is_some_and(|mode| mode.immediate) { immediate } else { y })
    }

    /// Time derivative of the state at voltage `u`; `v` is the settled response to it, both in V.
    pub(super) fn rates(&self, u: f64, v: f64, state: State) -> State {
        let [w, w2, leaked, p, p_rate, further @ ..] = state;
        let (y, excites) = self.response(v, state);
        let creep = self.creep.map_or(0.0, |creep| (v - w2) / creep.tau_s);
        let leak = self.leakage.map_or(0.0, |Leakage { share, tau_s, before }| {
            // The leakage follows the response without leakage, so that `share` of it is lost in the end.
            let source = if before { v } else { y + share * leaked };
            (source - leaked) / tau_s
        });
        let acceleration = self.resonance.map_or(0.0, |mode| {
            let omega = std::f64::consts::TAU * mode.freq_hz;
            omega * omega * (excites - p) - 2.0 * mode.zeta * omega * p_rate
        });
        let [third, fourth] = std::array::from_fn(|i| (v - further[i]) / self.further[i].tau_s);
        [(v - w) / self.tau.at(u), creep, leak, p_rate, acceleration, third, fourth]
    }
}
