//! The decision: each hypothesis is fitted by elimination, a small step in each tick, and the leftovers are compared.
//!
//! The products of a hypothesis are scaled by powers of two, so that every diagonal element has at most 29 bits. One pivot at a
//! time is eliminated: `m_ij -= m_ki m_kj / m_kk`. What remains in the last element is the energy that the hypothesis leaves.

use super::bank::{HYPOTHESES, Hypothesis, NESTED};
use super::products::{Sums, element};
use super::{CAUSES, Cause, Config, Verdict, thresholds};
use crate::units::saturated_to_32;

/// Elements of the matrix that one tick eliminates.
const EACH: u32 = 2;
/// Bits of the scaled diagonal.
const BITS: u32 = 29;

/// What is done next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    Idle,
    /// Find the scales of a hypothesis.
    Scale,
    /// Load a row of its matrix.
    Load,
    /// Divide by a pivot.
    Pivot,
    /// Eliminate elements.
    Eliminate,
    /// Bound the size.
    Bound,
    /// Keep the best hypothesis of each cause.
    Record,
    /// Find how much a rival may leave.
    Bar,
    /// Collect the causes that are not excluded.
    Rivals,
    /// Leave out causes that contain another one.
    Contain,
    /// Find the two causes that leave least.
    Pick,
    /// Come to the verdict.
    Conclude,
}

/// A size as a fraction: `numerator / denominator * 2^exponent`, in units of [`super::Settings::unit`]; there is none if the denominator
/// is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Size {
    pub(super) numerator: i32,
    pub(super) denominator: i32,
    pub(super) exponent: i8,
    /// Scale of the principal vector: the information is `denominator * 2^(2 scale)`, with 20 fraction bits.
    pub(super) scale: u8,
}

/// State of the decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decision {
    stage: Stage,
    hypothesis: u8,
    offset: u16,
    pivot: u8,
    row: u8,
    column: u8,
    matrix: [i32; 64],
    own: [i32; 8],
    scales: [u8; 8],
    reciprocal: i32,
    /// Bits by which a product is shifted to the right before it is multiplied by the reciprocal, 0 to 29.
    right: u8,
    information: i32,
    /// Number of blocks in the copied sums.
    blocks: u32,
    /// What an error of the model within its tolerance can add to a leftover: twice its energy, since `(a + b)^2 <= 2 a^2 + 2 b^2`.
    doubted: i64,
    none: i64,
    least: [i64; CAUSES],
    /// What the causes of [`NESTED`] leave that others contain, whatever their size is.
    unbounded: [i64; NESTED.len()],
    best: u8,
    sizes: [Size; CAUSES],
    bar: i64,
    rivals: u32,
    /// Leftover of the hypothesis in work, within its bounds and without them, and its size.
    left: i64,
    free: i64,
    now: Size,
    /// The two causes that leave least.
    first: (i64, Option<Cause>),
    second: (i64, Option<Cause>),
    proposed: Verdict,
    agreed: u8,
    /// Number of decisions in a row that say something else than the verdict.
    against: u8,
    pub(super) verdict: Verdict,
    pub(super) size: Size,
    /// Number of decisions made.
    pub(super) rounds: u32,
    /// Leftover without a cause and with the best one at the last decision, in variances with 20 fraction bits.
    pub(super) energies: (i64, i64),
    /// Number of blocks of the last decision.
    pub(super) decided: u32,
}

/// A pivot to divide by.
#[derive(Clone, Copy)]
struct Divisor {
    reciprocal: i32,
    right: u8,
}

impl Divisor {
    /// Returns `product / pivot`; its magnitude is below 2^31 if the product is that of two elements of the pivot's row.
    #[inline(always)]
    fn quotient(self, product: i64) -> i64 {
        let scaled = saturated_to_32(shifted_right(product, self.right));
        (i64::from(scaled) * i64::from(self.reciprocal)) >> 30
    }
}

impl Size {
    /// No size.
    const NEW: Self = Self { numerator: 0, denominator: 0, exponent: 0, scale: 0 };
}

