//! The work that a diagnosis may do, counted so that the same record gets the same answer on every machine.
//!
//! The unit of work is one piece of the voltage through one lag. Other steps count by their time relative to that.
//!
//! ```text
//! budget = WORK (rows / 4000)^0.55 for more than 4000 rows, WORK for fewer; a quarter if quick, ten times if thorough
//! ```
//!
//! A search of normal effort whose work becomes scarce while it finds causes goes on, once, with four times as much.

use std::str::FromStr;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use simulation::bad_input::BadInput;

use crate::fit::stop::Stop;

/// How long a diagnosis searches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Effort {
    /// A quarter of the normal effort.
    Quick,
    /// At most 2 s of CPU time for 2400 rows, 8 s for 10 000 and 20 s for 100 000, up to twice that on a slow machine; up to five times as
    /// much for up to 5000 rows whose search lacks work while it finds causes.
    #[default]
    Normal,
    /// Ten times the normal effort.
    Thorough,
}

impl FromStr for Effort {
    type Err = BadInput;

    fn from_str(name: &str) -> Result<Self, BadInput> {
        let found = [Self::Quick, Self::Normal, Self::Thorough].into_iter().find(|effort| effort.name() == name);
        found.ok_or_else(|| BadInput(format!("--effort {name}: expected quick, normal or thorough")))
    }
}

impl Effort {
    /// Returns the name of the effort.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Normal => "normal",
            Self::Thorough => "thorough",
        }
    }

    /// Returns the ratio to the normal effort.
    fn ratio(self) -> f64 {
        match self {
            Self::Quick => 0.25,
            Self::Normal => 1.0,
            Self::Thorough => 10.0,
        }
    }
}

/// Work for a record of at most [`ROWS`] rows at the normal effort.
const WORK: f64 = 900e6;
/// Rows up to which the work is constant.
const ROWS: f64 = 4000.0;
/// Exponent of the growth with the rows.
const GROWTH: f64 = 0.55;
/// Fraction of a search's budget after which it only follows the most promising extensions.
const SCARCE: f64 = 0.5;

/// Fraction of a search's budget that is kept for the forms of causes that are seldom needed.
const FOR_RARE_FORMS: f64 = 0.125;

/// Ratio of the largest work on a record to the work that a diagnosis may do if nothing fits: the rest is for a diagnosis once a
/// model leaves nothing but noise or a rare form promises much, or for the search of an equation (see [`Budget::left`]).
const EXTENSION: f64 = 1.15;

/// Ratio of the work with which a search of normal effort goes on, to the work that was granted to it.
const FURTHER: f64 = 4.0;

/// Work that an effort allows for a record.
fn work(effort: Effort, rows: usize) -> f64 {
    WORK * effort.ratio() * (rows as f64 / ROWS).powf(GROWTH).max(1.0)
}

/// The work that was done and that may be done.
#[derive(Debug)]
pub struct Budget {
    total: u64,
    spent: AtomicU64,
    /// Work at which the present search became or becomes scarce of work, and at which it ends.
    scarce: AtomicU64,
    limit: AtomicU64,
    /// Work that was granted to the present search, and the part of it that is kept back.
    granted: AtomicU64,
    reserved: AtomicU64,
    /// True once the present search does the work that was kept back.
    released: AtomicBool,
    /// True if a search ended because its work was done.
    cut: AtomicBool,
    /// True if the present one did.
    present_cut: AtomicBool,
    /// True if a search has found a model that leaves nothing but noise, and may do more work.
    extended: AtomicBool,
    /// True if a search may go on with more work, once.
    may_go_on: AtomicBool,
    /// Work with which a search has gone on.
    further: AtomicU64,
    stop: Option<Stop>,
}

/// No limit.
pub static UNLIMITED: Budget = Budget::of(u64::MAX, false, None);

impl Budget {
    const fn of(total: u64, may_go_on: bool, stop: Option<Stop>) -> Self {
        Self {
            total,
            spent: AtomicU64::new(0),
            scarce: AtomicU64::new(total),
            limit: AtomicU64::new(total),
            granted: AtomicU64::new(total),
            reserved: AtomicU64::new(0),
            released: AtomicBool::new(false),
            cut: AtomicBool::new(false),
            present_cut: AtomicBool::new(false),
            extended: AtomicBool::new(false),
            may_go_on: AtomicBool::new(may_go_on),
            further: AtomicU64::new(0),
            stop,
        }
    }

