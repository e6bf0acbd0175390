//! A static law with as few points as the tick takes.
//!
//! The points are some of the law's own. Of all choices with the first and the last point, the one is taken whose straight lines are off by
//! the least at the points that are left out, by dynamic programming over the number of lines.

use model::extended::law::MAX_POINTS;

use super::Law;

/// Largest error of the lines that stand for a law in the tick, relative to the law's largest magnitude. The square law that an
/// identification writes with 33 points needs 0.4 %.
pub(super) const MOST_OFF: f64 = 0.005;

impl Law {
    /// The law through at most nine of its points, and by how much it is off at the others, relative to its largest magnitude. The
    /// points have to be in order, and as many as the values.
    pub fn of_tick(&self) -> (Self, f64) {
        let count = self.voltage_v.len();
        if count <= MAX_POINTS {
            return (self.clone(), 0.0);
        }
        let off: Vec<Vec<f64>> =
            (0..count).map(|from| (0..count).map(|to| self.off_between(from, to)).collect()).collect();
        // Least error from the first point to each with as many lines as rows so far, and the point before it.
        let mut best: Vec<Vec<(f64, usize)>> = vec![(0..count).map(|to| (off[0][to], 0)).collect()];
        for _ in 2..MAX_POINTS {
            let last = &best[best.len() - 1];
            let through = |to: usize, before: usize| (f64::max(last[before].0, off[before][to]), before);
            let least =
                |to: usize| (0..=to).map(|before| through(to, before)).min_by(|one, other| one.0.total_cmp(&other.0));
            best.push((0..count).map(|to| least(to).unwrap_or((0.0, 0))).collect());
        }
        let mut points = vec![count - 1];
        for row in best.iter().rev() {
            points.push(row[points[points.len() - 1]].1);
        }
        points.reverse();
        points.dedup();
        let of = |values: &[f64]| points.iter().map(|&point| values[point]).collect();
        let largest = self.stiffness.iter().fold(f64::MIN_POSITIVE, |largest, value| largest.max(value.abs()));
        let error = best[best.len() - 1][count - 1].0 / largest;
        (Self { voltage_v: of(&self.voltage_v), stiffness: of(&self.stiffness) }, error)
    }

    /// Largest distance in V of the points between two points from the line through these.
    fn off_between(&self, from: usize, to: usize) -> f64 {
        let point = |at: usize| (self.voltage_v[at], self.stiffness[at]);
        let ((from_v, low), (to_v, high)) = (point(from), point(to));
        let off = |at: usize| {
            let (volts, value) = point(at);
            (value - low - (high - low) * (volts - from_v) / (to_v - from_v)).abs()
        };
        (from + 1..to).map(off).fold(0.0, f64::max)
    }
}
