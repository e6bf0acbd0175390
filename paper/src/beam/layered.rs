//! The stack as a layered beam with slip between its layers, by finite elements.
//!
//! Every layer is a beam; all share the deflection `w`, and each has its own axial displacement `u`. Two layers whose
//! midplanes are `d` apart slip by `s` and resist it with the shear stress `K s` (Newmark 1951 for two layers):
//!
//! ```text
//! U = 1/2 integral of  sum EA u'^2 + sum EI w''^2 + sum K b s^2  dx,   s = u(above) - u(below) + d w'
//! ```
//!
//! `K` = 0 lets the layers slide freely; a large `K` bonds them. In each element `w` is cubic and `u` quadratic, so `s`
//! can vanish exactly and a large `K` does not lock the element. Elements end where a layer ends; a layer resists slip
//! against the next layer present. Three Gauss points integrate the energy exactly.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};

use crate::beam::element::{GAUSS, Shapes};
use crate::beam::limits::section_ends;
use crate::beam::stack::Stack;
use simulation::bad_input::check;

/// Number of elements that gives the tip displacement of the report's spring to better than 0.01 %.
pub const ELEMENTS: usize = 24;

/// A stack bent by a force at its tip.
#[derive(Clone, Debug)]
pub struct Bent {
    /// Distance from the clamp and deflection of each node, in m.
    pub nodes: Vec<(f64, f64)>,
    /// Slip between the lowest layer and the next at each node, in m.
    pub slip_m: Vec<f64>,
    /// Elastic energy, in J.
    pub energy_j: f64,
}

impl Bent {
    /// Deflection of the tip, in m, positive in the direction of the force.
    pub fn tip_m(&self) -> f64 {
        self.nodes.last().map_or(0.0, |node| node.1)
    }
}

/// Interlayer stiffness that is equivalent to perfect bonding, in Pa/m.
pub const BONDED_PA_PER_M: f64 = 1e14;
/// Largest interlayer stiffness accepted, in Pa/m.
const STIFFEST_PA_PER_M: f64 = 1e18;

/// Bends a stack by the force `tip_n` (N) at its tip, with the interlayer stiffness `interlayer_pa_per_m` (`K`).
///
/// # Errors
/// [`simulation::bad_input::BadInput`] names the argument that is out of range.
pub fn bend(stack: &Stack, interlayer_pa_per_m: f64, tip_n: f64, elements: usize) -> Result<Bent> {
    check("interlayer_pa_per_m", interlayer_pa_per_m, 0.0..=STIFFEST_PA_PER_M, "Pa/m")?;
    check("tip_n", tip_n, -1e6..=1e6, "N")?;
    check("elements", elements as f64, 1.0..=200.0, "elements")?;
    let mesh = Mesh::new(stack, elements);
    let stiffness = mesh.stiffness(stack, interlayer_pa_per_m);
    let mut force = DVector::zeros(mesh.unknowns);
    force[mesh.deflection(mesh.x_m.len() - 1).context("the tip moves")?] = tip_n;
    // The unknowns differ in size by many decades: scale them so that each diagonal stiffness is 1.
    let unit = stiffness.diagonal().map(|stiffness| 1.0 / stiffness.sqrt());
    let scaled = DMatrix::from_fn(mesh.unknowns, mesh.unknowns, |i, j| stiffness[(i, j)] * unit[i] * unit[j]);
    let solved = scaled.cholesky().context("the stack does not hold")?.solve(&force.component_mul(&unit));
    let moved = solved.component_mul(&unit);

    let value = |index: Option<usize>| index.map_or(0.0, |index| moved[index]);
    let nodes = (0..mesh.x_m.len()).map(|node| (mesh.x_m[node], value(mesh.deflection(node)))).collect();
    let heights = stack.heights_m();
    let slip_m = (0..mesh.x_m.len())
        .map(|node| {
            let present: Vec<usize> =
                (0..heights.len()).filter(|&layer| mesh.axial[2 * node][layer].is_some()).collect();
            let [below, above, ..] = present[..] else { return 0.0 };
            let slope = value(mesh.deflection(node).map(|index| index + 1));
            let axial = |layer: usize| value(mesh.axial[2 * node][layer]);
            axial(above) - axial(below) + (heights[above] - heights[below]) * slope
        })
        .collect();
    Ok(Bent { nodes, slip_m, energy_j: 0.5 * moved.dot(&(&stiffness * &moved)) })
}

/// Spring constant at the tip, in N/m.
///
/// # Errors
/// Returns the errors of [`bend`].
pub fn spring_constant_n_per_m(stack: &Stack, interlayer_pa_per_m: f64, elements: usize) -> Result<f64> {
    Ok(1.0 / bend(stack, interlayer_pa_per_m, 1.0, elements)?.tip_m())
}

/// The nodes and the numbering of the unknowns.
struct Mesh {
    /// Distances of the nodes from the clamp, in m.
    x_m: Vec<f64>,
    /// Axial unknown of each layer at node 0, the middle of element 0, node 1, and so on; `None` if the layer is absent
    /// or clamped there.
    axial: Vec<Vec<Option<usize>>>,
    unknowns: usize,
}