/// Returns the index of an element; 8 columns.
#[inline(always)]
const fn at(row: u8, column: u8) -> usize {
    (row as usize * 8 + column as usize) & 63
}

/// Shifts left by `by` bits, or right if it is negative; saturated.
#[inline(always)]
fn shifted(value: i64, by: i32) -> i64 {
    if by.is_negative() {
        value >> (-by).min(63)
    } else {
        let most = i64::MAX >> by.min(62);
        value.max(-most).min(most) << by.min(62)
    }
}

/// Shifts right by 0 to 31 bits, on each half: for a whole one of a variable number of bits the MCU's compiler calls a function.
#[inline(always)]
fn shifted_right(value: i64, by: u8) -> i64 {
    let by = by & 31;
    let (high, low) = ((value >> 32) as i32, value as u32);
    let low = (low >> by) + (high << 1 << (31 - by)) as u32;
    (i64::from(high >> by) << 32) + i64::from(low)
}

/// Returns `2^59 / mantissa`, rounded down, of a mantissa from 2^29 to 2^30 - 1. For a division of 64 bits the MCU calls a function of
/// hundreds of instructions.
fn reciprocal(mantissa: u32) -> i32 {
    // 16 bits of it, from a mantissa of as many: too large by up to 2^-15 of itself, or too low by less than one.
    let first = (1u32 << 31).checked_div(mantissa >> 14).unwrap_or(0);
    let rest = (1 << 45) - i64::from(first) * i64::from(mantissa);
    let second = (i64::from(first) << 14) + ((rest * i64::from(first)) >> 31);
    // Too low by at most one: so it is for each of the 2^29 mantissas.
    let rest = (1 << 59) - second * i64::from(mantissa);
    second as i32 + i32::from(rest >= i64::from(mantissa))
}

impl Decision {
    /// Before the first decision.
    pub(super) const NEW: Self = Self {
        stage: Stage::Idle,
        hypothesis: 0,
        offset: 0,
        pivot: 0,
        row: 0,
        column: 0,
        matrix: [0; 64],
        own: [0; 8],
        scales: [0; 8],
        reciprocal: 0,
        right: 0,
        information: 0,
        blocks: 0,
        doubted: 0,
        none: 0,
        least: [i64::MAX; CAUSES],
        unbounded: [i64::MAX; NESTED.len()],
        best: 0,
        sizes: [Size::NEW; CAUSES],
        bar: 0,
        rivals: 0,
        left: 0,
        free: 0,
        now: Size::NEW,
        first: (0, None),
        second: (0, None),
        proposed: Verdict::Quiet,
        agreed: 0,
        against: 0,
        verdict: Verdict::Quiet,
        size: Size::NEW,
        rounds: 0,
        energies: (0, 0),
        decided: 0,
    };

    /// True if no decision is being made.
    pub(super) fn idle(&self) -> bool {
        self.stage == Stage::Idle
    }

    /// Starts a decision on the copied sums of `blocks` blocks, of which `doubted` may be the energy of an error of the model.
    pub(super) fn begin(&mut self, blocks: u32, doubted: i64) {
        self.stage = Stage::Scale;
        self.hypothesis = 0;
        self.offset = 0;
        self.blocks = blocks;
        self.doubted = 2 * doubted;
        self.least = [i64::MAX; CAUSES];
        self.best = 0;
    }

    /// Drops the decision and its verdict.
    pub(super) fn reset(&mut self) {
        *self = Self { rounds: self.rounds, ..Self::NEW };
    }

    /// Does one step.
    #[inline(never)]
    pub(super) fn step(&mut self, config: &Config, copy: &Sums, released: bool) {
        let Some(hypothesis) = HYPOTHESES.get(usize::from(self.hypothesis)) else {
            return self.judge(config, released);
        };
        let last = hypothesis.vectors.len() as u8;
        match self.stage {
            Stage::Scale => self.scale(copy, last),
            Stage::Load => self.load(copy, last),
            Stage::Pivot => self.divide(last),
            Stage::Eliminate => self.eliminate(last),
            Stage::Bound => self.bound(config, last),
            Stage::Record => self.record(hypothesis),
            _ => {}
        }
    }

