//! Approximation of a curve by a few straight lines with equal maximum errors.
//!
//! For a given error bound every chord is made as long as possible; the bound is the smallest for which there are few
//! enough chords. (With free knots the error is smallest where it is the same on all intervals: de Boor, *A Practical
//! Guide to Splines*, 1978.) Then each knot is shifted by the mean error of its chords, which halves the error of a
//! curve that is convex or concave.

/// A point of a curve: abscissa and ordinate.
pub(crate) type Point = (f64, f64);

/// Number of bisections of the logarithm of the error bound.
const BISECTIONS: usize = 30;

/// Returns at most `most` knots of a curve, including its ends, and no more than a maximum chord error of `enough`
/// requires. The curve needs two points or more, in ascending order; its first point stays.
pub(crate) fn knots(curve: &[Point], most: usize, enough: f64) -> Vec<Point> {
    if let Some(knots) = chords(curve, most, enough) {
        return lifted(curve, &knots);
    }
    let mut best = vec![0, curve.len() - 1];
    let (mut low, mut high) = (enough, curve.iter().fold(enough, |range, (_, value)| range.max(2.0 * value.abs())));
    for _ in 0..BISECTIONS {
        let bound = (low * high).sqrt();
        match chords(curve, most, bound) {
            Some(knots) => (best, high) = (knots, bound),
            None => low = bound,
        }
    }
    lifted(curve, &best)
}

/// Returns the indices of the points that chords with errors of at most `bound` join, each chord as long as possible;
/// `None` if there are more than `most`.
fn chords(curve: &[Point], most: usize, bound: f64) -> Option<Vec<usize>> {
    let mut knots = vec![0];
    while let Some(&from) = knots.last()
        && from + 1 < curve.len()
    {
        if knots.len() == most {
            return None;
        }
        knots.push(farthest(curve, from, bound));
    }
    Some(knots)
}

/// Returns the last point whose chord from point `from` passes all points between within `bound`.
fn farthest(curve: &[Point], from: usize, bound: f64) -> usize {
    let (x, y) = curve[from];
    let mut slopes = (f64::NEG_INFINITY, f64::INFINITY);
    let mut reached = from + 1;
    for (index, &(there, value)) in curve.iter().enumerate().skip(from + 1) {
        let slope = |value: f64| (value - y) / (there - x);
        if (slopes.0..=slopes.1).contains(&slope(value)) {
            reached = index;
        }
        slopes = (slopes.0.max(slope(value - bound)), slopes.1.min(slope(value + bound)));
        if slopes.0 > slopes.1 {
            break;
        }
    }
    reached
}

/// Returns the knots, shifted so that the errors of the chords are the same on both sides.
fn lifted(curve: &[Point], knots: &[usize]) -> Vec<Point> {
    let lift = |pair: &[usize]| {
        let ((x, y), (end, at_end)) = (curve[pair[0]], curve[pair[1]]);
        let off = curve[pair[0]..=pair[1]].iter().map(|(at, value)| value - y - (at_end - y) * (at - x) / (end - x));
        let (least, most) = off.fold((0.0f64, 0.0f64), |(least, most), off| (least.min(off), most.max(off)));
        (least + most) / 2.0
    };
    let lifts: Vec<f64> = knots.windows(2).map(lift).collect();
    let of_knot = |knot: usize| match knot {
        0 => 0.0,
        _ => (lifts[knot - 1] + lifts.get(knot).unwrap_or(&lifts[knot - 1])) / 2.0,
    };
    knots.iter().enumerate().map(|(knot, &index)| (curve[index].0, curve[index].1 + of_knot(knot))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(law: impl Fn(f64) -> f64) -> Vec<Point> {
        (0..=1000).map(|step| 0.5 * f64::from(step)).map(|x| (x, law(x))).collect()
    }

    /// Returns the largest distance between a curve and the lines through some knots.
    fn off(curve: &[Point], knots: &[Point]) -> f64 {
        let line = |x: f64| {
            let at = knots.partition_point(|knot| knot.0 <= x).clamp(1, knots.len() - 1);
            let ((a, from), (b, to)) = (knots[at - 1], knots[at]);
            from + (to - from) * (x - a) / (b - a)
        };
        curve.iter().map(|(x, y)| (y - line(*x)).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn knots_of_a_parabola_are_equidistant() {
        let curve = curve(|x| x * x / 500.0);
        let knots = knots(&curve, 9, 1e-6);
        assert!(knots.len() == 9 && knots.iter().enumerate().all(|(k, knot)| (knot.0 - 62.5 * k as f64).abs() < 8.0));
        // The error of a chord of length `h` is `h^2 / 8 f''`; the start of the first chord is not shifted.
        let bow = 62.5f64.powi(2) / 8.0 * 2.0 / 500.0;
        assert!(off(&curve, &knots) < 0.85 * bow, "{} {bow}", off(&curve, &knots));
    }

    #[test]
    fn knots_are_dense_where_curvature_is_large() {
        let curve = curve(|x| 100.0 * (1.0 - (-x / 40.0).exp()));
        let even: Vec<Point> = curve.iter().step_by(125).copied().collect();
        let knots = knots(&curve, 9, 1e-6);
        assert!(knots.len() <= 9 && off(&curve, &knots) < 0.15 * off(&curve, &even), "{knots:?}");
    }

    #[test]
    fn kink_is_a_knot_and_a_line_has_none() {
        let kinked = curve(|x| x.min(200.0) + 0.5 * (x - 200.0).max(0.0));
        assert_eq!(knots(&kinked, 9, 1e-6), [(0.0, 0.0), (200.0, 200.0), (500.0, 350.0)]);
        assert_eq!(knots(&curve(|x| 2.0 * x), 9, 1e-6), [(0.0, 0.0), (500.0, 1000.0)]);
    }
}
