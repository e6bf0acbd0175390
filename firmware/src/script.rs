//! Runs of the emulated firmware, the same on the host and on the target: integer arithmetic only.
//!
//! | name | what it is |
//! | --- | --- |
//! | `stair` | the report's stair: 70 s, from 20 s on every 10 s up by 100 V in 0.1 s |
//! | `up-down` | 95 s: every 10 s up by 100 V to 500 V, then down to 100 V; the emulated board has a spring at its amplifier port |
//! | `up-down fast` | the same under the time-optimal controller, in an image that has it (feature `fast`) |
//! | `up-down sensor`, `up-down fast sensor` | the same with the spring's readings in the loop (feature `feedback`) |
//! | `random SEED` | 100 000 ticks of arming, disarming, target jumps, an interlock that opens, a host that falls silent |
//! | `panic`, `hard-fault`, `stack-overflow`, `float-overflow`, `stall`, `hang`, `deaf`, `overrun`, `interlock`, `silence` | fault drills |
//! | (after a reset by a fault) | the aftermath: nothing may leave until the fault is acknowledged |

use model::supervisor::Command;
use model::{Settings, Volts};

use crate::control::Orders;
use crate::settings::{LEADERS, Leader, SETTINGS};

/// Ticks of the stair, 70 s.
pub const STAIR_TICKS: u32 = 70_000;
/// Ticks of the way up and down, 95 s.
pub const UP_DOWN_TICKS: u32 = 95_000;
/// Ticks of a random run, 100 s.
pub const RANDOM_TICKS: u32 = 100_000;
/// When a drill arms.
pub const ARM_TICK: u32 = 10;
/// When a drill's mishap happens.
pub const MISHAP_TICK: u32 = 300;

/// What goes wrong in a drill.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mishap {
    /// The control task panics.
    Panic,
    /// The control task reads an address without memory.
    HardFault,
    /// The control task uses up its stack.
    StackOverflow,
    /// The same with float registers in use, which the processor means to save on that stack.
    FloatOverflow,
    /// The housekeeping task stops for ever.
    Stall,
    /// The control task itself stops for ever.
    Hang,
    /// The same with interrupts off.
    Deaf,
    /// The control task takes 8 ms once.
    Overrun,
    /// The interlock opens for 50 ms.
    Interlock,
    /// The host says no more.
    Silence,
}

impl Mishap {
    /// Every drill.
    pub const ALL: [Self; 10] = [
        Self::Panic,
        Self::HardFault,
        Self::StackOverflow,
        Self::FloatOverflow,
        Self::Stall,
        Self::Hang,
        Self::Deaf,
        Self::Overrun,
        Self::Interlock,
        Self::Silence,
    ];

    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::HardFault => "hard-fault",
            Self::StackOverflow => "stack-overflow",
            Self::FloatOverflow => "float-overflow",
            Self::Stall => "stall",
            Self::Hang => "hang",
            Self::Deaf => "deaf",
            Self::Overrun => "overrun",
            Self::Interlock => "interlock",
            Self::Silence => "silence",
        }
    }
}

/// What one tick of a run is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// From the host.
    pub orders: Orders,
    /// Of the safety circuit.
    pub interlock_closed: bool,
    /// To be acted out.
    pub mishap: Option<Mishap>,
}

/// A run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Script {
    /// See the module.
    Stair,
    /// See the module.
    UpDown(&'static Leader),
    /// See the module.
    Random(Random),
    /// See the module.
    Drill(Mishap),
    /// See the module.
    Aftermath,
}

impl Script {
    /// A random run.
    pub const fn random(seed: u32) -> Self {
        // Zero is the one state that this generator never leaves.
        Self::Random(Random { bits: if seed == 0 { 1 } else { seed }, open_until: 0, silent_until: 0 })
    }

    /// Reads the name of a run.
    pub fn parse(name: &str) -> Option<Self> {
        let name = name.trim();
        if name == "stair" {
            return Some(Self::Stair);
        }
        if let Some(leader) = LEADERS.iter().find(|leader| leader.run == name) {
            return Some(Self::UpDown(leader));
        }
        if let Some(seed) = name.strip_prefix("random ") {
            return seed.parse().ok().map(Self::random);
        }
        Mishap::ALL.into_iter().find(|mishap| mishap.name() == name).map(Self::Drill)
    }

    /// Spring and controller that it is played with.
    pub const fn settings(&self) -> &'static Settings {
        match self {
            Self::UpDown(leader) => leader.settings,
            Self::Stair | Self::Random(_) | Self::Drill(_) | Self::Aftermath => &SETTINGS,
        }
    }

    /// How many ticks it has.
    pub const fn ticks(&self) -> u32 {
        match self {
            Self::Stair => STAIR_TICKS,
            Self::UpDown(_) => UP_DOWN_TICKS,
            Self::Random(_) => RANDOM_TICKS,
            Self::Drill(_) => 1500,
            Self::Aftermath => 200,
        }
    }

    /// What tick `tick` is given; `None` after the last one. Ticks are asked for in order.
    pub fn step(&mut self, tick: u32) -> Option<Step> {
        if tick >= self.ticks() {
            return None;
        }
        Some(match self {
            Self::Stair => calm(arm_at(tick, 0), stair_v(tick)),
            Self::UpDown(_) => calm(arm_at(tick, 0), up_down_v(tick)),
            Self::Random(random) => random.step(tick),
            Self::Drill(mishap) => drill(*mishap, tick),
            Self::Aftermath => calm(aftermath(tick), 300),
        })
    }
}

