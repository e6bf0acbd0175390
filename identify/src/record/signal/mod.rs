//! Signals along the chain from command to stiffness.
//!
//! A [`Signal`] consists of straight [`Piece`]s with jumps between them; every row of the record is at the start of a piece.
//! Every block of the chain maps one signal to another. A [`Lag`] is solved exactly for a straight piece. Its output over that
//! piece is then taken as straight by the next block, so pieces are short where outputs are curved (`command`).

mod command;
mod lag;
mod oscillator;
mod piecewise;

pub use lag::{DECAYED, Lag, pass_lags};
pub use oscillator::Oscillator;
pub use piecewise::{Piece, Signal};