    fn scale(&mut self, copy: &Sums, last: u8) {
        let (mut index, last) = (usize::from(self.offset), usize::from(last));
        for row in 0..last + 1 {
            let bits = 64 - element(copy, index).leading_zeros();
            self.scales[row & 7] = (bits.saturating_sub(BITS - 1) / 2) as u8;
            index += last + 1 - row;
        }
        (self.row, self.pivot) = (0, 0);
        self.information = 0;
        self.stage = Stage::Load;
    }

    fn load(&mut self, copy: &Sums, last: u8) {
        let (row, last, mut number) = (usize::from(self.row), usize::from(last), usize::from(self.offset));
        let mine = u32::from(self.scales[row & 7]);
        for column in row..last + 1 {
            let shift = mine + u32::from(self.scales[column & 7]);
            self.matrix[(row * 8 + column) & 63] = saturated_to_32(element(copy, number) >> (shift & 63));
            number += 1;
        }
        self.offset = number as u16;
        self.own[row & 7] = self.matrix[(row * 9) & 63];
        self.row += 1;
        if row == last {
            self.stage = Stage::Pivot;
        }
    }

    fn divide(&mut self, last: u8) {
        let k = self.pivot;
        if k == last {
            self.stage = Stage::Bound;
            return;
        }
        let diagonal = self.matrix[at(k, k)];
        if k == 1 {
            // What the nuisance alone leaves: the same number for each hypothesis that has it.
            let double = 2 * i32::from(self.scales[usize::from(last) & 7]);
            self.none = shifted(i64::from(self.matrix[at(last, last)].max(0)), double);
        }
        if diagonal <= 0 || diagonal <= self.own[usize::from(k) & 7] >> thresholds::DEPENDENT_BITS {
            self.information = 0;
            self.pivot += 1;
            return;
        }
        let left = diagonal.leading_zeros().saturating_sub(2).min(29);
        self.right = (29 - left) as u8;
        self.reciprocal = reciprocal((diagonal as u32) << left);
        self.information = diagonal;
        (self.row, self.column) = (k + 1, k + 1);
        self.stage = Stage::Eliminate;
    }

    /// Returns the pivot for divisions.
    #[inline(always)]
    fn divisor(&self) -> Divisor {
        Divisor { reciprocal: self.reciprocal, right: self.right }
    }

    fn eliminate(&mut self, last: u8) {
        let (divisor, last) = (self.divisor(), u32::from(last));
        let (k, mut i, mut j) = (u32::from(self.pivot), u32::from(self.row), u32::from(self.column));
        let at = |row: u32, column: u32| (row * 8 + column) as usize & 63;
        for _ in 0..EACH {
            let product = i64::from(self.matrix[at(k, i)]) * i64::from(self.matrix[at(k, j)]);
            let new = i64::from(self.matrix[at(i, j)]) - divisor.quotient(product);
            self.matrix[at(i, j)] = saturated_to_32(new);
            if j < last {
                j += 1;
            } else if i < last {
                i += 1;
                j = i;
            } else {
                self.pivot += 1;
                self.stage = Stage::Pivot;
                return;
            }
        }
        (self.row, self.column) = (i as u8, j as u8);
    }

    fn bound(&mut self, config: &Config, last: u8) {
        let k = last - 1;
        let (mine, energy) = (self.scales[usize::from(k) & 7], self.scales[usize::from(last) & 7]);
        self.free = i64::from(self.matrix[at(last, last)].max(0));
        self.left = self.free;
        let exponent = i32::from(energy) - i32::from(mine);
        let mut numerator = 0;
        if self.information > 0 {
            numerator = self.matrix[at(k, last)];
            let (lowest, highest) = config.bounds.get(usize::from(self.hypothesis)).copied().unwrap_or((0, 0));
            let end = |size: i32| shifted((i64::from(size) * i64::from(self.information)) >> 16, -exponent);
            let outside = (i64::from(numerator) - end(highest)).max(end(lowest) - i64::from(numerator)).max(0);
            let outside = i64::from(saturated_to_32(outside)) >> 1;
            // The fit with the size at the nearer end of what is possible.
            self.left += self.divisor().quotient(outside * outside) << 2;
        }
        self.now = Size { numerator, denominator: self.information, exponent: exponent as i8, scale: mine };
        self.stage = Stage::Record;
    }

