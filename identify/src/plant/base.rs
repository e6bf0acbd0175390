//! The plant under examination, as read from a plant file: the model without any effect.

use anyhow::Result;
use model::Plant;

use crate::plant::chain::Chain;
use crate::plant::play_bank::PlayBank;
use crate::plant::relaxation::Relaxation;
use crate::record::normalisation::Normalisation;
use simulation::bad_input;
use simulation::plant_file::PlantFile;

/// The chain of a plant file.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    file: PlantFile,
    /// Relaxation of the plant file, which effects may change.
    pub relaxation: Relaxation,
}

impl Base {
    /// Returns the plant of the source report.
    pub fn paper() -> Self {
        let Plant { share, time_constant_s } = Plant::PAPER;
        Self { file: Plant::PAPER.into(), relaxation: Relaxation::plain(share, time_constant_s) }
    }

    /// Returns the chain of a plant file.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if the loading curve of the file's hysteresis decreases anywhere, for which
    /// no second bank of play operators can be composed with it.
    pub fn new(file: PlantFile) -> Result<Self> {
        if !PlayBank::of(file.memory.as_ref()).is_monotonic() {
            bad_input!(
                "--plant: [memory] with a decreasing loading curve; expected direct >= 0, also after adding the weights in order"
            );
        }
        let relaxation = Relaxation::of(&file);
        Ok(Self { file, relaxation })
    }

    /// Returns the same plant in the coordinates of a record.
    pub fn normalised(&self, normalisation: &Normalisation) -> Self {
        let file = normalisation.plant(&self.file);
        Self { relaxation: Relaxation::of(&file), file }
    }

    /// Returns, for each optional part that the file has, the part's name and the same plant without it.
    pub fn without_each(&self) -> impl Iterator<Item = (&'static str, Self)> {
        type Take = fn(&mut PlantFile) -> bool;
        let parts: [(&str, Take); 6] = [
            ("memory", |file| file.memory.take().is_some()),
            ("law", |file| file.law.take().is_some()),
            ("leakage", |file| file.leakage.take().is_some()),
            ("amplifier", |file| file.amplifier.take().is_some()),
            // One that is the same as at 0 V is no part of the spring.
            ("relaxation.tau_high_s", |file| {
                file.relaxation.tau_high_s.take().is_some_and(|high_s| high_s != file.relaxation.tau_s[0])
            }),
            ("relaxation.weights", |file| {
                file.relaxation.tau_s.truncate(1);
                !std::mem::take(&mut file.relaxation.weights).is_empty()
            }),
        ];
        parts.into_iter().filter_map(|(part, take)| {
            let mut file = self.file.clone();
            let there = take(&mut file);
            there.then(|| (part, Self { relaxation: Relaxation::of(&file), file }))
        })
    }

    /// Returns the plant file.
    pub fn file(&self) -> &PlantFile {
        &self.file
    }

    /// Returns the chain from command to stiffness.
    pub fn chain(&self) -> Chain<'_> {
        Chain::of(&self.file, self.relaxation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_constant_that_is_the_same_at_high_voltage_is_no_part() {
        let parts = |tau_high_s: Option<f64>| {
            let mut file = PlantFile::from(Plant::PAPER);
            file.relaxation.tau_high_s = tau_high_s;
            Base::new(file).unwrap().without_each().map(|(part, _)| part).collect::<Vec<_>>()
        };
        let tau_s = Plant::PAPER.time_constant_s;
        assert!(parts(None).is_empty() && parts(Some(tau_s)).is_empty());
        assert_eq!(parts(Some(2.0 * tau_s)), ["relaxation.tau_high_s"]);
    }
}
