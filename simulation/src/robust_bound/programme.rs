//! The linear programme: voltages under which springs are at the step in time and do not overshoot.

use microlp::{ComparisonOp, LinearExpr, OptimizationDirection, Problem, SolveOutcome, Variable};

use super::REACHED;

/// Weights of voltages in the stiffness below this are left out of the programme.
const NEGLIGIBLE: f64 = 1e-9;
/// Largest violation that counts as none, relative to the step.
const TOLERANCE: f64 = 1e-6;

/// One spring of a programme. Stiffness is in steps, 0 before the step; voltages are in any unit, 0 before the step.
pub(super) struct Member {
    /// Weights of the voltages between the intervals in the stiffness, at each time.
    pub(super) weights: Vec<Vec<f64>>,
    /// Stiffness at each time if the voltage stays what it is.
    pub(super) held: Vec<f64>,
    /// Lowest and highest voltage.
    pub(super) range: (f64, f64),
    /// Largest rate of the voltage.
    pub(super) slew_per_s: Option<f64>,
    /// Index of the time from which the spring has to be above 97 %.
    pub(super) from: usize,
}

/// True if there are voltages, the first `common` of which are the same for all springs, with which each spring is above 97 % of the step
/// from its time on, and at all times below the allowed overshoot.
pub(super) fn is_possible(intervals_s: &[f64], common: usize, members: &[Member], overshoot: f64) -> bool {
    let mut problem = Problem::new(OptimizationDirection::Minimize);
    let knots = intervals_s.len() + 1;
    // Not below 0: by how much less than all that is allowed is needed does not matter, and takes the solver long.
    let violation = problem.add_var(1.0, (0.0, f64::INFINITY));
    let mut shared: Vec<Variable> = Vec::new();
    for Member { weights, held, range, slew_per_s, from } in members {
        let own = |knot: usize| shared.get(knot).copied().unwrap_or_else(|| problem.add_var(0.0, *range));
        let voltages: Vec<Variable> = (0..knots).map(own).collect();
        let mut at_most = |weights: &[f64], sign: f64, limit: f64| {
            let mut sum = LinearExpr::empty();
            for (voltage, weight) in voltages.iter().zip(weights).filter(|(_, weight)| weight.abs() > NEGLIGIBLE) {
                sum.add(*voltage, sign * weight);
            }
            sum.add(violation, -1.0);
            problem.add_constraint(sum, ComparisonOp::Le, limit);
        };
        for (at, (weights, held)) in weights.iter().zip(held).enumerate() {
            at_most(weights, 1.0, 1.0 + overshoot - held);
            if at >= *from {
                at_most(weights, -1.0, held - REACHED);
            }
        }
        if let Some(slew_per_s) = slew_per_s {
            // The old voltage, 0, before the first.
            let changes =
                std::iter::once((None, voltages[0])).chain(voltages.windows(2).map(|of| (Some(of[0]), of[1])));
            for ((last, voltage), interval_s) in changes.zip(std::iter::once(&0.0).chain(intervals_s)) {
                for sign in [1.0, -1.0] {
                    let mut change = LinearExpr::empty();
                    change.add(voltage, sign);
                    if let Some(last) = last {
                        change.add(last, -sign);
                    }
                    problem.add_constraint(change, ComparisonOp::Le, slew_per_s * interval_s);
                }
            }
        }
        if shared.is_empty() {
            shared = voltages.into_iter().take(common).collect();
        }
    }
    match problem.solve() {
        Ok(SolveOutcome::Solution(solution)) => solution.objective() <= TOLERANCE,
        _ => false,
    }
}