impl Mesh {
    fn new(stack: &Stack, elements: usize) -> Self {
        let mut x_m = vec![0.0];
        for ends in section_ends(stack).windows(2) {
            let share = (ends[1] - ends[0]) / stack.length_m();
            let parts = (share * elements as f64).round().max(1.0);
            x_m.extend((1..=parts as usize).map(|part| ends[0] + (ends[1] - ends[0]) * part as f64 / parts));
        }
        // Two unknowns for the deflection of each node but the clamped one, then the axial ones.
        let mut unknowns = 2 * (x_m.len() - 1);
        let axial = (0..2 * x_m.len() - 1)
            .map(|place| {
                let x = 0.5 * (x_m[place / 2] + x_m[place.div_ceil(2)]);
                let number = |layer: &crate::beam::stack::Layer| {
                    // All layers are clamped at the first node; sums of lengths may exceed a layer's length by a
                    // rounding error.
                    (place > 0 && x <= layer.length_m * (1.0 + 1e-12)).then(|| {
                        unknowns += 1;
                        unknowns - 1
                    })
                };
                stack.layers().iter().map(number).collect()
            })
            .collect();
        Self { x_m, axial, unknowns }
    }

    /// Index of a node's deflection, `None` for the clamped node; its slope has the next index.
    fn deflection(&self, node: usize) -> Option<usize> {
        node.checked_sub(1).map(|free| 2 * free)
    }

    fn stiffness(&self, stack: &Stack, interlayer_pa_per_m: f64) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.unknowns, self.unknowns);
        let (layers, heights) = (stack.layers(), stack.heights_m());
        for element in 0..self.x_m.len() - 1 {
            let (from, to) = (self.x_m[element], self.x_m[element + 1]);
            let present: Vec<usize> =
                (0..layers.len()).filter(|&layer| layers[layer].length_m >= 0.5 * (from + to)).collect();
            for (place, weight) in GAUSS {
                let shapes = Shapes::at(place, to - from);
                let weight = weight * (to - from);
                let bending: f64 = present.iter().map(|&layer| layers[layer].bending_n_m2()).sum();
                add(&mut matrix, weight * bending, &self.deflected(element, &shapes.curvature));
                for &layer in &present {
                    add(&mut matrix, weight * layers[layer].axial_n(), &self.stretched(element, layer, &shapes.strain));
                }
                for pair in present.windows(2) {
                    let width = layers[pair[0]].width_m.min(layers[pair[1]].width_m);
                    let apart = heights[pair[1]] - heights[pair[0]];
                    let mut slip = self.deflected(element, &shapes.slope.map(|slope| apart * slope));
                    slip.extend(self.stretched(element, pair[1], &shapes.axial));
                    slip.extend(self.stretched(element, pair[0], &shapes.axial.map(|axial| -axial)));
                    add(&mut matrix, weight * interlayer_pa_per_m * width, &slip);
                }
            }
        }
        matrix
    }

    /// The unknowns of an element's deflection, each with its factor.
    fn deflected(&self, element: usize, factors: &[f64; 4]) -> Vec<(usize, f64)> {
        let numbers = [element, element + 1].map(|node| self.deflection(node));
        let both = numbers.map(|number| [number, number.map(|number| number + 1)]);
        both.into_iter().flatten().zip(factors).filter_map(|(number, &factor)| Some((number?, factor))).collect()
    }

    /// The unknowns of a layer's axial displacement in an element, each with its factor.
    fn stretched(&self, element: usize, layer: usize, factors: &[f64; 3]) -> Vec<(usize, f64)> {
        let numbers = (0..3).map(|place| self.axial[2 * element + place][layer]);
        numbers.zip(factors).filter_map(|(number, &factor)| Some((number?, factor))).collect()
    }
}