/// The stair: a volt a tick on its ramps.
fn stair_v(tick: u32) -> i32 {
    let starts: [u32; 5] = [20_000, 30_000, 40_000, 50_000, 60_000];
    starts.iter().map(|start| tick.saturating_sub(*start).min(100) as i32).sum()
}

/// Up and down: from 5 s on every 10 s, a volt a tick on its ramps.
pub fn up_down_v(tick: u32) -> i32 {
    let risen = |step: u32| tick.saturating_sub(5_000 + step * 10_000).min(100) as i32;
    (0..5).map(risen).sum::<i32>() - (5..9).map(risen).sum::<i32>()
}

fn volts(volts: i32) -> Volts {
    Volts(model::units::Signal::from_bits(volts << 20))
}

fn arm_at(tick: u32, at: u32) -> Option<Command> {
    (tick == at).then_some(Command::Arm)
}

fn calm(command: Option<Command>, target_v: i32) -> Step {
    Step {
        orders: Orders { heard: true, command, target: Some(volts(target_v)) },
        interlock_closed: true,
        mishap: None,
    }
}

/// Armed at 10 ms with 300 V; what can be acknowledged is acknowledged at 1.2 s and armed again at 1.3 s.
fn drill(mishap: Mishap, tick: u32) -> Step {
    let command = match tick {
        ARM_TICK | 1300 => Some(Command::Arm),
        1200 => Some(Command::Disarm),
        _ => None,
    };
    let mut step = calm(command, 300);
    match mishap {
        Mishap::Interlock => step.interlock_closed = !(MISHAP_TICK..MISHAP_TICK + 50).contains(&tick),
        Mishap::Silence if tick >= MISHAP_TICK => step.orders = Orders::default(),
        _ => step.mishap = (tick == MISHAP_TICK).then_some(mishap),
    }
    step
}

/// Arming is tried in vain, then the fault is acknowledged; nobody arms after that.
fn aftermath(tick: u32) -> Option<Command> {
    match tick {
        50 | 100 => Some(Command::Arm),
        150 => Some(Command::Disarm),
        _ => None,
    }
}

/// Random orders, from a xorshift generator (Marsaglia, 13-17-5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Random {
    bits: u32,
    open_until: u32,
    silent_until: u32,
}

impl Random {
    fn step(&mut self, tick: u32) -> Step {
        // All drawn in every tick, so that the sequence does not depend on what they are used for.
        let (event, value) = (self.draw() >> 16, self.draw());
        let mut command = None;
        let mut target = None;
        match event {
            0..512 => command = Some(Command::Arm),
            512..544 => command = Some(Command::Disarm),
            // -32 to 991 V: beyond the range of 700 V on both sides.
            544..1056 => target = Some(Volts(model::units::Signal::from_bits((value >> 2) as i32 - (32 << 20)))),
            1056..1064 => self.open_until = tick + 1 + (value >> 26),
            1064..1072 => self.silent_until = tick + (value >> 21),
            _ => {}
        }
        let heard = tick >= self.silent_until;
        Step {
            orders: if heard { Orders { heard, command, target } } else { Orders::default() },
            interlock_closed: tick >= self.open_until,
            mishap: None,
        }
    }

    fn draw(&mut self) -> u32 {
        self.bits ^= self.bits << 13;
        self.bits ^= self.bits >> 17;
        self.bits ^= self.bits << 5;
        self.bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_to_scripts() {
        assert_eq!(Script::parse("stair"), Some(Script::Stair));
        assert_eq!(Script::parse("up-down"), Some(Script::UpDown(&LEADERS[0])));
        assert_eq!(Script::parse("up-down fast").is_some(), cfg!(feature = "fast"));
        assert_eq!(Script::parse("up-down sensor").is_some(), cfg!(feature = "feedback"));
        assert_eq!(Script::parse("random 7"), Some(Script::random(7)));
        assert_eq!(Script::parse("stall\n"), Some(Script::Drill(Mishap::Stall)));
        assert_eq!((Script::parse("random"), Script::parse("")), (None, None));
    }

    #[test]
    fn the_stair_has_five_ramps_of_a_tenth_of_a_second() {
        for (tick, volts) in [(0, 0), (20_000, 0), (20_050, 50), (20_100, 100), (45_000, 300), (69_999, 500)] {
            assert_eq!(stair_v(tick), volts, "{tick}");
        }
    }

    #[test]
    fn up_goes_down_again() {
        let seen = [0, 5_000, 5_050, 14_999, 50_000, 55_050, 60_000, 85_050, 85_100, 94_999].map(up_down_v);
        assert_eq!(seen, [0, 0, 50, 100, 500, 450, 400, 150, 100, 100]);
    }
}