    fn record(&mut self, hypothesis: &Hypothesis) {
        let energy = i32::from(self.now.exponent) + i32::from(self.now.scale);
        let left = shifted(self.left, 2 * energy);
        for ((inner, _), unbounded) in NESTED.into_iter().zip(&mut self.unbounded) {
            if inner == hypothesis.cause {
                *unbounded = shifted(self.free, 2 * energy);
            }
        }
        let cause = hypothesis.cause as u8;
        let entry = self.least.get_mut(usize::from(cause)).zip(self.sizes.get_mut(usize::from(cause)));
        if let Some((least, size)) = entry
            && left <= *least
        {
            (*least, *size) = (left, self.now);
        }
        if left <= self.least.get(usize::from(self.best)).copied().unwrap_or(i64::MAX) {
            self.best = cause;
        }
        self.hypothesis += 1;
        self.stage = if usize::from(self.hypothesis) == HYPOTHESES.len() { Stage::Bar } else { Stage::Scale };
    }

    /// Returns the energy of the best hypothesis, the number of blocks in the same unit, and the energy to be explained.
    #[inline(always)]
    fn energies_now(&self) -> (i64, i64, i64) {
        let floor = i64::from(self.blocks) << 20;
        let least = self.least.get(usize::from(self.best)).copied().unwrap_or(0);
        (least, floor, (self.none - floor).max(0))
    }

    fn judge(&mut self, config: &Config, released: bool) {
        match self.stage {
            Stage::Bar => {
                let (least, floor, total) = self.energies_now();
                let excess = (total >> thresholds::RIVAL_ERROR_BITS)
                    .max(thresholds::RIVAL_RATIO * (least - floor))
                    .max(self.doubted);
                self.bar = least.max(floor) + config.margin + excess;
                // Above what the best one leaves: it is among them.
                (self.row, self.rivals) = (0, 0);
                self.stage = Stage::Rivals;
            }
            Stage::Rivals => {
                if self.least.get(usize::from(self.row)).is_some_and(|left| *left < self.bar) {
                    self.rivals |= 1 << (self.row & 31);
                }
                self.next(Stage::Contain);
            }
            Stage::Contain => {
                for ((inner, outer), unbounded) in NESTED.into_iter().zip(self.unbounded) {
                    // A size of the first that is impossible is no reason for the second.
                    let fits = match inner {
                        Cause::SensorSaturation => released && self.rivals & 1 << inner as u32 != 0,
                        _ => unbounded < self.bar,
                    };
                    if fits {
                        self.rivals &= !(1 << outer as u32);
                    }
                }
                (self.row, self.first, self.second) = (0, (i64::MAX, None), (i64::MAX, None));
                self.stage = Stage::Pick;
            }
            Stage::Pick => {
                let known = self.least.get(usize::from(self.row)).zip(Cause::ALL.get(usize::from(self.row)));
                if self.rivals & 1 << (self.row & 31) != 0
                    && let Some((left, cause)) = known
                {
                    if *left < self.first.0 {
                        self.second = self.first;
                        self.first = (*left, Some(*cause));
                    } else if *left < self.second.0 {
                        self.second = (*left, Some(*cause));
                    }
                }
                self.next(Stage::Conclude);
            }
            _ => self.conclude(config),
        }
    }

    /// Goes on to the next cause, and after the last one to `stage`.
    fn next(&mut self, stage: Stage) {
        self.row += 1;
        if usize::from(self.row) == CAUSES {
            self.stage = stage;
        }
    }

