//! The faults and their stable numbers.

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
    /// The settings were rejected.
    Config = 7,
    /// The supply voltage dipped and reset the chip.
    Supply = 8,
}

impl Fault {
    pub(super) const ALL: [Self; 8] = [
        Self::Panic,
        Self::HardFault,
        Self::Overrun,
        Self::Interlock,
        Self::Watchdog,
        Self::Monitor,
        Self::Config,
        Self::Supply,
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
        }
    }

    /// Returns the fault with this number; `None` for zero and unknown numbers.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.code() == code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_stable_and_convert_back_to_their_faults() {
        for fault in Fault::ALL {
            assert_eq!(Fault::from_code(fault.code()), Some(fault));
        }
        assert_eq!((Fault::from_code(0), Fault::from_code(9)), (None, None));
        assert_eq!(Fault::ALL.map(Fault::code), [1, 2, 3, 4, 5, 6, 7, 8], "these numbers must not change");
    }
}