    /// Returns the budget for a record with a number of rows; `stop` ends it early.
    pub fn new(effort: Effort, rows: usize, stop: Stop) -> Self {
        Self::part(1.0, effort, rows, stop)
    }

    /// Returns a part of the budget for a record with a number of rows.
    pub fn part(part: f64, effort: Effort, rows: usize, stop: Stop) -> Self {
        Self::of((part * work(effort, rows)) as u64, effort == Effort::Normal, Some(stop))
    }

    /// Returns what a diagnosis that has spent some work on a record leaves for a further search, on `rows_searched` of its rows; at least
    /// the part by which a budget may be extended, as a search that went on has spent more than its own.
    pub fn left(effort: Effort, rows: usize, spent: u64, rows_searched: usize, stop: Stop) -> Self {
        let own = work(effort, rows);
        let left = ((EXTENSION * own) as u64).saturating_sub(spent).max(((EXTENSION - 1.0) * own) as u64);
        Self::of(left.min(work(effort, rows_searched) as u64), effort == Effort::Normal, Some(stop))
    }

    /// Counts work.
    pub fn spend(&self, work: u64) {
        self.spent.fetch_add(work, Ordering::Relaxed);
    }

    /// Returns the work that was done.
    pub fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// Returns the work that was done without what a search went on with.
    pub fn spent_of_own(&self) -> u64 {
        self.spent().saturating_sub(self.further.load(Ordering::Relaxed))
    }

    /// Returns the work that may be done in all.
    pub fn total(&self) -> u64 {
        let own = match self.extended.load(Ordering::Relaxed) {
            true => (EXTENSION * self.total as f64) as u64,
            false => self.total,
        };
        own.saturating_add(self.further.load(Ordering::Relaxed))
    }

    /// Gives the next search a share of the work that is left, 0 to 1.
    pub fn grant(&self, share: f64) {
        self.begin((self.total().saturating_sub(self.spent()) as f64 * share) as u64);
    }

    /// Begins a search, or another round of one, that may do some work from here on.
    fn begin(&self, granted: u64) {
        let spent = self.spent();
        let limit = spent.saturating_add(granted);
        self.scarce.store(spent.saturating_add((SCARCE * granted as f64) as u64), Ordering::Relaxed);
        self.limit.store(limit, Ordering::Relaxed);
        self.granted.store(limit - spent, Ordering::Relaxed);
        self.reserved.store(0, Ordering::Relaxed);
        self.released.store(false, Ordering::Relaxed);
        self.present_cut.store(false, Ordering::Relaxed);
    }

    /// Keeps a part of the present search's work back until [`Budget::release`] or [`Budget::extend`].
    pub fn reserve(&self) {
        let reserved = (FOR_RARE_FORMS * self.granted() as f64) as u64;
        self.reserved.store(reserved, Ordering::Relaxed);
        self.scarce.fetch_sub((SCARCE * reserved as f64) as u64, Ordering::Relaxed);
    }

    /// Lets the present search do the work that was kept back, half of it before work is scarce.
    pub fn release(&self) {
        self.note_cut();
        self.released.store(true, Ordering::Relaxed);
        self.reserved.store(0, Ordering::Relaxed);
        let left = self.limit.load(Ordering::Relaxed).saturating_sub(self.spent());
        self.scarce.fetch_max(self.spent() + (SCARCE * left as f64) as u64, Ordering::Relaxed);
    }

    /// Allows the present search more work, once: it has found a model that leaves nothing but noise, so that the work left is for
    /// simpler models of the same record, or a rare form that promises much.
    pub fn extend(&self) {
        self.reserved.store(0, Ordering::Relaxed);
        if self.extended.swap(true, Ordering::Relaxed) {
            return;
        }
        let more = ((EXTENSION - 1.0) * self.total as f64) as u64;
        for limit in [&self.scarce, &self.limit, &self.granted] {
            limit.fetch_add(more, Ordering::Relaxed);
        }
    }

