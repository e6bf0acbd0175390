//! Hysteresis in proportion to the voltage: friction under a load that grows with it, or a gain of its own for each direction.
//!
//! ```text
//! f = u (1 + part d),        d = 1 since the last rise, -1 since the last fall
//! ```
//!
//! Unlike a play, it has no width to cross: every reversal changes the branch.

/// The element and its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadFriction {
    /// Half the difference of the two gains, -1 to 1; 0 for none.
    pub part: f64,
    last: f64,
    direction: f64,
}

impl LoadFriction {
    /// Returns an element that no voltage has moved yet.
    pub fn new(part: f64) -> Self {
        Self { part, last: 0.0, direction: 1.0 }
    }

    /// Returns true if the element is the identity.
    pub fn is_none(&self) -> bool {
        self.part == 0.0
    }

    /// Returns the output when the input moves monotonically to `voltage`, both in V.
    pub fn at(&mut self, voltage: f64) -> f64 {
        if voltage != self.last {
            self.direction = (voltage - self.last).signum();
            self.last = voltage;
        }
        voltage * (1.0 + self.part * self.direction)
    }

    /// Returns the largest distance along the voltage axis between the branches of a slow loop from 0 to `top`, in V.
    pub fn width(&self, top: f64) -> f64 {
        let part = self.part.abs();
        2.0 * part * top / (1.0 + part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_differ_in_proportion_to_the_voltage() {
        let mut friction = LoadFriction::new(0.1);
        let mut last = |voltages: &[f64]| voltages.iter().map(|&voltage| friction.at(voltage)).last().unwrap();
        assert!((last(&[0.0, 100.0, 300.0, 300.0]) - 330.0).abs() < 1e-9);
        assert!((last(&[299.0]) - 0.9 * 299.0).abs() < 1e-9);
        assert!((last(&[500.0, 100.0]) - 90.0).abs() < 1e-9);
        // Equal outputs of both branches: 450 V of 500 V down and of 409 V up.
        assert!((LoadFriction::new(-0.1).width(500.0) - (500.0 - 450.0 / 1.1)).abs() < 1e-9);
    }
}
