//! The finite element of the layered beam: cubic deflection, quadratic axial displacements, three Gauss points.

/// Gauss points on 0 to 1 with their weights; the outer two lie sqrt(0.6) / 2 from the middle.
pub(super) const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Shape functions of an element at one place.
pub(super) struct Shapes {
    /// First derivative of the cubic (Hermite) functions, in 1/m for deflections.
    pub(super) slope: [f64; 4],
    /// Second derivative of the cubic functions, in 1/m2 for deflections.
    pub(super) curvature: [f64; 4],
    /// Quadratic functions of the start, middle and end node.
    pub(super) axial: [f64; 3],
    /// First derivative of the quadratic functions, in 1/m.
    pub(super) strain: [f64; 3],
}

impl Shapes {
    /// Evaluates the functions at `t` (0 to 1) of an element of length `h` (m).
    pub(super) fn at(t: f64, h: f64) -> Self {
        Self {
            slope: [6.0 * t * (t - 1.0) / h, (1.0 - t) * (1.0 - 3.0 * t), 6.0 * t * (1.0 - t) / h, t * (3.0 * t - 2.0)],
            curvature: [
                (12.0 * t - 6.0) / (h * h),
                (6.0 * t - 4.0) / h,
                (6.0 - 12.0 * t) / (h * h),
                (6.0 * t - 2.0) / h,
            ],
            axial: [(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)],
            strain: [(4.0 * t - 3.0) / h, (4.0 - 8.0 * t) / h, (4.0 * t - 1.0) / h],
        }
    }
}
