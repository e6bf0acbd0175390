//! What rides on every reading: white, coloured and heavy-tailed noise of a given standard deviation.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use serde::Serialize;

/// Noise on the readings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Its kind.
    pub kind: Kind,
    /// Standard deviation in V.
    pub sigma_v: f64,
}

/// Kinds of noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Gaussian, every reading for itself.
    White,
    /// x_k = phi x_(k-1) + e_k, phi between 0.5 and 0.95.
    Coloured,
    /// As much in every octave, from two readings to about a thousand.
    OneOverF,
    /// Student's t of 3 degrees of freedom, every reading for itself.
    HeavyTailed,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::White, Self::Coloured, Self::OneOverF, Self::HeavyTailed];

    /// For tables.
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
    /// Gaussian, of that many percent of 500 V.
    pub fn white(percent: f64) -> Self {
        Self { kind: Kind::White, sigma_v: 5.0 * percent }
    }

    /// Of another kind, as strong.
    pub fn of(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }

    /// `rows` readings of it, in V.
    pub fn draw(self, random: &mut ChaCha8Rng, rows: usize) -> Vec<f64> {
        let mut unit = match self.kind {
            Kind::White => normals(random, rows),
            Kind::Coloured => {
                let phi = random.random_range(0.5..0.95);
                autoregressive(random, rows, phi)
            }
            Kind::OneOverF => {
                // Lorentzians an octave apart add up to 1/f between the fastest and the slowest.
                const OCTAVES: i32 = 8;
                let mut sum = vec![0.0; rows];
                for octave in 0..OCTAVES {
                    let part = autoregressive(random, rows, (-0.5f64.powi(octave)).exp());
                    sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part / f64::from(OCTAVES).sqrt());
                }
                sum
            }
            Kind::HeavyTailed => {
                // Its variance is 3.
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

/// x_k = phi x_(k-1) + e_k of variance 1, from the start.
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
    fn every_kind_is_as_strong_as_asked_and_coloured_as_named() {
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
