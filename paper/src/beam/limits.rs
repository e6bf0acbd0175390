//! Closed forms for the two limits of the stack: layers bonded so that sections stay plane, and layers that slide
//! freely.

use crate::beam::stack::Stack;

/// Spring constant at the tip, in N/m, of bonded layers with plane sections: `1 / integral of (L - x)^2 / EI(x)`.
pub fn bonded_n_per_m(stack: &Stack) -> f64 {
    by_section(stack, |axial, bending, heights| {
        let total: f64 = axial.iter().sum();
        let neutral = axial.iter().zip(heights).map(|(axial, height)| axial * height).sum::<f64>() / total;
        let steiner: f64 = axial.iter().zip(heights).map(|(axial, height)| axial * (height - neutral).powi(2)).sum();
        bending.iter().sum::<f64>() + steiner
    })
}

/// Spring constant at the tip, in N/m, of layers that slide freely, so that their bending stiffnesses add.
pub fn sliding_n_per_m(stack: &Stack) -> f64 {
    by_section(stack, |_, bending, _| bending.iter().sum())
}

/// Spring constant in N/m from the bending stiffness of each section, a function of the axial stiffness, bending
/// stiffness and height of its layers.
fn by_section(stack: &Stack, bending_stiffness: impl Fn(&[f64], &[f64], &[f64]) -> f64) -> f64 {
    let length = stack.length_m();
    let heights = stack.heights_m();
    let ends = section_ends(stack);
    let compliance: f64 = ends
        .windows(2)
        .map(|ends| {
            let here = || stack.layers().iter().zip(&heights).filter(|(layer, _)| layer.length_m >= ends[1]);
            let axial: Vec<f64> = here().map(|(layer, _)| layer.axial_n()).collect();
            let bending: Vec<f64> = here().map(|(layer, _)| layer.bending_n_m2()).collect();
            let heights: Vec<f64> = here().map(|(_, &height)| height).collect();
            let arm = |x: f64| (length - x).powi(3) / 3.0;
            (arm(ends[0]) - arm(ends[1])) / bending_stiffness(&axial, &bending, &heights)
        })
        .sum();
    1.0 / compliance
}

/// The clamp and the ends of the layers, in m from the clamp, ascending.
pub(super) fn section_ends(stack: &Stack) -> Vec<f64> {
    let mut ends: Vec<f64> = stack.layers().iter().map(|layer| layer.length_m).chain([0.0]).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    ends
}
