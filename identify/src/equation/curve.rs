//! Static curves without memory; each maps 0 V to 0 V.

/// A static curve of one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curve {
    /// `x + a x (|x| / full scale - 1)`.
    Square,
    /// `x + a x ((x / full scale)^2 - 1)`.
    Cube,
    /// `x + a (x^2 / full scale - x)`: an even part.
    Even,
    /// `full scale sign(x) |x / full scale|^p`.
    Power,
    /// `full scale tanh(k x / full scale) / tanh(k)`.
    Tanh,
    /// `x`, at most `limit` in magnitude.
    Limit,
    /// `x`, at least `floor`.
    Floor,
    /// `sign(x) max(|x| - threshold, 0)`.
    DeadBand,
}

impl Curve {
    /// All curves that a search tries.
    pub const ALL: [Self; 8] =
        [Self::Square, Self::Cube, Self::Even, Self::Power, Self::Tanh, Self::Limit, Self::Floor, Self::DeadBand];

    /// Returns the value of the curve at `x` V for its parameter, with the full scale in V.
    pub fn at(self, x: f64, parameter: f64, full_v: f64) -> f64 {
        let part = x / full_v;
        match self {
            Self::Square => x + parameter * x * (part.abs() - 1.0),
            Self::Cube => x + parameter * x * (part * part - 1.0),
            Self::Even => x + parameter * (x * part - x),
            Self::Power => full_v * part.signum() * part.abs().powf(parameter),
            Self::Tanh => full_v * (parameter * part).tanh() / parameter.tanh(),
            Self::Limit => x.clamp(-parameter, parameter),
            Self::Floor => x.max(parameter),
            Self::DeadBand => x.signum() * (x.abs() - parameter).max(0.0),
        }
    }
}
