//! The chain from command to stiffness, in the order of [`model::extended`]:
//!
//! ```text
//! command -> limit -> slew -> output lag -> delay -> (magnitude) -> friction under load -> hysteresis -> law -> leakage
//! -> relaxation under its restoring force -> lags in series -> play -> output law -> stiffness
//! ```
//!
//! A plant file cannot hold a law behind the relaxation or in its feedback; it is written in front of it, where it settles at the
//! same stiffness.
//!
//! The chain starts as a plant file describes it, effects modify it, and the result is simulated and written to a plant
//! file again: the model that is fitted is the model that is written. A second limit takes the lower value, a second
//! slew rate the slower; delays add up, hysteresis and laws are composed, and the parameters of the relaxation are
//! replaced.

use crate::plant::initial_state::InitialState;
use crate::plant::knee::at_most;
use crate::plant::law::Law;
use crate::plant::leakage::{InstantaneousLoss, Loss};
use crate::plant::load_friction::LoadFriction;
use crate::plant::play_bank::PlayBank;
use crate::plant::relaxation::{Relaxation, Running};
use crate::plant::restoring;
use crate::plant::visited::{Range, Visited};
use crate::record::scales::REFERENCE_VOLTAGE_V;
use crate::record::signal::{Lag, Piece, Signal};
use simulation::plant_file::{Amplifier, Leakage, PlantFile};

/// All blocks between the command and the stiffness that effects can modify.
pub struct Chain<'a> {
    /// Largest magnitudes of the amplifier's positive and negative voltages, in V. A plant file holds one for both.
    pub limits_v: [f64; 2],
    /// Knee with which they are approached, in V; 0 for none. A plant file cannot hold it.
    pub knee_v: f64,
    /// Largest rate at which the amplifier's voltage rises, in V/s.
    pub rising_v_per_s: f64,
    /// Largest rate at which it falls, in V/s, positive.
    pub falling_v_per_s: f64,
    /// Largest rate of its square, with its sign, in V^2/s: the power of its charger.
    pub power_v2_per_s: f64,
    /// Time constant with which the amplifier follows its command within the rate at which it rises, in s; 0 for none. A plant file cannot
    /// hold it.
    pub follow_tau_s: f64,
    /// Amplifier voltage before the first row, in V; `None` if it equals the command.
    pub initial_v: Option<f64>,
    /// Time constant of the amplifier's output resistance with the spring's capacitance, in s; 0 for none.
    pub output_tau_s: f64,
    /// Delay of the amplifier, in s.
    pub delay_s: f64,
    /// True if the spring responds to the voltage's magnitude.
    pub even: bool,
    /// Hysteresis: a bank of play operators.
    pub memory: PlayBank,
    /// Hysteresis in proportion to the voltage, in front of that; a plant file cannot hold it.
    pub friction: LoadFriction,
    /// Static law from voltage to settled stiffness.
    pub law: Law<'a>,
    /// Gain that the law contains: a curve is one of the signal divided by it.
    pub gain: f64,
    /// Restoring force of the relaxation over the stiffness, both in V; the identity for a linear one.
    pub force: Law<'a>,
    /// A second bank of play operators, behind the relaxation.
    pub memory_behind: PlayBank,
    /// A second static law, behind the relaxation.
    pub law_behind: Law<'a>,
    /// Charge losses; a plant file can hold the first one only.
    pub losses: Vec<Loss>,
    /// Feedthrough and lags from settled stiffness to stiffness.
    pub relaxation: Relaxation,
    /// Time constants of lags in series with the relaxation, in s.
    pub series_s: Vec<f64>,
}

/// What is left from the time before the first row, beside the offsets of lags.
struct FromBefore {
    /// Voltage on the amplifier's output, in V.
    output_v: f64,
    /// Voltages that arrive delayed, in V, each for an interval of the delay.
    late_v: [f64; DELAY_INTERVALS],
    /// Part by which play operators are where the largest voltage leaves them, 0 to 1.
    kept: f64,
}

