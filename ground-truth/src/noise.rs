//! Measurement noise of a given standard deviation: white, autocorrelated or heavy-tailed.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use serde::Serialize;

/// Noise on the readings of a record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Kind of the noise.
    pub kind: Kind,
    /// Standard deviation, in V.
    pub sigma_v: f64,
}

/// Kinds of measurement noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Independent Gaussian noise.
    White,
    /// First-order autoregressive noise, x_k = phi x_(k-1) + e_k, with phi between 0.5 and 0.95.
    Coloured,
    /// 1/f noise: equal power in every octave of the period, from two readings to about a thousand.
    OneOverF,
    /// Independent noise by Student's t distribution with 3 degrees of freedom.
    HeavyTailed,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::White, Self::Coloured, Self::OneOverF, Self::HeavyTailed];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Coloured => "coloured, AR(1)",
            Self::OneOverF => "coloured, 1/f",
            Self::HeavyTailed => "heavy-tailed",
        }
    }
}

impl Noise {
    /// White noise with a standard deviation of `percent` of 500 V.
    pub fn white(percent: f64) -> Self {
        Self { kind: Kind::White, sigma_v: 5.0 * percent }
    }

    /// Noise of another kind with the same standard deviation.
    pub fn of(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }

    /// Draws `rows` values, in V.
    pub fn draw(self, random: &mut ChaCha8Rng, rows: usize) -> Vec<f64> {
        let mut unit = match self.kind {
            Kind::White => normals(random, rows),
            Kind::Coloured => {
                let phi = random.random_range(0.5..0.95);
                autoregressive(random, rows, phi)
            }
            Kind::OneOverF => {
                // A sum of Lorentzian spectra an octave apart is 1/f between the fastest and the slowest.
                const OCTAVES: i32 = 8;
                let mut sum = vec![0.0; rows];
                for octave in 0..OCTAVES {
                    let part = autoregressive(random, rows, (-0.5f64.powi(octave)).exp());
                    sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part / f64::from(OCTAVES).sqrt());
                }
                sum
            }
            Kind::HeavyTailed => {
                // The variance of this distribution is 3.
                let student = StudentT::new(3.0).expect("3 is positive");
                student.sample_iter(random).take(rows).map(|x: f64| x / 3f64.sqrt()).collect()
            }
        };
        unit.iter_mut().for_each(|x| *x *= self.sigma_v);
        unit
    }
}

fn normals(random: &mut ChaCha8Rng, rows: usize) -> Vec<f64> {
    StandardNormal.sample_iter(random).take(rows).collect()
}

/// Stationary x_k = phi x_(k-1) + e_k of variance 1.
fn autoregressive(random: &mut ChaCha8Rng, rows: usize, phi: f64) -> Vec<f64> {
    let mut x = normals(random, rows);
    let fresh = (1.0 - phi * phi).sqrt();
    for k in 1..rows {
        x[k] = phi * x[k - 1] + fresh * x[k];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn every_kind_has_its_standard_deviation_and_autocorrelation() {
        for kind in Kind::ALL {
            let noise = Noise::white(0.2).of(kind).draw(&mut ChaCha8Rng::seed_from_u64(1), 200_000);
            let product =
                |lag: usize| noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b).sum::<f64>() / noise.len() as f64;
            let (variance, next) = (product(0), product(1));
            let tolerance = if kind == Kind::HeavyTailed { 0.3 } else { 0.1 };
            assert!((variance - 1.0).abs() < tolerance, "{kind:?}: {variance}");
            let coloured = matches!(kind, Kind::Coloured | Kind::OneOverF);
            assert_eq!(next / variance > 0.4, coloured, "{kind:?}: {next}");
        }
    }
}
