//! The products of the whitened vectors of each hypothesis with each other and with the innovation, summed over blocks.

use super::SLOTS;
use super::bank::{HYPOTHESES, VECTORS};

/// Number of products that one tick adds.
const EACH: usize = 6;
/// Number of products of all hypotheses.
pub(super) const PRODUCTS: usize = count();
/// Number of ticks that the products of a block take.
pub(super) const STEPS: u32 = PRODUCTS.div_ceil(EACH) as u32;

/// The vectors of each product: row by row the upper triangle of each hypothesis's matrix, the innovation as its last vector.
static PAIRS: [(u8, u8); PRODUCTS] = pairs();

/// Returns the number of products of a hypothesis with `vectors` vectors.
pub(super) const fn size(vectors: usize) -> usize {
    (vectors + 1) * (vectors + 2) / 2
}

const fn count() -> usize {
    let (mut index, mut total) = (0, 0);
    while index < HYPOTHESES.len() {
        total += size(HYPOTHESES[index].vectors.len());
        index += 1;
    }
    total
}

const fn pairs() -> [(u8, u8); PRODUCTS] {
    let (mut list, mut next, mut index) = ([(0, 0); PRODUCTS], 0, 0);
    while index < HYPOTHESES.len() {
        let vectors = HYPOTHESES[index].vectors;
        let mut i = 0;
        while i <= vectors.len() {
            let mut j = i;
            while j <= vectors.len() {
                let first = if i < vectors.len() { vectors[i] } else { VECTORS };
                let second = if j < vectors.len() { vectors[j] } else { VECTORS };
                list[next] = (first as u8, second as u8);
                next += 1;
                j += 1;
            }
            i += 1;
        }
        index += 1;
    }
    list
}

/// What happens to the sums with the present block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mode {
    /// The sums start with this block.
    pub(super) fresh: bool,
    /// The sums are halved after this block.
    pub(super) halve: bool,
    /// The sums are copied for a decision.
    pub(super) copy: bool,
}

impl Mode {
    /// The sums go on.
    pub(super) const NEW: Self = Self { fresh: false, halve: false, copy: false };
}

/// Sums of the products, in variances with 20 fraction bits, and their copy for a decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Products {
    sums: [i64; PRODUCTS],
    pub(super) copy: [i64; PRODUCTS],
}

impl Products {
    /// Before the first block.
    pub(super) const NEW: Self = Self { sums: [0; PRODUCTS], copy: [0; PRODUCTS] };

    /// Adds the products of one step.
    #[inline(never)]
    pub(super) fn step(&mut self, step: u32, mode: Mode, whitened: &[i32; SLOTS]) {
        let first = step as usize * EACH;
        let (Some(sums), Some(pairs)) = (self.sums.get_mut(first..), PAIRS.get(first..)) else { return };
        for (sum, (i, j)) in sums.iter_mut().zip(pairs).take(EACH) {
            let (i, j) = (usize::from(*i) & (SLOTS - 1), usize::from(*j) & (SLOTS - 1));
            let before = if mode.fresh { 0 } else { *sum };
            *sum = before + i64::from(whitened[i]) * i64::from(whitened[j]);
        }
        if mode.copy
            && let Some(copy) = self.copy.get_mut(first..)
        {
            copy.iter_mut().zip(&*sums).take(EACH).for_each(|(copy, sum)| *copy = *sum);
        }
        if mode.halve {
            sums.iter_mut().take(EACH).for_each(|sum| *sum >>= 1);
        }
    }
}
