//! Circuits of resistors, capacitors and voltage sources, solved by modified nodal analysis.
//!
//! A capacitor whose capacitance changes keeps its charge `q = C(t) v`. Within a step of length `h` it is a resistor `h
//! / (2 C)` in parallel with a current source (trapezoidal rule on the charge); the currents of the sources are
//! unknowns (modified nodal analysis, Ho, Ruehli and Brennan 1975).

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};

/// A component between two nodes; node 0 is ground.
pub enum Component<'a> {
    /// A resistance, in ohm.
    Resistor(usize, usize, f64),
    /// A capacitance, in F, as a function of the time in s.
    Capacitor(usize, usize, &'a dyn Fn(f64) -> f64),
    /// A voltage of the first node above the second, in V.
    Source(usize, usize, f64),
}

/// A circuit and its state.
pub struct Circuit<'a> {
    components: Vec<Component<'a>>,
    nodes: usize,
    /// Charge (C) and current (A) of each component at the last time; only capacitors have a charge.
    charge: Vec<f64>,
    current: Vec<f64>,
}

impl<'a> Circuit<'a> {
    /// Creates a circuit from its components and their initial charges in C; call [`Circuit::find_currents`] before the
    /// first step.
    pub fn new(components: Vec<Component<'a>>, charge: Vec<f64>) -> Self {
        let ends = |component: &Component<'_>| match *component {
            Component::Resistor(a, b, _) | Component::Capacitor(a, b, _) | Component::Source(a, b, _) => a.max(b),
        };
        let nodes = components.iter().map(ends).max().unwrap_or(0);
        let current = vec![0.0; components.len()];
        Self { components, nodes, charge, current }
    }

    /// Charge of a component, in C, by its index.
    pub fn charge(&self, component: usize) -> f64 {
        self.charge[component]
    }

    /// Current through a component, in A, from its first to its second node.
    pub fn current(&self, component: usize) -> f64 {
        self.current[component]
    }

    /// Finds the currents at a time in s by a trial step of `h` seconds that is undone.
    ///
    /// # Errors
    /// If the circuit has no unique solution.
    pub fn find_currents(&mut self, time_s: f64, h: f64) -> Result<()> {
        let charge = self.charge.clone();
        self.step(time_s, h, true)?;
        self.charge = charge;
        Ok(())
    }

    /// Advances by `h` seconds to `time_s`. `implicit` selects backward Euler, needed after a jump, instead of the
    /// trapezoidal rule.
    ///
    /// # Errors
    /// If the circuit has no unique solution.
    pub fn step(&mut self, time_s: f64, h: f64, implicit: bool) -> Result<()> {
        let now = if implicit { 1.0 } else { 0.5 };
        let sources = self.components.iter().filter(|component| matches!(component, Component::Source(..))).count();
        let size = self.nodes + sources;
        let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let mut source = self.nodes;
        for (index, component) in self.components.iter().enumerate() {
            match component {
                Component::Resistor(a, b, ohm) => conduct(&mut matrix, *a, *b, 1.0 / ohm),
                Component::Capacitor(a, b, farad) => {
                    // C v = charge + h (now i + (1 - now) i at the last time).
                    conduct(&mut matrix, *a, *b, farad(time_s) / (now * h));
                    let pushed = (self.charge[index] + h * (1.0 - now) * self.current[index]) / (now * h);
                    for (node, sign) in [(*a, 1.0), (*b, -1.0)] {
                        if node > 0 {
                            right[node - 1] += sign * pushed;
                        }
                    }
                }
                Component::Source(a, b, volt) => {
                    for (node, sign) in [(*a, 1.0), (*b, -1.0)] {
                        if node > 0 {
                            matrix[(node - 1, source)] += sign;
                            matrix[(source, node - 1)] += sign;
                        }
                    }
                    right[source] = *volt;
                    source += 1;
                }
            }
        }
        let solved = matrix.lu().solve(&right).context("the circuit has no unique solution")?;
        let volts = |node: usize| if node > 0 { solved[node - 1] } else { 0.0 };
        let mut source = self.nodes;
        for (index, component) in self.components.iter().enumerate() {
            self.current[index] = match component {
                Component::Resistor(a, b, ohm) => (volts(*a) - volts(*b)) / ohm,
                Component::Capacitor(a, b, farad) => {
                    let charge = farad(time_s) * (volts(*a) - volts(*b));
                    let moved = (charge - self.charge[index]) / h - (1.0 - now) * self.current[index];
                    self.charge[index] = charge;
                    moved / now
                }
                Component::Source(..) => {
                    source += 1;
                    solved[source - 1]
                }
            };
        }
        Ok(())
    }
}

/// Adds a conductance in siemens between two nodes.
fn conduct(matrix: &mut DMatrix<f64>, a: usize, b: usize, siemens: f64) {
    for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
        if row > 0 && column > 0 {
            matrix[(row - 1, column - 1)] += sign * siemens;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divider_splits_the_voltage() {
        let mut circuit = Circuit::new(
            vec![Component::Source(1, 0, 6.0), Component::Resistor(1, 2, 1.0), Component::Resistor(2, 0, 2.0)],
            vec![0.0; 3],
        );
        circuit.step(1.0, 1.0, true).unwrap();
        assert!((circuit.current(1) - 2.0).abs() < 1e-12 && (circuit.current(0) + 2.0).abs() < 1e-12);
    }

    /// 1 V, 2 ohm, 3 F: the charge is 3 (1 - e^(-t/6)); the error is of second order in the step.
    #[test]
    fn charging_converges_with_the_square_of_the_step() {
        let error = |steps: usize| {
            let farad = |_: f64| 3.0;
            let parts =
                vec![Component::Source(1, 0, 1.0), Component::Resistor(1, 2, 2.0), Component::Capacitor(2, 0, &farad)];
            let mut circuit = Circuit::new(parts, vec![0.0; 3]);
            let h = 6.0 / steps as f64;
            circuit.find_currents(0.0, 1e-6).unwrap();
            for step in 1..=steps {
                circuit.step(h * step as f64, h, false).unwrap();
            }
            (circuit.charge(2) - 3.0 * (1.0 - (-1.0f64).exp())).abs()
        };
        assert!(error(100) < 1e-5 && error(200) < 0.3 * error(100), "{} {}", error(100), error(200));
    }
}
