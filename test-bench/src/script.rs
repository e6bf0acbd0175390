//! Scripts of the runs on host and target, in integer arithmetic only.
//!
//! | name | content |
//! | --- | --- |
//! | `stair` | The source report's stair: 70 s, from 20 s on a rise of 100 V in 0.1 s every 10 s. |
//! | `up-down` | 95 s: steps of 100 V every 10 s, up to 500 V and down to 100 V, with a simulated spring at the board's amplifier port. |
//! | `up-down fast` | `up-down` with the time-optimal controller (feature `fast`). |
//! | `up-down robust` | `up-down` with the controller for a spring that is known to within errors (feature `robust`). |
//! | `up-down sensor`, `up-down fast sensor`, `up-down robust sensor` | These runs with the spring's readings in the loop (feature `feedback`). |
//! | `random SEED` | 100 000 ticks with random arming, disarming, targets, interlock openings and silences of the host. |
//! | `hour SEED` | An hour of the same. |
//! | `late SEED` | The random run on a board that has run for weeks: the low 32 bits of its ticks wrap in the middle of the run. |
//! | `panic`, `hard-fault`, `stack-overflow`, `float-overflow`, `stall`, `hang`, `deaf`, `overrun`, `interlock`, `two-faults`, `silence`, `unguarded` | Drills: one injected fault each (`two-faults`: two), see [`FaultInjection`]. |
//! | (after a reset by a fault) | The output must stay disabled until the fault is acknowledged. |

#[cfg(feature = "fast")]
use firmware::settings::FAST;
#[cfg(feature = "robust")]
use firmware::settings::ROBUST;
use firmware::settings::SETTINGS;
#[cfg(feature = "feedback")]
use firmware::settings::with_sensor;
use link::Command;
use model::{Settings, Volts, supervisor};
use random_numbers::Xorshift32;

/// Number of ticks of the stair, 70 s.
pub const STAIR_TICKS: u32 = 70_000;
/// Number of ticks of an `up-down` run, 95 s.
pub const UP_DOWN_TICKS: u32 = 95_000;
/// Number of ticks of a random run, 100 s.
pub const RANDOM_TICKS: u32 = 100_000;
/// Number of ticks of an hour.
pub const HOUR_TICKS: u32 = 3_600_000;
/// Tick in which a drill arms.
pub const ARM_TICK: u32 = 10;
/// Tick in which a drill injects its fault.
pub const FAULT_TICK: u32 = 300;

/// Controllers of the `up-down` runs in this image.
pub static CONTROLLERS: &[Controller] = &[
    Controller { run: "up-down", settings: &SETTINGS },
    #[cfg(feature = "fast")]
    Controller { run: "up-down fast", settings: &FAST },
    #[cfg(feature = "robust")]
    Controller { run: "up-down robust", settings: &ROBUST },
    #[cfg(feature = "feedback")]
    Controller { run: "up-down sensor", settings: &const { with_sensor(SETTINGS) } },
    #[cfg(all(feature = "fast", feature = "feedback"))]
    Controller { run: "up-down fast sensor", settings: &const { with_sensor(FAST) } },
    #[cfg(all(feature = "robust", feature = "feedback"))]
    Controller { run: "up-down robust sensor", settings: &const { with_sensor(ROBUST) } },
];

/// Controller of an `up-down` run.
#[derive(Debug, PartialEq)]
pub struct Controller {
    /// Name of the run.
    pub run: &'static str,
    /// Settings from which the controller is built.
    pub settings: &'static Settings,
}

/// Fault that a drill injects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultInjection {
    /// The control task panics.
    Panic,
    /// The control task reads an address without memory.
    HardFault,
    /// The control task uses up its stack.
    StackOverflow,
    /// The control task uses up its stack while its float registers have still to be saved on it.
    FloatOverflow,
    /// The housekeeping task stops.
    Stall,
    /// The control task stops.
    Hang,
    /// The control task stops with interrupts off.
    Deaf,
    /// One control tick takes 8 ms.
    Overrun,
    /// The interlock opens for 50 ms.
    Interlock,
    /// The interlock opens for 950 ms, in a tick before which others were missed.
    TwoFaults,
    /// The host falls silent.
    Silence,
    /// Before the first tick: the guards against stack overflows and hangs cannot be set up.
    Unguarded,
}

impl FaultInjection {
    /// Every injected fault.
    pub const ALL: [Self; 12] = [
        Self::Panic,
        Self::HardFault,
        Self::StackOverflow,
        Self::FloatOverflow,
        Self::Stall,
        Self::Hang,
        Self::Deaf,
        Self::Overrun,
        Self::Interlock,
        Self::TwoFaults,
        Self::Silence,
        Self::Unguarded,
    ];