/// Fraction by which a delay is shortened, so that a jump that falls on the time of a row is before that row however
/// sums of times are rounded.
const DELAY_ROUNDING: f64 = 1e-5;
/// Number of intervals of the delay in which the voltage sent before the first row may have had different values.
const DELAY_INTERVALS: usize = 6;
/// No voltage that arrives late.
const NONE_LATE: [f64; DELAY_INTERVALS] = [0.0; DELAY_INTERVALS];
/// A voltage above that of any record, in normalised V.
const HIGHEST_V: f64 = 2000.0 * REFERENCE_VOLTAGE_V;

impl<'a> Chain<'a> {
    /// Returns the chain of a plant file, with the given relaxation.
    pub fn of(file: &'a PlantFile, relaxation: Relaxation) -> Self {
        let amplifier = file.amplifier.as_ref();
        let number = |of: fn(&Amplifier) -> Option<f64>, else_value| amplifier.and_then(of).unwrap_or(else_value);
        let slew_v_per_s = number(|amplifier| amplifier.slew_v_per_s, f64::INFINITY);
        Self {
            limits_v: [number(|amplifier| amplifier.limit_v, f64::INFINITY); 2],
            knee_v: 0.0,
            rising_v_per_s: slew_v_per_s,
            falling_v_per_s: slew_v_per_s,
            power_v2_per_s: f64::INFINITY,
            follow_tau_s: 0.0,
            initial_v: None,
            output_tau_s: 0.0,
            delay_s: number(|amplifier| amplifier.delay_s, 0.0),
            even: file.even,
            memory: PlayBank::of(file.memory.as_ref()),
            friction: LoadFriction::new(0.0),
            law: Law::of(file.law.as_ref()),
            gain: 1.0,
            force: Law::of(None),
            memory_behind: PlayBank::of(None),
            law_behind: Law::of(None),
            losses: file.leakage.iter().map(Loss::of).collect(),
            relaxation,
            series_s: Vec::new(),
        }
    }

    /// Writes the chain to a plant file, with laws tabulated where a record has been.
    pub fn write(&self, file: &mut PlantFile, visited: &Visited) {
        let amplifier = Amplifier {
            // One limit for both signs: the farther one, which takes no voltage away.
            limit_v: Some(self.limits_v[0].max(self.limits_v[1])).filter(|limit| limit.is_finite()),
            // A file holds one rate; the faster one bounds both directions.
            slew_v_per_s: Some(self.rising_v_per_s.max(self.falling_v_per_s)).filter(|slew| slew.is_finite()),
            delay_s: Some(self.delay_s).filter(|delay| *delay > 0.0),
        };
        file.amplifier = (amplifier != Amplifier::default()).then_some(amplifier);
        if self.memory.fits_plant_file() {
            file.memory = self.memory.table();
        }
        let (gain, relaxation, leakage) = self.as_plant_file_tables();
        let relaxation = relaxation.in_series_with(&self.series_s).unwrap_or(relaxation);
        file.law = self.law.table(gain, &self.settled_law(), self.known_law(visited));
        file.leakage = leakage;
        relaxation.extend(file);
    }

    /// Returns the gain, the relaxation and the leakage that represent the chain in a plant file.
    fn as_plant_file_tables(&self) -> (f64, Relaxation, Option<Leakage>) {
        match self.losses.first() {
            Some(loss) if loss.instantaneous > 0.0 => match loss.equivalent_leakage(&self.relaxation) {
                Some((gain, share, leakage)) => (gain, Relaxation { share, ..self.relaxation }, Some(leakage)),
                None => (1.0, self.relaxation, None),
            },
            loss => (1.0, self.relaxation, loss.map(|loss| Leakage { share: loss.share, tau_s: loss.tau_s })),
        }
    }

