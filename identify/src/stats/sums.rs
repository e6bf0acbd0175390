//! Sums over rows in independent partial sums, which the compiler can vectorise.

const PARTS: usize = 8;

/// Returns the scalar product over the length of the shorter slice.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    let ((a, a_rest), (b, b_rest)) = (a[..length].as_chunks::<PARTS>(), b[..length].as_chunks::<PARTS>());
    let mut sums = [0.0; PARTS];
    for (a, b) in a.iter().zip(b) {
        for part in 0..PARTS {
            sums[part] += a[part] * b[part];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

/// Returns the sum of a function of each item.
#[inline]
pub(crate) fn total<T>(items: &[T], of: impl Fn(&T) -> f64) -> f64 {
    let (chunks, rest) = items.as_chunks::<PARTS>();
    let mut sums = [0.0; PARTS];
    for chunk in chunks {
        for part in 0..PARTS {
            sums[part] += of(&chunk[part]);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(of).sum::<f64>()
}
