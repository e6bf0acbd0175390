//! The faults, their stable numbers, and sets of them.

/// Reason for which the output was disabled. The numbers are used in logs, in frames and after a reset, and never
/// change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// The program panicked.
    Panic = 1,
    /// The processor raised a hard fault.
    HardFault = 2,
    /// Too many ticks were missed.
    Overrun = 3,
    /// The interlock opened.
    Interlock = 4,
    /// A task did not check in, or the watchdog reset the chip.
    Watchdog = 5,
    /// The amplifier's monitors disagree with the output.
    Monitor = 6,
    /// Settings or model were rejected or damaged, or the processor's guards could not be set up.
    Config = 7,
    /// The supply voltage dipped and reset the chip.
    Supply = 8,
    /// A test at the start failed: the RAM, or the processor's clock.
    SelfTest = 9,
    /// The isolation bank has named a cause for which a setting demands a fault.
    Isolation = 10,
}

impl Fault {
    /// Every fault, in the order of the numbers.
    pub const ALL: [Self; 10] = [
        Self::Panic,
        Self::HardFault,
        Self::Overrun,
        Self::Interlock,
        Self::Watchdog,
        Self::Monitor,
        Self::Config,
        Self::Supply,
        Self::SelfTest,
        Self::Isolation,
    ];

    /// Returns the stable number, 1 to 255; zero stands for no fault.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Returns the stable lower-case name for logs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::HardFault => "hard-fault",
            Self::Overrun => "overrun",
            Self::Interlock => "interlock",
            Self::Watchdog => "watchdog",
            Self::Monitor => "monitor",
            Self::Config => "config",
            Self::Supply => "supply",
            Self::SelfTest => "self-test",
            Self::Isolation => "isolation",
        }
    }

    /// Returns what detects the fault, for documents and displays.
    pub const fn detection(self) -> &'static str {
        match self {
            Self::Panic => "the program's own checks",
            Self::HardFault => "the processor: a bad access, a stack overflow, a word of flash with two wrong bits",
            Self::Overrun => "the supervisor: more missed ticks than tolerated",
            Self::Interlock => "the supervisor: the safety circuit is open",
            Self::Watchdog => "the hang guard, the task watchdog or the chip's watchdog",
            Self::Monitor => "the supervisor: voltage, current or the converters' supply disagree with the output",
            Self::Config => "the start: rejected or damaged settings or model, no guards",
            Self::Supply => {
                "the chip's brown-out reset, or a reset from outside while armed, with RAM that has kept its content"
            }
            Self::SelfTest => "the start: a word of the RAM, or the processor's clock compared with the watchdog's",
            Self::Isolation => "the isolation bank: it has named a cause of the setting trip_on_cause",
        }
    }

    /// Returns what a person does about the fault before it is acknowledged.
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::Panic => "read the location in the log and report it",
            Self::HardFault => "read the log; flash the image again, and replace a chip that repeats it",
            Self::Overrun => "wait for a second without a missed tick; if it comes again, stream less telemetry",
            Self::Interlock => "close the safety circuit",
            Self::Watchdog => "read the log; restart the chip if a task still does not check in",
            Self::Monitor => "remove what the monitors name, and wait until the spring is discharged",
            Self::Config => "send another model or other settings, or flash an image with valid ones",
            Self::Supply => "check the supply, and let the spring settle",
            Self::Isolation => {
                "read the cause in the status or the log and remove it; the acknowledgement restarts the bank"
            }
            Self::SelfTest => "read the log, which names the part; restart the chip, and replace one that repeats it",
        }
    }

    /// Returns the fault with this number; `None` for zero and unknown numbers.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.code() == code)
    }
}

/// A set of faults: one bit for each, bit 0 for the number 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults(u16);

impl Faults {
    /// The empty set.
    pub const NONE: Self = Self(0);

    /// Returns the set of the faults that have a bit in `bits`; bits without a fault are dropped.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits & ((1 << Fault::ALL.len()) - 1))
    }

    /// Returns one bit for each fault of the set.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Returns the set with `fault` in it.
    pub const fn with(self, fault: Fault) -> Self {
        Self(self.0 | Self::bit(fault))
    }

    /// Returns the faults of both sets.
    pub const fn and(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Returns the set without `fault`.
    pub const fn without(self, fault: Fault) -> Self {
        Self(self.0 & !Self::bit(fault))
    }

    /// Returns the faults of the set that are not in `others`.
    pub const fn except(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Returns true if `fault` is in the set.
    pub const fn contains(self, fault: Fault) -> bool {
        self.0 & Self::bit(fault) != 0
    }

    /// Returns the faults of the set in the order of their numbers.
    pub fn iter(mut self) -> impl Iterator<Item = Fault> {
        core::iter::from_fn(move || {
            let first = self.first()?;
            self = self.without(first);
            Some(first)
        })
    }

    /// Returns the fault of the set with the lowest number; `None` if it is empty.
    #[inline]
    pub fn first(self) -> Option<Fault> {
        Fault::ALL.get(self.0.trailing_zeros() as usize).copied()
    }

    const fn bit(fault: Fault) -> u16 {
        1 << (fault.code() - 1)
    }
}

impl FromIterator<Fault> for Faults {
    fn from_iter<T: IntoIterator<Item = Fault>>(faults: T) -> Self {
        faults.into_iter().fold(Self::NONE, Self::with)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_put_into_it() {
        let both = Faults::NONE.with(Fault::Supply).with(Fault::Panic).with(Fault::Panic);
        assert!(both.iter().eq([Fault::Panic, Fault::Supply]));
        assert_eq!(both.bits(), 0x81);
        assert_eq!(Faults::from_bits(0xfc81), both, "bits without a fault are dropped");
        assert_eq!(both.without(Fault::Panic).without(Fault::Panic), Faults::from_bits(0x80));
        assert_eq!(Faults::from_bits(1).and(Faults::from_bits(0x80)), both);
        assert_eq!(both.except(Faults::NONE.with(Fault::Supply)), Faults::from_bits(1));
        assert!(both.contains(Fault::Supply) && !both.contains(Fault::Interlock));
        assert_eq!(Fault::ALL.into_iter().collect::<Faults>().iter().count(), Fault::ALL.len());
    }

    #[test]
    fn codes_are_stable_and_convert_back_to_their_faults() {
        for fault in Fault::ALL {
            assert_eq!(Fault::from_code(fault.code()), Some(fault));
        }
        assert_eq!((Fault::from_code(0), Fault::from_code(11)), (None, None));
        assert_eq!(Fault::ALL.map(Fault::code), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10], "these numbers must not change");
    }
}