    /// Lets the present search, if scarce work has kept it from following all extensions, go on with more, once; true if it does.
    pub fn go_on(&self) -> bool {
        self.note_cut();
        let lacked_work = self.present_cut.load(Ordering::Relaxed) || self.is_scarce();
        if !lacked_work || self.is_stopped() || !self.may_go_on.swap(false, Ordering::Relaxed) {
            return false;
        }
        let further = (FURTHER * self.granted() as f64) as u64;
        self.further.store(further, Ordering::Relaxed);
        let limit = self.limit.load(Ordering::Relaxed).saturating_add(further);
        self.begin(limit.saturating_sub(self.spent()));
        self.cut.store(false, Ordering::Relaxed);
        true
    }

    /// Returns the work that was granted to the present search.
    pub fn granted(&self) -> u64 {
        self.granted.load(Ordering::Relaxed)
    }

    /// Returns the work that is left for the present search; none once its end was requested.
    pub fn work_left(&self) -> u64 {
        if self.is_stopped() {
            return 0;
        }
        let used = self.spent().saturating_add(self.reserved.load(Ordering::Relaxed));
        self.limit.load(Ordering::Relaxed).saturating_sub(used)
    }

    /// Returns true if the search has to follow the most promising extensions only.
    pub fn is_scarce(&self) -> bool {
        self.spent() >= self.scarce.load(Ordering::Relaxed)
    }

    /// Returns true if the search has to end.
    pub fn is_over(&self) -> bool {
        self.spent() + self.reserved.load(Ordering::Relaxed) >= self.limit.load(Ordering::Relaxed) || self.is_stopped()
    }

    /// Returns true if the end was requested.
    pub fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(Stop::requested)
    }

    /// Ends a search: notes whether its work was cut, and lets the rest of the work be used for its report.
    pub fn close(&self) {
        self.note_cut();
        self.grant(1.0);
    }

    /// Notes whether the present search was cut, if it is not in the work that was kept back.
    fn note_cut(&self) {
        if self.is_over() && !self.released.load(Ordering::Relaxed) || self.is_stopped() {
            self.cut.store(true, Ordering::Relaxed);
            self.present_cut.store(true, Ordering::Relaxed);
        }
    }

    /// Returns true if a search ended because its work was done, or because the end was requested.
    pub fn was_cut(&self) -> bool {
        self.cut.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn granted(effort: Effort) -> Budget {
        let budget = Budget::new(effort, 400, Stop::default());
        budget.grant(0.5);
        budget
    }

    #[test]
    fn a_search_of_normal_effort_that_its_work_ended_goes_on_once() {
        let budget = granted(Effort::Normal);
        let own = budget.granted();
        assert!(!budget.go_on(), "its work has not ended");
        budget.spend(own);
        assert!(budget.is_over() && budget.go_on() && !budget.is_over() && !budget.is_scarce());
        assert_eq!((budget.work_left(), budget.total()), (4 * own, 6 * own));
        budget.spend(4 * own);
        assert_eq!((budget.spent(), budget.spent_of_own()), (5 * own, own));
        assert!(budget.is_over() && !budget.go_on());
        budget.close();
        assert!(budget.was_cut() && budget.work_left() == own, "the rest is for the report");
    }

    /// It has followed the most promising extensions only, also with the work that is kept for rare forms.
    #[test]
    fn a_search_whose_work_was_scarce_goes_on_before_it_has_ended() {
        let budget = granted(Effort::Normal);
        budget.spend(budget.granted() / 2 - 1);
        assert!(!budget.go_on());
        budget.spend(1);
        assert!(!budget.is_over() && budget.go_on() && !budget.is_scarce());
        let budget = granted(Effort::Normal);
        budget.reserve();
        budget.spend(budget.granted() / 4);
        budget.release();
        budget.spend(budget.work_left());
        assert!(budget.go_on());
    }

    #[test]
    fn a_search_that_goes_on_is_not_cut_by_the_work_that_ended_it_before() {
        let budget = granted(Effort::Normal);
        budget.spend(budget.granted());
        assert!(budget.go_on());
        budget.close();
        assert!(!budget.was_cut());
    }

    #[test]
    fn a_search_of_another_effort_ends_with_its_work() {
        for effort in [Effort::Quick, Effort::Thorough] {
            let budget = granted(effort);
            budget.spend(budget.granted());
            assert!(budget.is_over() && !budget.go_on() && budget.is_over());
        }
    }
}
