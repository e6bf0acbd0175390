//! The simulation that is judged, as a plant file has it: the blocks that are there before any cause is looked for.

use anyhow::Result;
use model::Plant;

use super::bank::Bank;
use super::chain::Chain;
use super::relaxation::Relaxation;
use crate::bad_input;
use crate::plant_file::PlantFile;

/// A plant file's chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    file: PlantFile,
    /// Its relaxation, which causes may change.
    pub relaxation: Relaxation,
}

impl Base {
    /// The paper's plant.
    pub fn paper() -> Self {
        let Plant { share, time_constant_s } = Plant::PAPER;
        Self { file: Plant::PAPER.into(), relaxation: Relaxation::plain(share, time_constant_s) }
    }

    /// The chain of a plant file.
    ///
    /// # Errors
    /// [`crate::BadInput`] for one with a memory that no other can stand behind.
    pub fn new(file: PlantFile) -> Result<Self> {
        if !Bank::of(file.memory.as_ref()).rises() {
            bad_input!(
                "--plant: memory that falls as the voltage rises; expected direct >= 0, also with the weights added to it"
            );
        }
        let relaxation = Relaxation::of(&file.relaxation);
        Ok(Self { file, relaxation })
    }

    /// The file, to be extended.
    pub fn file(&self) -> &PlantFile {
        &self.file
    }

    /// What runs.
    pub fn chain(&self) -> Chain<'_> {
        Chain::of(&self.file, self.relaxation)
    }
}
