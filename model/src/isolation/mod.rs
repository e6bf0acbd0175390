//! Fault isolation in the tick.

pub mod bank;
mod cause;
mod settings;
pub mod thresholds;

pub use cause::Cause;
pub use settings::Settings;

/// What the bank says of the spring and its sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verdict {
    /// The readings agree with the model.
    #[default]
    Quiet,
    /// They do not, and the cause is not known yet.
    Alarm,
    /// One cause explains them, and no other does.
    Named(Cause),
    /// At least these two explain them; the first leaves least.
    Ambiguous(Cause, Cause),
    /// No cause of the bank explains them.
    Unknown,
}