    /// Name of the drill on the command line.
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
            Self::TwoFaults => "two-faults",
            Self::Silence => "silence",
            Self::Unguarded => "unguarded",
        }
    }
}

/// Inputs of one tick of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// Command of the host.
    pub command: Command,
    /// True if the safety circuit is closed.
    pub interlock_closed: bool,
    /// Fault to be injected before the tick.
    pub fault: Option<FaultInjection>,
}

/// Script of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Script {
    /// Run `stair`.
    Stair,
    /// Run `up-down` with this controller.
    UpDown(&'static Controller),
    /// Run `random`, `hour` or `late`.
    Random(Random),
    /// Drill with this fault.
    Drill(FaultInjection),
    /// Run after a reset by a fault.
    Aftermath,
}

impl Script {
    /// The random run with this seed.
    pub const fn random(seed: u32) -> Self {
        Self::random_ticks(seed, RANDOM_TICKS)
    }

    /// The random run with this seed that lasts for an hour.
    pub const fn hour(seed: u32) -> Self {
        Self::random_ticks(seed, HOUR_TICKS)
    }

    /// The random run with this seed on a board that has run for 49.7 days.
    pub const fn late(seed: u32) -> Self {
        Self::Random(Random { first_tick: (1 << 32) - (RANDOM_TICKS / 2) as u64, ..Random::new(seed, RANDOM_TICKS) })
    }

    const fn random_ticks(seed: u32, ticks: u32) -> Self {
        Self::Random(Random::new(seed, ticks))
    }

    /// The script with this name, see the table of this module; `None` if there is none.
    pub fn parse(name: &str) -> Option<Self> {
        let name = name.trim_ascii();
        if name == "stair" {
            return Some(Self::Stair);
        }
        if let Some(controller) = CONTROLLERS.iter().find(|controller| controller.run == name) {
            return Some(Self::UpDown(controller));
        }
        if let Some(seed) = name.strip_prefix("random ") {
            return seed.parse().ok().map(Self::random);
        }
        if let Some(seed) = name.strip_prefix("hour ") {
            return seed.parse().ok().map(Self::hour);
        }
        if let Some(seed) = name.strip_prefix("late ") {
            return seed.parse().ok().map(Self::late);
        }
        FaultInjection::ALL.into_iter().find(|fault| fault.name() == name).map(Self::Drill)
    }

    /// Settings of spring and controller.
    pub const fn settings(&self) -> &'static Settings {
        match self {
            Self::UpDown(controller) => controller.settings,
            Self::Stair | Self::Random(_) | Self::Drill(_) | Self::Aftermath => &SETTINGS,
        }
    }

    /// Number of ticks.
    pub const fn ticks(&self) -> u32 {
        match self {
            Self::Stair => STAIR_TICKS,
            Self::UpDown(_) => UP_DOWN_TICKS,
            Self::Random(random) => random.ticks,
            Self::Drill(_) => 1500,
            Self::Aftermath => 200,
        }
    }

    /// Number of ticks that the board has run before the first one of the script.
    pub const fn first_tick(&self) -> u64 {
        match self {
            Self::Random(random) => random.first_tick,
            Self::Stair | Self::UpDown(_) | Self::Drill(_) | Self::Aftermath => 0,
        }
    }

    /// Inputs of tick number `tick` of the script; `None` after the last one. Must be called for every tick in order.
    pub fn step(&mut self, tick: u32) -> Option<Step> {
        if tick >= self.ticks() {
            return None;
        }
        Some(match self {
            Self::Stair => nominal(arm_at(tick, 0), stair_v(tick)),
            Self::UpDown(_) => nominal(arm_at(tick, 0), up_down_v(tick)),
            Self::Random(random) => random.step(tick),
            Self::Drill(fault) => drill(*fault, tick),
            Self::Aftermath => nominal(aftermath(tick), 300),
        })
    }
}

/// Target of the stair, in V; its ramps rise by 1 V per tick.
fn stair_v(tick: u32) -> i32 {
    let starts: [u32; 5] = [20_000, 30_000, 40_000, 50_000, 60_000];
    starts.iter().map(|start| tick.saturating_sub(*start).min(100) as i32).sum()
}

/// Target of an `up-down` run, in V: a step every 10 s from 5 s on, with ramps of 1 V per tick.
pub fn up_down_v(tick: u32) -> i32 {
    let risen = |step: u32| tick.saturating_sub(5_000 + step * 10_000).min(100) as i32;
    (0..5).map(risen).sum::<i32>() - (5..9).map(risen).sum::<i32>()
}

fn volts(volts: i32) -> Volts {
    Volts(model::units::Signal::from_bits(volts << 20))
}

fn arm_at(tick: u32, at: u32) -> Option<supervisor::Command> {
    (tick == at).then_some(supervisor::Command::Arm)
}

