//! What is diagnosed: a simulated record in any units, with the nominal spring that it is compared with.

use simulation::plant_file::PlantFile;
use simulation::record::Record;

use crate::ground_truth::LabelledRecord;

/// A record to diagnose, and the nominal spring that it is compared with.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Simulated record with its true effects, in s and V.
    pub hidden: LabelledRecord,
    /// The record that is diagnosed, which may be in other units.
    pub record: Record,
    /// Nominal spring.
    pub nominal: Nominal,
}

/// The nominal spring with which a record is compared.
#[derive(Clone, Debug, PartialEq)]
pub enum Nominal {
    /// The paper's spring.
    Paper,
    /// A spring that is known.
    Known(Box<PlantFile>),
    /// The linear spring that is identified from the same record.
    Identified,
}

impl From<LabelledRecord> for Subject {
    fn from(hidden: LabelledRecord) -> Self {
        Self { record: hidden.record(), hidden, nominal: Nominal::Paper }
    }
}
