//! Time of the next tick. Missed ticks are counted and skipped: there is no burst to catch up, and the grid of ticks does not
//! shift.

/// Comparison of a wake-up with its planned time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrival {
    /// Delay after the planned time, in us.
    pub lateness_us: u32,
    /// Number of missed ticks: whole periods within the delay.
    pub missed_ticks: u32,
}

/// Grid of ticks with a fixed period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    period_us: u64,
    due_us: u64,
}

impl Pace {
    /// A grid whose first tick is due one `period_us` after `now_us`, both in us.
    pub const fn new(now_us: u64, period_us: u64) -> Self {
        Self { period_us, due_us: now_us.saturating_add(period_us) }
    }

    /// Time of the next tick, in us.
    pub const fn due_us(&self) -> u64 {
        self.due_us
    }

    /// Processes the wake-up at `now_us`, which is not before the tick was due, and advances to the next tick in the future.
    pub fn arrive(&mut self, now_us: u64) -> Arrival {
        let lateness = now_us.saturating_sub(self.due_us);
        // Most ticks are on time and need no division.
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
    fn ticks_stay_on_their_grid_and_missed_ones_are_counted() {
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
            assert_eq!(pace.due_us(), next, "{now}: the next tick is in the future and on the grid");
        }
    }
}