fn nominal(arming: Option<supervisor::Command>, target_v: i32) -> Step {
    Step {
        command: Command { heard: true, arming, target: Some(volts(target_v)) },
        interlock_closed: true,
        fault: None,
    }
}

/// Inputs of a drill: armed at 10 ms with 300 V, the fault acknowledged at 1.2 s if possible, armed again at 1.3 s. Of two
/// faults the first one is acknowledged at 1.26 s, once the interlock is closed, and the second at 1.4 s.
fn drill(fault: FaultInjection, tick: u32) -> Step {
    let arming = match (tick, fault) {
        (ARM_TICK | 1300, _) | (1450, FaultInjection::TwoFaults) => Some(supervisor::Command::Arm),
        (1200, _) | (1260 | 1400, FaultInjection::TwoFaults) => Some(supervisor::Command::Disarm),
        _ => None,
    };
    let mut step = nominal(arming, 300);
    match fault {
        FaultInjection::Interlock => step.interlock_closed = !(FAULT_TICK..FAULT_TICK + 50).contains(&tick),
        FaultInjection::TwoFaults => {
            step.interlock_closed = !(FAULT_TICK..FAULT_TICK + 950).contains(&tick);
            step.fault = (tick + 1 == FAULT_TICK).then_some(fault);
        }
        FaultInjection::Silence if tick >= FAULT_TICK => step.command = Command::default(),
        _ => step.fault = (tick == FAULT_TICK).then_some(fault),
    }
    step
}

/// Transitions after a reset by a fault: two attempts to arm, which must be refused, then the acknowledgement.
fn aftermath(tick: u32) -> Option<supervisor::Command> {
    match tick {
        50 | 100 => Some(supervisor::Command::Arm),
        150 => Some(supervisor::Command::Disarm),
        _ => None,
    }
}

/// State of a random run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Random {
    ticks: u32,
    first_tick: u64,
    numbers: Xorshift32,
    open_until: u32,
    silent_until: u32,
}

impl Random {
    const fn new(seed: u32, ticks: u32) -> Self {
        Self { ticks, first_tick: 0, numbers: Xorshift32::new(seed), open_until: 0, silent_until: 0 }
    }

    fn step(&mut self, tick: u32) -> Step {
        // Both numbers are drawn in every tick, so that the sequence does not depend on their use.
        let (event, value) = (self.numbers.draw() >> 16, self.numbers.draw());
        let mut arming = None;
        let mut target = None;
        match event {
            0..512 => arming = Some(supervisor::Command::Arm),
            512..544 => arming = Some(supervisor::Command::Disarm),
            // -32 to 991 V exceeds the range of 0 to 700 V at both ends.
            544..1056 => target = Some(Volts(model::units::Signal::from_bits((value >> 2) as i32 - (32 << 20)))),
            1056..1064 => self.open_until = tick + 1 + (value >> 26),
            1064..1072 => self.silent_until = tick + (value >> 21),
            _ => {}
        }
        let heard = tick >= self.silent_until;
        Step {
            command: if heard { Command { heard, arming, target } } else { Command::default() },
            interlock_closed: tick >= self.open_until,
            fault: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_parsed_into_scripts() {
        assert_eq!(Script::parse("stair"), Some(Script::Stair));
        assert_eq!(Script::parse("up-down"), Some(Script::UpDown(&CONTROLLERS[0])));
        assert_eq!(Script::parse("up-down fast").is_some(), cfg!(feature = "fast"));
        assert_eq!(Script::parse("up-down robust").is_some(), cfg!(feature = "robust"));
        assert_eq!(Script::parse("up-down sensor").is_some(), cfg!(feature = "feedback"));
        assert_eq!(Script::parse("random 7"), Some(Script::random(7)));
        assert_eq!(Script::parse("hour 7"), Some(Script::hour(7)));
        assert_eq!(Script::parse("stall\n"), Some(Script::Drill(FaultInjection::Stall)));
        assert_eq!(Script::parse("late 7"), Some(Script::late(7)));
        assert_eq!(["random", "hour", "hour x", ""].map(Script::parse), [None; 4]);
    }

    #[test]
    fn the_stair_has_five_ramps_of_a_tenth_of_a_second() {
        for (tick, volts) in [(0, 0), (20_000, 0), (20_050, 50), (20_100, 100), (45_000, 300), (69_999, 500)] {
            assert_eq!(stair_v(tick), volts, "{tick}");
        }
    }

    #[test]
    fn the_up_down_target_rises_to_500_v_and_falls_to_100_v() {
        let seen = [0, 5_000, 5_050, 14_999, 50_000, 55_050, 60_000, 85_050, 85_100, 94_999].map(up_down_v);
        assert_eq!(seen, [0, 0, 50, 100, 500, 450, 400, 150, 100, 100]);
    }
}
