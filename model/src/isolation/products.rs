//! The products of the whitened vectors of each hypothesis with each other and with the innovation, summed over blocks. A product
//! that several hypotheses have is summed once.

use super::SLOTS;
use super::bank::{HYPOTHESES, INITIAL, VECTORS};

/// Number of products that one tick adds: three of each vector, or as many of two vectors.
const EACH: usize = 12;
/// Number of blocks whose products are added together: each sum is then loaded and stored once in as many blocks.
pub(super) const GROUP: usize = 4;
/// Whitened values of the blocks of a group, by vector.
pub(super) type Whitened = [[i32; GROUP]; SLOTS];
/// Number of ticks that take the products of each vector, the innovation included, with the nuisance, itself and the innovation.
const OWN_STEPS: usize = (VECTORS + 1).div_ceil(EACH / 3);
/// Number of elements of the matrices of all hypotheses: of each the upper triangle, row by row, the innovation as its last vector.
const ELEMENTS: usize = elements();
/// Number of ticks that take the products of two other vectors.
const CROSS_STEPS: usize = distinct().2.div_ceil(EACH);
/// Number of ticks that the products of a group take.
pub(super) const STEPS: usize = OWN_STEPS + CROSS_STEPS;
/// The sum of each product, in the order of the steps.
pub(super) type Sums = [i64; STEPS * EACH];

/// The vectors of each product of two others.
static PAIRS: [[(u8, u8); EACH]; CROSS_STEPS] = pairs();
/// Place of each element of the matrices among the sums.
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

/// Returns the different products of two other vectors, the place of each element among the sums, and the number of the first.
const fn distinct() -> ([(u8, u8); ELEMENTS], [u8; ELEMENTS], usize) {
    let (mut list, mut places, mut count) = ([(0, 0); ELEMENTS], [0; ELEMENTS], 0);
    let (mut element, mut index) = (0, 0);
    while index < HYPOTHESES.len() {
        let vectors = HYPOTHESES[index].vectors;
        let mut i = 0;
        while i <= vectors.len() {
            let mut j = i;
            while j <= vectors.len() {
                let first = if i < vectors.len() { vectors[i] } else { VECTORS };
                let second = if j < vectors.len() { vectors[j] } else { VECTORS };
                let place = if first == second {
                    3 * first + 1
                } else if second == VECTORS {
                    3 * first + 2
                } else if first == INITIAL {
                    3 * second
                } else {
                    let (first, second, mut place) = (first as u8, second as u8, 0);
                    while place < count && !(list[place].0 == first && list[place].1 == second) {
                        place += 1;
                    }
                    if place == count {
                        list[count] = (first, second);
                        count += 1;
                    }
                    OWN_STEPS * EACH + place
                };
                assert!(place < 256, "a place is an u8");
                places[element] = place as u8;
                element += 1;
                j += 1;
            }
            i += 1;
        }
        index += 1;
    }
    (list, places, count)
}

const fn pairs() -> [[(u8, u8); EACH]; CROSS_STEPS] {
    let (all, mut table, mut index) = (distinct().0, [[(0, 0); EACH]; CROSS_STEPS], 0);
    while index < CROSS_STEPS * EACH {
        table[index / EACH][index % EACH] = all[index];
        index += 1;
    }
    table
}

/// Returns the sum of an element's product; 0 if there is no such element.
#[inline(always)]
pub(super) fn element(sums: &Sums, number: usize) -> i64 {
    PLACES.get(number).and_then(|place| sums.get(usize::from(*place))).copied().unwrap_or(0)
}

/// Returns the sum of the products of two vectors over the blocks of a group.
#[inline(always)]
fn product(one: &[i32; GROUP], other: &[i32; GROUP]) -> i64 {
    let block = |block: usize| i64::from(one[block]) * i64::from(other[block]);
    block(0) + block(1) + block(2) + block(3)
}

/// What happens to the sums with the present group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mode {
    /// The sums start with this group.
    pub(super) fresh: bool,
    /// The sums are halved after this group.
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
    sums: Sums,
    pub(super) copy: Sums,
}

impl Products {
    /// Before the first block.
    pub(super) const NEW: Self = Self { sums: [0; STEPS * EACH], copy: [0; STEPS * EACH] };

    /// Adds the products of one step.
    #[inline(never)]
    pub(super) fn step(&mut self, step: u32, mode: Mode, whitened: &Whitened) {
        let step = step as usize;
        let (sums, copy) = (self.sums.as_chunks_mut::<EACH>().0, self.copy.as_chunks_mut::<EACH>().0);
        let Some((sums, copy)) = sums.get_mut(step).zip(copy.get_mut(step)) else { return };
        if mode.fresh {
            *sums = [0; EACH];
        }
        if let Some(pairs) = PAIRS.get(step.wrapping_sub(OWN_STEPS)) {
            for (sum, (i, j)) in sums.iter_mut().zip(pairs) {
                *sum += product(&whitened[usize::from(*i) & (SLOTS - 1)], &whitened[usize::from(*j) & (SLOTS - 1)]);
            }
        } else if let Some(vectors) = whitened.as_chunks::<{ EACH / 3 }>().0.get(step) {
            for ([initial, own, innovation], vector) in sums.as_chunks_mut().0.iter_mut().zip(vectors) {
                *initial += product(vector, &whitened[INITIAL]);
                *own += product(vector, vector);
                *innovation += product(vector, &whitened[VECTORS]);
            }
        }
        if mode.copy {
            *copy = *sums;
        }
        if mode.halve {
            sums.iter_mut().for_each(|sum| *sum >>= 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The elements of a hypothesis are the products of each two of its vectors, the innovation last, row by row; no element and no step
    /// is without a hypothesis.
    #[test]
    fn each_element_is_the_product_of_its_vectors() {
        let (mut products, mut whitened, mut bits) = (Products::NEW, [[0; GROUP]; SLOTS], 7i32);
        for value in whitened.as_flattened_mut() {
            bits = bits.wrapping_mul(69_069).wrapping_add(1);
            *value = bits >> 8;
        }
        (0..STEPS as u32).for_each(|step| products.step(step, Mode { copy: true, ..Mode::NEW }, &whitened));
        let mut number = 0;
        for hypothesis in HYPOTHESES {
            let count = hypothesis.vectors.len();
            let vector = |place: usize| &whitened[hypothesis.vectors.get(place).copied().unwrap_or(VECTORS)];
            for (row, column) in (0..=count).flat_map(|row| (row..=count).map(move |column| (row, column))) {
                let expected = product(vector(row), vector(column));
                assert_eq!(element(&products.copy, number), expected, "{:?}: {row} {column}", hypothesis.cause);
                number += 1;
            }
        }
        assert_eq!(number, ELEMENTS);
        assert_eq!(PLACES.iter().max().map(|place| usize::from(*place) / EACH + 1), Some(STEPS));
    }
}
