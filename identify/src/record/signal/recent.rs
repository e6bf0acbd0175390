//! What filters compute of the durations of a signal's last few pieces.

/// Relative difference up to which durations of pieces are the same: those of a uniformly sampled record differ by rounding.
const SAME_DURATION: f64 = 1e-9;
/// Number of durations. A delay divides the rows in which the voltage changes into the same two pieces, the others not at all.
const KEPT: usize = 4;

/// Values of the last few durations, in s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Recent<T> {
    durations_s: [f64; KEPT],
    values: [T; KEPT],
    last: usize,
}

impl<T: Copy> Recent<T> {
    /// No duration is known but 0, of which the value is `none`.
    pub(super) fn new(none: T) -> Self {
        Self { durations_s: [0.0; KEPT], values: [none; KEPT], last: 0 }
    }

    /// Returns the value of a duration, in s, which is made if it is not known.
    #[inline]
    pub(super) fn of(&mut self, duration_s: f64, make: impl FnOnce() -> T) -> &T {
        if differ(duration_s, self.durations_s[self.last]) {
            self.find(duration_s, make);
        }
        &self.values[self.last]
    }

    #[inline(never)]
    fn find(&mut self, duration_s: f64, make: impl FnOnce() -> T) {
        let known = self.durations_s.iter().position(|&known_s| !differ(duration_s, known_s));
        self.last = known.unwrap_or_else(|| {
            let oldest = (self.last + 1) % KEPT;
            (self.durations_s[oldest], self.values[oldest]) = (duration_s, make());
            oldest
        });
    }
}

/// True if pieces of two durations, in s, need different values.
fn differ(duration_s: f64, known_s: f64) -> bool {
    (duration_s - known_s).abs() > SAME_DURATION * duration_s
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Durations that come again are computed once, in whatever order, and durations that do not differ by more than rounding.
    #[test]
    fn values_of_recurring_durations_are_made_once() {
        let mut recent = Recent::new(0.0);
        let mut made = 0;
        for round in 0..100 {
            for duration_s in [0.1, 1e-5, 0.3, 0.2] {
                let rounded = duration_s * (1.0 + 1e-12 * f64::from(round));
                let value = *recent.of(rounded, || {
                    made += 1;
                    -duration_s
                });
                assert_eq!(value, -duration_s);
            }
        }
        assert_eq!(made, 4);
        assert_eq!(*recent.of(0.0, || 5.0), 5.0, "as long as it was not forgotten, 0 had no value but `none`");
    }
}
