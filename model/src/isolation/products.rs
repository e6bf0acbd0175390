//! The products of the whitened vectors of each hypothesis with each other and with the innovation, summed over blocks. A product
//! that several hypotheses have is summed once.

use super::SLOTS;
use super::bank::{HYPOTHESES, VECTORS};

/// Number of products that one tick adds.
const EACH: usize = 8;
const _: () = assert!(EACH.is_multiple_of(2), "they are added in pairs");
/// Number of elements of the matrices of all hypotheses: of each the upper triangle, row by row, the innovation as its last vector.
const ELEMENTS: usize = elements();
/// Number of ticks that the products of a block take.
pub(super) const STEPS: usize = distinct().2.div_ceil(EACH);
/// The different products of two vectors, in the order of the steps.
pub(super) type Table<T> = [[T; EACH]; STEPS];

/// The vectors of each product.
static PAIRS: Table<(u8, u8)> = pairs();
/// Product of each element of the matrices.
static PLACES: [u8; ELEMENTS] = distinct().1;

/// Returns the number of products of a hypothesis with `vectors` vectors.
pub(super) const fn size(vectors: usize) -> usize {
    (vectors + 1) * (vectors + 2) / 2
}

const fn elements() -> usize {
    let (mut index, mut total) = (0, 0);
    while index < HYPOTHESES.len() {
        total += size(HYPOTHESES[index].vectors.len());
        index += 1;
    }
    total
}

/// Returns the different pairs of vectors, the place of each element's pair among them, and their number.
const fn distinct() -> ([(u8, u8); ELEMENTS], [u8; ELEMENTS], usize) {
    let (mut list, mut places, mut count) = ([(0, 0); ELEMENTS], [0; ELEMENTS], 0);
    let (mut element, mut index) = (0, 0);
    while index < HYPOTHESES.len() {
        let vectors = HYPOTHESES[index].vectors;
        let mut i = 0;
        while i <= vectors.len() {
            let mut j = i;
            while j <= vectors.len() {
                let first = if i < vectors.len() { vectors[i] } else { VECTORS } as u8;
                let second = if j < vectors.len() { vectors[j] } else { VECTORS } as u8;
                let mut place = 0;
                while place < count && !(list[place].0 == first && list[place].1 == second) {
                    place += 1;
                }
                if place == count {
                    list[count] = (first, second);
                    count += 1;
                }
                places[element] = place as u8;
                element += 1;
                j += 1;
            }
            i += 1;
        }
        index += 1;
    }
    assert!(count <= 256, "a place is an u8");
    (list, places, count)
}

const fn pairs() -> Table<(u8, u8)> {
    let ((all, _, count), mut table, mut index) = (distinct(), [[(0, 0); EACH]; STEPS], 0);
    while index < count {
        table[index / EACH][index % EACH] = all[index];
        index += 1;
    }
    table
}

/// Returns the sum of an element's product; 0 if there is no such element.
#[inline(always)]
pub(super) fn element(sums: &Table<i64>, number: usize) -> i64 {
    let place = PLACES.get(number).copied().unwrap_or(0) as usize;
    sums.get(place / EACH).map_or(0, |row| row[place % EACH])
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
    sums: Table<i64>,
    pub(super) copy: Table<i64>,
}

impl Products {
    /// Before the first block.
    pub(super) const NEW: Self = Self { sums: [[0; EACH]; STEPS], copy: [[0; EACH]; STEPS] };

    /// Adds the products of one step.
    #[inline(never)]
    pub(super) fn step(&mut self, step: u32, mode: Mode, whitened: &[i32; SLOTS]) {
        let step = step as usize;
        let rows = self.sums.get_mut(step).zip(self.copy.get_mut(step)).zip(PAIRS.get(step));
        let Some(((sums, copy), pairs)) = rows else { return };
        if mode.fresh {
            *sums = [0; EACH];
        }
        let product = |(i, j): (u8, u8)| {
            i64::from(whitened[usize::from(i) & (SLOTS - 1)]) * i64::from(whitened[usize::from(j) & (SLOTS - 1)])
        };
        // Two in each round: the MCU's compiler does not unroll the loop.
        for ([one, other], [first, second]) in sums.as_chunks_mut().0.iter_mut().zip(pairs.as_chunks().0) {
            *one += product(*first);
            *other += product(*second);
        }
        if mode.copy {
            *copy = *sums;
        }
        if mode.halve {
            sums.iter_mut().for_each(|sum| *sum >>= 1);
        }
    }
}
