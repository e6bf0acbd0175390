//! Versions of the standard.

/// A version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

impl Version {
    /// Both versions.
    pub const ALL: [Self; 2] = [Self::Two, Self::Three];

    /// Number on the command line and in the names of files.
    pub const fn number(self) -> u32 {
        match self {
            Self::Two => 2,
            Self::Three => 3,
        }
    }
}