/// Adds the stiffness of the energy `stiffness (sum of factor times unknown)^2 / 2`.
fn add(matrix: &mut DMatrix<f64>, stiffness: f64, terms: &[(usize, f64)]) {
    for &(row, one) in terms {
        for &(column, other) in terms {
            matrix[(row, column)] += stiffness * one * other;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::beam::limits::{bonded_n_per_m, sliding_n_per_m};
    use crate::beam::stack::Layer;

    fn layer(youngs_modulus_pa: f64, length_m: f64, width_m: f64, thickness_m: f64) -> Layer {
        Layer { material: "m".to_owned(), youngs_modulus_pa, length_m, width_m, thickness_m }
    }

    fn close(found: f64, expected: f64, relative: f64) -> bool {
        (found / expected - 1.0).abs() < relative
    }

    /// Newmark's two layers under a tip load, solved by hand: `N'' = a^2 N - K b d M / EI0` with `N'(0) = N(L) = 0`.
    fn two_layers_n_per_m(one: &Layer, other: &Layer, k: f64) -> f64 {
        let (length, width) = (one.length_m, one.width_m.min(other.width_m));
        let apart = 0.5 * (one.thickness_m + other.thickness_m);
        let axial = 1.0 / (1.0 / one.axial_n() + 1.0 / other.axial_n());
        let bending = one.bending_n_m2() + other.bending_n_m2();
        let a = (k * width * (1.0 / axial + apart * apart / bending)).sqrt();
        let c = k * width * apart / (bending * a * a);
        let (al, b) = (a * length, c / a);
        // For a unit force: N = c (L - x) - b tanh(aL) cosh(ax) + b sinh(ax).
        let moment_of_n = c * length.powi(3) / 3.0 + b * (al.tanh() - al) / (a * a);
        1.0 / (length.powi(3) / (3.0 * bending) - apart / bending * moment_of_n)
    }

    #[test]
    fn two_layers_agree_with_the_closed_form() {
        let (one, other) = (layer(3e9, 0.06, 0.02, 80e-6), layer(50e9, 0.06, 0.01, 30e-6));
        let stack = Stack::new(vec![one.clone(), other.clone()]).unwrap();
        for k in [1e6, 1e8, 1e9, 1e10, 1e11] {
            let (found, expected) =
                (spring_constant_n_per_m(&stack, k, 48).unwrap(), two_layers_n_per_m(&one, &other, k));
            assert!(close(found, expected, 1e-4), "{k}: {found} {expected}");
        }
    }

    #[test]
    fn the_stack_of_the_report_lies_between_bonded_and_sliding() {
        let stack = Stack::paper().unwrap();
        let (bonded, sliding) = (bonded_n_per_m(&stack), sliding_n_per_m(&stack));
        assert!(close(spring_constant_n_per_m(&stack, 0.0, ELEMENTS).unwrap(), sliding, 1e-9));
        let hard = spring_constant_n_per_m(&stack, 1e16, ELEMENTS).unwrap();
        assert!(close(hard, bonded, 2e-3), "{hard} {bonded}");
        // 0.15 N by 137.15 mm, integrated by hand over the sections.
        assert!(close(bonded, 0.15 / 0.137_15, 1e-3), "{bonded}");
    }

    /// Halving the elements reduces the error at least tenfold where layers end together; elsewhere it decreases too.
    #[test]
    fn the_mesh_converges() {
        let even = Stack::new(vec![layer(3e9, 0.06, 0.02, 80e-6), layer(50e9, 0.06, 0.01, 30e-6)]).unwrap();
        for (stack, left) in [(even, 0.1), (Stack::paper().unwrap(), 0.6)] {
            let at = |elements| spring_constant_n_per_m(&stack, 1e9, elements).unwrap();
            let fine = at(96);
            let errors = [6, 12, ELEMENTS, 48].map(|elements| (at(elements) / fine - 1.0).abs());
            assert!(errors[2] < 1e-4, "{errors:?}");
            assert!(errors.windows(2).all(|pair| pair[1] < left * pair[0] || pair[1] < 1e-7), "{errors:?}");
        }
    }

    #[test]
    fn arguments_out_of_range_are_rejected_with_their_field() {
        let stack = Stack::paper().unwrap();
        for (k, force, elements, field) in
            [(-1.0, 1.0, 9, "interlayer_pa_per_m"), (1.0, f64::NAN, 9, "tip_n"), (1.0, 1.0, 0, "elements")]
        {
            assert!(bend(&stack, k, force, elements).unwrap_err().to_string().starts_with(field));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// A single layer is a beam; work equals energy; twice the force gives twice the deflection.
        #[test]
        fn a_single_layer_is_a_beam_and_work_equals_energy(modulus in 1e8..1e11f64, thickness in 1e-5..1e-3f64, force in 1e-6..1e-3f64, log_k in 5.0..13.0f64) {
            let single = layer(modulus, 0.06, 0.02, thickness);
            let stack = Stack::new(vec![single.clone()]).unwrap();
            let constant = spring_constant_n_per_m(&stack, 0.0, 4).unwrap();
            prop_assert!(close(constant, 3.0 * single.bending_n_m2() / 0.06f64.powi(3), 1e-9));

            let stack = Stack::new(vec![single.clone(), layer(1e9, 0.05, 0.01, 5e-5), single]).unwrap();
            let k = 10f64.powf(log_k);
            let bent = bend(&stack, k, force, 8).unwrap();
            prop_assert!(close(bent.energy_j, 0.5 * force * bent.tip_m(), 1e-6));
            prop_assert!(close(bend(&stack, k, 2.0 * force, 8).unwrap().tip_m(), 2.0 * bent.tip_m(), 1e-9));
            let stiffer = bend(&stack, 2.0 * k, force, 8).unwrap();
            prop_assert!(stiffer.tip_m() <= bent.tip_m() * (1.0 + 1e-9));
            let (bonded, sliding) = (bonded_n_per_m(&stack), sliding_n_per_m(&stack));
            let constant = force / bent.tip_m();
            prop_assert!(constant > sliding * (1.0 - 1e-6) && constant < bonded * (1.0 + 1e-6));
        }
    }
}
