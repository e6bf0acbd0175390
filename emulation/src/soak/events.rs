//! Commands, readings and disturbances of a run, in phases of up to 20 000 ticks: calm ones, in which the loop settles,
//! and ones in which a host, a sensor, a clock or an interlock misbehaves.

use firmware::control::{Sensors, Tick};
use link::Command;
use model::Volts;
use model::supervisor::{Command as Arming, Fault, Faults, Monitors};
use model::units::Signal;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::setup::SetLimits;

/// What happens before one tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) command: Option<Command>,
    pub(super) heard: bool,
    pub(super) late_us: u32,
    interlock_closed: bool,
    monitors: Option<Monitors>,
    faults: Faults,
    measured: Option<Volts>,
}

impl Event {
    pub(super) fn sensors(&self, missed_ticks: u32) -> Sensors {
        let Self { interlock_closed, monitors, faults, measured, .. } = *self;
        Sensors { interlock_closed, missed_ticks, monitors, faults, measured }
    }
}

/// How often something happens in a phase: its probability in each tick, in 2^-16.
#[derive(Clone, Copy, Debug, Default)]
struct Phase {
    ticks: u32,
    arm: u16,
    disarm: u16,
    target: u16,
    deaf: bool,
    late: u16,
    open: u16,
    fault: u16,
    monitor: u16,
    /// The monitors are wrong in every tick, as with another amplifier.
    wrong: bool,
    reading: Readings,
}

#[derive(Clone, Copy, Debug, Default)]
enum Readings {
    #[default]
    None,
    /// The estimate with noise, and an offset.
    Good(i32),
    /// One value, repeated in every tick.
    Stuck(Signal),
    /// Any bits.
    Wild,
}

/// The events of one run.
pub(super) struct Events {
    random: ChaCha8Rng,
    phase: Phase,
    highest_v: f64,
    sensor: bool,
    stiffness: Signal,
    applied: Volts,
}

impl Events {
    pub(super) fn new(limits: &SetLimits, random: &mut ChaCha8Rng) -> Self {
        let SetLimits { amplifier, sensor, .. } = *limits;
        Self {
            random: random.clone(),
            phase: Phase::default(),
            highest_v: amplifier.max_v,
            sensor,
            stiffness: Signal::ZERO,
            applied: Volts::ZERO,
        }
    }

    /// Takes the result of the last tick, which the readings of the next one follow.
    pub(super) fn observe(&mut self, tick: &Tick) {
        (self.stiffness, self.applied) = (tick.output.stiffness.0, tick.output.applied);
    }

    pub(super) fn next(&mut self) -> Event {
        if self.phase.ticks == 0 {
            self.phase = self.phase();
        }
        self.phase.ticks -= 1;
        let phase = self.phase;
        // One draw decides about four events, the next one about four more.
        let [first, second] = [self.random.random::<u64>(), self.random.random::<u64>()];
        let happens = |bits: u64, place: u32, often: u16| ((bits >> (16 * place)) as u16) < often;
        let arming = match (happens(first, 0, phase.disarm), happens(first, 1, phase.arm)) {
            (true, _) => Some(Arming::Disarm),
            (false, true) => Some(Arming::Arm),
            (false, false) => None,
        };
        let target = happens(first, 2, phase.target).then(|| self.target());
        let heard = !phase.deaf && second & 0x3f == 0;
        let command = (arming.is_some() || target.is_some()).then_some(Command { heard: !phase.deaf, arming, target });
        Event {
            command,
            heard,
            late_us: if happens(first, 3, phase.late) { self.lateness() } else { 0 },
            interlock_closed: !happens(second, 1, phase.open),
            monitors: self.monitors(phase.wrong || happens(second, 2, phase.monitor)),
            faults: if happens(second, 3, phase.fault) { self.faults() } else { Faults::NONE },
            measured: if self.sensor { self.reading(second as i32 >> 12) } else { None },
        }
    }

    fn phase(&mut self) -> Phase {
        let random = &mut self.random;
        let mut rarely = |most: u16| if random.random_range(0..4) == 0 { random.random_range(0..=most) } else { 0 };
        let (late, open, fault, monitor) = (rarely(2000), rarely(500), rarely(200), rarely(2000));
        let (disarm, target) = (rarely(300), rarely(u16::MAX));
        let reading = match random.random_range(0..6) {
            0 => Readings::None,
            1 => Readings::Stuck(Signal::from_bits(random.random::<i32>() >> 2)),
            2 => Readings::Wild,
            _ => Readings::Good(random.random_range(-20_000_000..20_000_000)),
        };
        Phase {
            ticks: random.random_range(1..20_000),
            arm: random.random_range(0..5000),
            // Faults have to be acknowledged, or nothing would be armed again.
            disarm: disarm.max(100),
            target: target.max(20),
            deaf: random.random_range(0..8) == 0,
            late,
            open,
            fault,
            monitor,
            wrong: random.random_range(0..12) == 0,
            reading,
        }
    }

    /// One fault of any code, or two.
    fn faults(&mut self) -> Faults {
        (0..self.random.random_range(1..=2))
            .map(|_| Fault::ALL[self.random.random_range(0..Fault::ALL.len())])
            .collect()
    }

    /// Mostly some ticks, sometimes up to 71 minutes.
    fn lateness(&mut self) -> u32 {
        let most = if self.random.random_range(0..100) == 0 { u32::MAX } else { 20_000 };
        self.random.random_range(0..=most)
    }

    /// Any target: mostly inside the range, sometimes anywhere in the format.
    fn target(&mut self) -> Volts {
        match self.random.random_range(0..10) {
            0 => Volts(Signal::from_bits(self.random.random())),
            1 => Volts::ZERO,
            2 => Volts(Signal::from_num(self.highest_v)),
            _ => Volts(Signal::from_num(self.random.random_range(0.0..self.highest_v))),
        }
    }

    /// Monitors that agree with the output, within a volt, or show anything.
    fn monitors(&mut self, wrong: bool) -> Option<Monitors> {
        if wrong {
            let voltage = Volts(Signal::from_bits(self.random.random()));
            return Some(Monitors { voltage, current_ua: self.random.random(), supply_mv: Some(self.random.random()) });
        }
        Some(Monitors { voltage: self.applied, current_ua: 0, supply_mv: Some(3300) })
    }

    fn reading(&mut self, noise: i32) -> Option<Volts> {
        match self.phase.reading {
            Readings::None => None,
            Readings::Good(offset) => {
                let bits = self.stiffness.to_bits().saturating_add(offset).saturating_add(noise);
                Some(Volts(Signal::from_bits(bits)))
            }
            Readings::Stuck(at) => Some(Volts(at)),
            Readings::Wild => Some(Volts(Signal::from_bits(noise.wrapping_shl(12)))),
        }
    }
}