    /// Returns the law from the settled stiffness of the linear relaxation to that of the chain.
    fn settled_law(&self) -> Law<'_> {
        let mut law = Law::of(None);
        if !self.force.is_identity() {
            law.push(|settled| restoring::at_force(&self.force, settled));
        }
        if !self.law_behind.is_identity() {
            law.push(|stiffness| self.law_behind.at(stiffness));
        }
        law
    }

    /// Returns true if a plant file can hold the lags in series.
    pub fn series_lags_fit_plant_file(&self) -> bool {
        self.as_plant_file_tables().1.in_series_with(&self.series_s).is_some()
    }

    /// Returns true if the response to the initial state depends on the settled stiffness.
    pub fn initial_state_depends_on_voltage(&self) -> bool {
        let linear = self.relaxation.is_linear() && self.force.is_identity();
        self.memory.table().is_some() || !linear
    }

    /// Returns true if the stiffness is linear in the initial state: not where a law, a play operator or the time constant depends on
    /// the state.
    pub fn is_linear_in_start(&self) -> bool {
        let relaxation = &self.relaxation;
        let by_state = relaxation.varies() && relaxation.by_state.is_some();
        let linear_relaxation = !by_state && relaxation.falling_tau_s.is_none() && self.force.is_identity();
        linear_relaxation && self.law_behind.is_identity() && self.memory_behind.table().is_none()
    }

    /// Returns the work of the linear part on a signal, in units of one lag; `irregular` is the fraction of its pieces that are not as
    /// long as the one before them.
    pub fn work(&self, signal: &Signal, irregular: f64) -> f64 {
        let of = |relaxation: &Relaxation| match self.force.is_identity() {
            true => relaxation.work(signal, irregular),
            false => restoring::work(relaxation, signal),
        };
        match self.exact_series() {
            Some(relaxation) => of(&relaxation),
            None => of(&self.relaxation) + (self.series_s.len() * signal.len()) as f64,
        }
    }

    /// Returns a relaxation that is the chain's with all lags in series, which is exact where the output of one as the input of
    /// the next is not; `None` if there is none, also where a part of a loss bypasses the relaxation or its restoring force is not linear.
    fn exact_series(&self) -> Option<Relaxation> {
        let passes = self.force.is_identity() && self.losses.iter().all(|loss| loss.instantaneous == 0.0);
        self.relaxation.in_series_with(&self.series_s).filter(|_| passes || self.series_s.is_empty())
    }

    /// Maps the commanded voltage to the voltage on the spring's electrodes, or to its magnitude where that alone counts.
    pub fn amplify(&self, signal: &mut Signal) {
        if self.limits_v.iter().any(|limit| limit.is_finite()) {
            // Zero at 0 V, which a large knee reaches.
            let at_rest = self.limits_v.map(|limit_v| at_most(0.0, limit_v, self.knee_v));
            signal.map(|voltage| {
                let sign = usize::from(voltage < 0.0);
                (at_most(voltage.abs(), self.limits_v[sign], self.knee_v) - at_rest[sign]).copysign(voltage)
            });
        }
        signal.before = self.initial_v.unwrap_or(signal.before);
        if self.follow_tau_s > 0.0 {
            *signal = signal.followed(self.rising_v_per_s, self.follow_tau_s);
        } else if self.rising_v_per_s.is_finite() || self.falling_v_per_s.is_finite() {
            *signal = signal.slewed(self.rising_v_per_s, self.falling_v_per_s);
        }
        if self.power_v2_per_s.is_finite() {
            *signal = signal.charged(self.power_v2_per_s);
        }
        if self.output_tau_s > 0.0 {
            let mut output = Lag::at(self.output_tau_s, signal.before);
            signal.pass(|piece| output.pass(piece));
        }
        if self.delay_s > 0.0 {
            *signal = signal.delayed(self.delay_s * (1.0 - DELAY_ROUNDING));
        }
        if self.even {
            *signal = signal.magnitude();
        }
    }

    /// Maps the voltage on the electrodes to the settled stiffness, by hysteresis and static law.
    pub fn static_response(&self, signal: &mut Signal) {
        if !self.friction.is_none() {
            let mut friction = self.friction;
            signal.map(|voltage| friction.at(voltage));
        }
        let mut memory = self.memory.clone();
        if memory.table().is_some() {
            signal.map(|voltage| memory.at(voltage));
        }
        if !self.law.is_identity() {
            signal.map(|voltage| self.law.at(voltage));
        }
    }

    /// Maps the settled stiffness to the stiffness, from an initial state. `applied` is the voltage on the electrodes; `levels_v`
    /// receives what sets the time constant in each piece, if it varies by voltage or time. `other` is the stiffness from
    /// another initial state, if that is known. Returns the part of the signal that was simulated, 0 to 1: less than 1 where the
    /// initial state has decayed.
    pub fn relax(
        &self,
        signal: &mut Signal,
        applied: &Signal,
        start: &mut InitialState,
        levels_v: &mut Vec<f64>,
        other: Option<&Signal>,
    ) -> f64 {
        if self.relaxation.depends_on_levels() {
            self.relaxation.levels_of(applied, levels_v);
        }
        self.add_from_before(applied, signal, start);
        let is_last = self.memory_behind.table().is_none() && self.law_behind.is_identity();
        let simulated = self.follow(signal, start, levels_v, other.filter(|_| is_last && self.series_s.is_empty()));
        if self.memory_behind.table().is_some() {
            let mut memory = self.memory_behind.clone();
            signal.map(|stiffness| memory.at(stiffness));
        }
        if !self.law_behind.is_identity() {
            signal.map(|stiffness| self.law_behind.at(stiffness));
        }
        simulated
    }

    /// Returns where on its curves the spring is under a command.
    pub fn visited(&self, command: &Signal) -> Visited {
        let mut signal = command.clone();
        self.amplify(&mut signal);
        let applied = signal.clone();
        let (mut friction, mut memory) = (self.friction, self.memory.clone());
        signal.map(|voltage| memory.at(friction.at(voltage)));
        let law = Range::of(&signal);
        signal.map(|voltage| self.law.at(voltage));
        let mut levels_v = Vec::new();
        if self.relaxation.depends_on_levels() {
            self.relaxation.levels_of(&applied, &mut levels_v);
        }
        self.follow(&mut signal, &mut InitialState::at_rest(), &levels_v, None);
        Visited { voltage: Range::of(&applied), law, stiffness: Range::of(&signal) }
    }

    /// Returns the range of voltages over which a record shows the static law that is written to a plant file.
    pub fn known_law(&self, visited: &Visited) -> Range {
        let (gain, ..) = self.as_plant_file_tables();
        match self.law_behind.is_identity() {
            true => visited.law,
            false => self.law.known(|settled| restoring::at_force(&self.force, gain * settled), visited),
        }
    }

    /// Applies leakage, relaxation and lags in series. `other` is the stiffness from another initial state, if that is known. Returns the
    /// part of the signal that was simulated, 0 to 1.
    fn follow(&self, signal: &mut Signal, start: &mut InitialState, levels_v: &[f64], other: Option<&Signal>) -> f64 {
        let mut lost = InstantaneousLoss::default();
        self.losses.iter().for_each(|loss| loss.apply(signal, start, &mut lost));
        let exact = self.exact_series();
        let mut simulated = 1.0;
        match exact.as_ref().unwrap_or(&self.relaxation) {
            relaxation if self.force.is_identity() => relaxation.pass(signal, start, levels_v),
            relaxation => {
                let other = other.filter(|_| lost.is_none());
                simulated = restoring::pass(relaxation, &self.force, signal, start, levels_v, other);
            }
        }
        if !lost.is_none() {
            lost.subtract_from(signal);
        }
        for &tau_s in self.series_s.iter().filter(|_| exact.is_none()) {
            let mut lag = Lag::at(tau_s, signal.before + start.next_offset_v());
            if lag.value() != 0.0 || !signal.is_zero() {
                signal.pass(|piece| lag.pass(piece));
            }
        }
        simulated
    }

    /// Replaces `signal` by the response of the stiffness to the initial state, where `applied` is the voltage on the electrodes, of a
    /// chain that is [linear](Chain::is_linear_in_start) in it.
    pub fn initial_state_response(
        &self,
        applied: &Signal,
        signal: &mut Signal,
        start: &mut InitialState,
        levels_v: &[f64],
    ) {
        signal.silence_as(applied);
        self.add_from_before(applied, signal, start);
        self.follow(signal, start, levels_v, None);
    }

    /// Returns the same at the times of the rows, in s, and its work in units of one lag: a linear relaxation responds freely once the
    /// voltages have arrived that were sent before the first row. `None` where more than these and the relaxation is off.
    pub fn free_response(&self, applied: &Signal, time_s: &[f64], start: &mut InitialState) -> Option<(Vec<f64>, f64)> {
        let relaxation = self.exact_series().filter(Relaxation::is_linear)?;
        if self.output_tau_s > 0.0 || !self.losses.is_empty() || !self.force.is_identity() {
            return None;
        }
        let FromBefore { late_v, kept, .. } = self.left_before(start);
        if kept != 0.0 {
            return None;
        }
        let mut running = Running::at(&relaxation, 0.0, start);
        let mut response = Vec::with_capacity(time_s.len());
        let (mut at_s, mut simulated) = (0.0, 0);
        if late_v != NONE_LATE {
            for (piece, starts_row) in applied.pieces_and_rows() {
                if starts_row && self.have_arrived(at_s) {
                    break;
                }
                let sent = self.late(&late_v, at_s, piece);
                let (from, _) = running.pass(Piece { from: sent, to: sent, ..piece }, None);
                at_s += piece.duration_s;
                simulated += 1;
                if starts_row {
                    response.push(from);
                }
            }
        }
        let arrived = response.len();
        response.resize(time_s.len(), 0.0);
        simulated += running.add_free(&time_s[arrived..], &mut response[arrived..]);
        Some((response, relaxation.free_work(simulated)))
    }

    /// Returns what is left from the time before the first row.
    fn left_before(&self, start: &mut InitialState) -> FromBefore {
        let mut next_if = |is_there: bool| if is_there { start.next_offset_v() } else { 0.0 };
        FromBefore {
            output_v: next_if(self.output_tau_s > 0.0),
            late_v: NONE_LATE.map(|_| next_if(self.delay_s > 0.0)),
            kept: next_if(self.memory.table().is_some()),
        }
    }

    /// Returns the voltage that arrives over a piece which begins at a time, in s, of those that were sent before the first row.
    fn late(&self, late_v: &[f64; DELAY_INTERVALS], at_s: f64, piece: Piece) -> f64 {
        let interval = (at_s + piece.duration_s / 2.0) / self.delay_s * DELAY_INTERVALS as f64;
        late_v.get(interval as usize).copied().unwrap_or(0.0)
    }

    /// Returns true if all voltages have arrived at a time, in s, that were sent before the first row.
    fn have_arrived(&self, at_s: f64) -> bool {
        at_s > 2.0 * self.delay_s
    }

    /// Adds to the settled stiffness what is left from the time before the first row: voltages that arrive delayed, and play operators
    /// as the largest voltage leaves them.
    fn add_from_before(&self, applied: &Signal, signal: &mut Signal, start: &mut InitialState) {
        let FromBefore { output_v, late_v, kept } = self.left_before(start);
        let mut output = Lag::at(self.output_tau_s, output_v);
        let (mut rest, mut above) = (self.memory.clone(), self.memory.clone());
        rest.at(applied.before);
        above.at(HIGHEST_V);
        let mut apart = |voltage| match kept {
            0.0 => 0.0,
            _ => kept * (self.law.at(above.at(voltage)) - self.law.at(rest.at(voltage))),
        };
        if output_v != 0.0 || kept != 0.0 || late_v != NONE_LATE {
            let (mut at_s, mut voltages) = (0.0, applied.pieces().iter());
            signal.pass(|piece| {
                let sent = self.late(&late_v, at_s, piece);
                at_s += piece.duration_s;
                if kept == 0.0 && output.value() == 0.0 && self.have_arrived(at_s) {
                    return (piece.from, piece.to);
                }
                let silent = Piece { from: 0.0, to: 0.0, ..piece };
                let (from, to) = if output.value() == 0.0 { (0.0, 0.0) } else { output.pass(silent) };
                let voltage = voltages.next().expect("as many pieces");
                (piece.from + from + sent + apart(voltage.from), piece.to + to + sent + apart(voltage.to))
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::base::Base;
    use crate::plant::relaxation::Part;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use simulation::plant_file::Mode;
    use simulation::record::{Record, Row};

    /// Rows at irregular times, a few of them within the delay.
    fn data() -> Data {
        let time_s = |row: usize| 0.1 * row as f64 + 0.03 * (row % 3) as f64;
        let row = |row: usize| Row {
            line: row,
            time_s: time_s(row),
            voltage_v: [300.0, 100.0][row / 7 % 2],
            measured: Some(row as f64),
        };
        Data::new(&Record { name: String::new(), rows: (0..400).map(row).collect() }, Input::Hold)
    }

    /// Compares free responses with simulations of all pieces; returns the states whose response was free.
    fn free_states(of: impl Fn(&mut Chain)) -> Vec<usize> {
        let (data, base) = (data(), Base::paper());
        let mut chain = base.chain();
        of(&mut chain);
        let mut applied = data.command.clone();
        chain.amplify(&mut applied);
        let mut free = Vec::new();
        let (mut state, mut states) = (0, 1);
        while state < states {
            let (mut whole, mut start) = (Signal::default(), InitialState::off(state));
            chain.initial_state_response(&applied, &mut whole, &mut start, &[]);
            states = start.states();
            let mut start = InitialState::off(state);
            if let Some((response, _)) = chain.free_response(&applied, &data.time_s, &mut start) {
                assert_eq!((response.len(), start.states()), (data.time_s.len(), states));
                for (row, (free, whole)) in response.iter().zip(whole.at_rows()).enumerate() {
                    assert!((free - whole).abs() < 1e-9, "state {state}, row {row}: {free} instead of {whole}");
                }
                free.push(state);
            }
            state += 1;
        }
        free
    }

    #[test]
    fn a_linear_relaxation_responds_freely_to_what_is_left_from_before() {
        assert_eq!(free_states(|_| ()), [0]);
        let several = |chain: &mut Chain| {
            chain.delay_s = 0.53;
            chain.relaxation.add_lags(&[Part { part: 0.2, tau_s: 0.4 }], false);
            chain.relaxation.modes[0] = Mode { freq_hz: 0.7, zeta: 0.1, weight: 0.3, rate_weight: 0.1 };
        };
        // Six intervals of the delay, two lags, place and rate of an oscillation.
        assert_eq!(free_states(several), [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
        assert_eq!(free_states(|chain| chain.series_s.push(0.8)), [0, 1]);
        // Play operators keep what is left in all of the record.
        let with_play = |chain: &mut Chain| chain.memory = PlayBank::new(0.5, [(40.0, 0.5)]);
        assert_eq!(free_states(with_play), [1]);
    }

    #[test]
    fn what_is_off_in_front_of_the_relaxation_is_simulated() {
        assert!(free_states(|chain| chain.output_tau_s = 0.3).is_empty());
        let loss = Loss { share: 0.2, tau_s: 3.0, instantaneous: 0.0 };
        assert!(free_states(|chain| chain.losses.push(loss)).is_empty());
        assert!(free_states(|chain| chain.relaxation.falling_tau_s = Some(3.0)).is_empty());
    }
}
