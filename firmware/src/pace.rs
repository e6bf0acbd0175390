//! When the next tick is due. Ticks that could not be run are counted and left out; they are never made up for in a burst,
//! and the grid of ticks stays where it is.

/// A wake-up, held against its plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrival {
    /// How late it came, in us.
    pub lateness_us: u32,
    /// Whole periods that went by unused.
    pub missed_ticks: u32,
}

/// A grid of ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    period_us: u64,
    due_us: u64,
}

impl Pace {
    /// First due one `period_us` after `now_us`.
    pub const fn new(now_us: u64, period_us: u64) -> Self {
        Self { period_us, due_us: now_us.saturating_add(period_us) }
    }

    /// When to wake up, in us.
    pub const fn due_us(&self) -> u64 {
        self.due_us
    }

    /// Woken up at `now_us`, not before it was due: moves on to the next tick in the future.
    pub fn arrive(&mut self, now_us: u64) -> Arrival {
        let lateness = now_us.saturating_sub(self.due_us);
        // A division only where one is needed: on time is the rule.
        let missed = if lateness < self.period_us { 0 } else { lateness / self.period_us };
        self.due_us = self.due_us.saturating_add((missed + 1).saturating_mul(self.period_us));
        Arrival {
            lateness_us: u32::try_from(lateness).unwrap_or(u32::MAX),
            missed_ticks: u32::try_from(missed).unwrap_or(u32::MAX),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_keep_to_their_grid() {
        let mut pace = Pace::new(500, 1000);
        for (now, next, lateness_us, missed_ticks) in [
            (1500, 2500, 0, 0),
            (2510, 3500, 10, 0),
            (4499, 4500, 999, 0),
            (5500, 6500, 1000, 1),
            (16_700, 17_500, 10_200, 10),
            (17_500, 18_500, 0, 0),
        ] {
            assert_eq!(pace.arrive(now), Arrival { lateness_us, missed_ticks }, "{now}");
            assert_eq!(pace.due_us(), next, "{now}: the next one lies in the future, on the grid");
        }
    }
}