    fn conclude(&mut self, config: &Config) {
        let (least, floor, total) = self.energies_now();
        // What the cause leaves that would be named, which need not be the one that leaves least.
        let left = self.first.1.map_or(least, |_| self.first.0);
        // sqrt(2 n) with 20 fraction bits.
        let sigma = i64::from(((2 * self.blocks) << 18).isqrt()) << 11;
        let tolerated = thresholds::NOISE_SIGMAS * sigma + (total >> thresholds::MODEL_ERROR_BITS) + self.doubted;
        let says = if total < config.margin + self.doubted {
            Verdict::Alarm
        } else if left - floor > tolerated {
            Verdict::Unknown
        } else {
            match (self.first.1, self.second.1) {
                (Some(cause), None) => Verdict::Named(cause),
                (Some(cause), Some(rival)) => Verdict::Ambiguous(cause, rival),
                (None, _) => Verdict::Unknown,
            }
        };
        self.agreed = if says.is_like(self.proposed) { self.agreed.saturating_add(1) } else { 1 };
        self.against = if says.is_like(self.verdict) { 0 } else { self.against.saturating_add(1) };
        if self.agreed >= thresholds::AGREED {
            self.verdict = says;
        } else if self.against >= thresholds::AGREED && matches!(self.verdict, Verdict::Named(_)) {
            self.verdict = Verdict::Alarm;
        }
        self.proposed = says;
        if let Some(cause) = self.verdict.causes().0 {
            self.size = self.sizes.get(cause as usize).copied().unwrap_or_default();
        }
        (self.energies, self.decided) = ((self.none, left), self.blocks);
        self.rounds = self.rounds.wrapping_add(1);
        self.stage = Stage::Idle;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isolation::Settings;
    use crate::isolation::products::Products;
    use crate::units::SampleTime;
    use crate::validated::Validate;

    /// One variance.
    const ONE: i64 = 1 << 20;

    /// Returns the verdict of as many equal decisions as have to agree, on 50 blocks: where `total` variances are to be explained, of which
    /// an error of the model may be `doubted`, and the causes leave so much more than the noise.
    fn verdict(total: i64, doubted: i64, left: &[(Cause, i64)]) -> Verdict {
        verdict_of(total, doubted, left, [i64::MAX; NESTED.len()], false)
    }

    /// Returns the verdict where the causes of [`NESTED`] that others contain leave `unbounded` whatever their size is.
    fn verdict_of(
        total: i64,
        doubted: i64,
        left: &[(Cause, i64)],
        unbounded: [i64; NESTED.len()],
        released: bool,
    ) -> Verdict {
        let config = Settings::PAPER.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap().quantize();
        let (mut decision, copy, noise) = (Decision::NEW, Products::NEW.copy, 50 * ONE);
        for _ in 0..thresholds::AGREED {
            decision.begin(50, doubted);
            (decision.stage, decision.hypothesis, decision.none) = (Stage::Bar, HYPOTHESES.len() as u8, noise + total);
            for (cause, left) in left {
                decision.least[*cause as usize] = noise + left;
            }
            decision.unbounded = unbounded;
            decision.best = left.iter().min_by_key(|(_, left)| left).unwrap().0 as u8;
            // Each cause twice, and three more.
            for step in 0..2 * CAUSES + 3 {
                assert!(!decision.idle(), "after {step} steps");
                decision.step(&config, &copy, released);
            }
            assert!(decision.idle());
        }
        decision.verdict
    }

    /// A cause is named that leaves no more than noise and a linear signature can leave, if there is something to be explained; each rival
    /// that does not leave much more makes it ambiguous, and of causes that leave the same the first is named first.
    #[test]
    fn a_cause_is_named_up_to_the_thresholds() {
        use Cause::{Delay, Drift, GainError};
        let (gain, margin) = (Verdict::Named(GainError), 20 * ONE);
        let exact = [(GainError, 0)];
        assert_eq!([margin - 1, margin].map(|total| verdict(total, 0, &exact)), [Verdict::Alarm, gain]);
        let doubted = 7 * ONE;
        assert_eq!(
            [margin - 1, margin].map(|total| verdict(total + 2 * doubted, doubted, &exact)),
            [Verdict::Alarm, gain]
        );
        // Five deviations of the noise, sqrt(2 * 50), and 2^-7 of the total.
        let most = 60 * ONE;
        assert_eq!([most, most + 1].map(|left| verdict(1280 * ONE, 0, &[(GainError, left)])), [gain, Verdict::Unknown]);
        // The margin and 2^-10 of the total.
        let least = margin + ONE;
        let rival = |left| verdict(1024 * ONE, 0, &[(GainError, 0), (Drift, left)]);
        assert_eq!([least - 1, least].map(rival), [Verdict::Ambiguous(GainError, Drift), gain]);
        let equal = [(Delay, 0), (Drift, 0)];
        assert_eq!(verdict(1024 * ONE, 0, &equal), Verdict::Ambiguous(Delay, Drift));
        let equal = [(GainError, 0), (Delay, ONE), (Drift, ONE)];
        assert_eq!(verdict(1024 * ONE, 0, &equal), Verdict::Ambiguous(GainError, Delay));
    }

    /// A law contains every gain, and is named if no gain fits, whatever its size. Of the causes of identical readings the first is certain
    /// only if a reading has been released.
    #[test]
    fn a_cause_that_contains_another_is_named_only_if_that_does_not_fit() {
        use Cause::{SensorSaturation, StaticNonlinearity, StuckSensor};
        // Noise, margin and 2^-10 of the total.
        let bar = (50 + 20 + 1) * ONE;
        let unbounded = |gain| NESTED.map(|(inner, _)| if inner == Cause::GainError { gain } else { i64::MAX });
        let law = |gain| verdict_of(1024 * ONE, 0, &[(StaticNonlinearity, 0)], unbounded(gain), false);
        assert_eq!([bar - 1, bar].map(law), [Verdict::Unknown, Verdict::Named(StaticNonlinearity)]);
        let pinned = |left: &[(Cause, i64)], released| verdict_of(1024 * ONE, 0, left, unbounded(i64::MAX), released);
        let both = [(SensorSaturation, 0), (StuckSensor, 0)];
        assert_eq!(pinned(&both, true), Verdict::Named(SensorSaturation));
        assert_eq!(pinned(&both, false), Verdict::Ambiguous(SensorSaturation, StuckSensor));
        assert_eq!(pinned(&both[1..], true), Verdict::Named(StuckSensor));
    }

    /// In variances: the scale of the innovation, the last vector, is taken back.
    #[test]
    fn the_energy_without_a_cause_is_what_the_nuisance_leaves() {
        for last in 2..=5 {
            let mut decision = Decision { pivot: 1, scales: [1; 8], ..Decision::NEW };
            decision.scales[usize::from(last)] = 3;
            decision.matrix[at(last, last)] = 5;
            decision.divide(last);
            assert_eq!(decision.none, 5 << 6, "{last} vectors");
        }
    }

    /// A shift to the left saturates, and one to the right rounds down, however far it goes.
    #[test]
    fn a_shift_goes_either_way() {
        assert_eq!([-2, -1, 0, 1, 2].map(|by| shifted(-6, by)), [-2, -3, -6, -12, -24]);
        assert_eq!([-100, -63].map(|by| (shifted(i64::MAX, by), shifted(i64::MIN, by))), [(0, -1); 2]);
        assert_eq!([1, 61].map(|by| shifted(i64::MAX, by)), [i64::MAX - 1, 3 << 61]);
        for (value, by) in [(i64::MAX, 0), (i64::MIN, 1), (0x0123_4567_89ab_cdef, 16), (-0x0123_4567_89ab_cdef, 31)] {
            assert_eq!(shifted_right(value, by), value >> by);
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn a_reciprocal_is_that_of_a_long_division() {
        let ends = [1 << 29, (1 << 29) + 1, (1 << 30) - 1, (1 << 30) - (1 << 14), (1 << 29) + (1 << 14) - 1];
        for mantissa in ((1 << 29)..(1 << 30)).step_by(997).chain(ends) {
            assert_eq!(i64::from(reciprocal(mantissa)), (1 << 59) / i64::from(mantissa), "{mantissa}");
        }
    }
}
