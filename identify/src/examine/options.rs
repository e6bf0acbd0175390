//! The options of a diagnosis.

use anyhow::Result;
use simulation::plant_file::PlantFile;
use simulation::units::Units;

use crate::answer::Verdict;
use crate::fit::budget::Effort;
use crate::fit::stop::Stop;
use crate::nominal::{BestLinear, Identified, is_unpredictive};
use crate::plant::base::Base;
use crate::record::input::Input;

/// How a record is read, and with what it is compared.
#[derive(Clone, Debug)]
pub struct Options {
    /// Name of the simulation that is diagnosed, for the report: `paper` or a plant file.
    pub plant: String,
    /// Units in which numbers are shown.
    pub units: Units,
    /// Course of the voltage between rows.
    pub input: Input,
    /// The simulation that is diagnosed.
    pub base: Base,
    /// True if the spring may not have settled when a record begins, even if its first readings show no decay.
    pub unsettled: bool,
    /// True if the simulation was identified from the record that is diagnosed: gain, zero and relaxation are then estimated anew with
    /// every set of causes, as causes that a linear model lacks bias them.
    pub identified: bool,
    /// True for one of several records, whose zero is estimated anew with every set of causes: a fault of it has biased the one of all.
    pub zero_unknown: bool,
    /// True if these readings also show a decay that the voltage does not drive, see [`Identified::decays`].
    pub decays: bool,
    /// An identified spring of lower order that is diagnosed as well: a model of higher order imitates what is not linear.
    pub simpler: Option<Base>,
    /// Root mean square error of the identified spring on held-out segments, in the reading's unit; `None` if it was not identified.
    pub held_out_rmse: Option<f64>,
    /// True if so few readings were identified that no model with a time constant was tried: no cause is searched for, and that the
    /// simulation agrees with them says nothing.
    pub without_dynamics: bool,
    /// True if the identified spring may have no static gain, and a fit to the first 60 % of the readings does not predict the others:
    /// that the simulation agrees with all of them says nothing.
    pub unpredictive: bool,
    /// What the identified spring leaves in doubt, in sentences.
    pub doubts: Vec<String>,
    /// How long causes are searched for.
    pub effort: Effort,
    /// The best linear model of the records, if it is known; it is fitted otherwise.
    pub linear: Option<BestLinear>,
    /// Ends the search early with the best answer so far.
    pub stop: Stop,
}

impl Options {
    /// Returns the options for a diagnosis of a simulation: its plant file, and the name of that for the report.
    ///
    /// # Errors
    /// Those of [`Base::new`].
    pub fn judging_file(self, name: &str, file: PlantFile) -> Result<Self> {
        Ok(Self { plant: name.to_owned(), base: Base::new(file)?, ..self })
    }

    /// Returns the options for a diagnosis of what was identified from the same records.
    ///
    /// # Errors
    /// Those of [`Base::new`].
    pub fn judging(self, identified: Identified) -> Result<Self> {
        let Identified { report, plant, simpler, settled, decays, doubts, linear, .. } = identified;
        let (held_out_rmse, without_dynamics) = (Some(report.held_out_rmse), report.linear.is_empty());
        let unpredictive = is_unpredictive(&report);
        let simpler = simpler.map(Base::new).transpose()?;
        let unsettled = !settled;
        Self {
            unsettled,
            identified: true,
            decays,
            simpler,
            held_out_rmse,
            without_dynamics,
            unpredictive,
            doubts,
            linear,
            ..self
        }
        .judging_file("identify", plant)
    }

    /// Returns the causes that are searched, `None` for all: none without a model of the response, which any could stand in for.
    pub(super) fn causes(&self) -> Option<&'static [&'static str]> {
        self.without_dynamics.then_some(&[])
    }

    /// True if a verdict on the identified spring says nothing of the record.
    pub(super) fn says_nothing(&self, verdict: Verdict) -> bool {
        self.without_dynamics || self.unpredictive && verdict == Verdict::Consistent
    }

    /// Returns the options with a simulation that stays as it was given or identified.
    pub(super) fn with_fixed_plant(&self) -> Self {
        Self { identified: false, simpler: None, ..self.clone() }
    }

    /// Returns what the user should know of the nominal spring: that readings of another quantity are compared with the paper's, whose
    /// gain and zero are no causes then, or what an identified one leaves in doubt.
    pub fn remarks(&self) -> Vec<String> {
        let reading = &self.units.reading;
        let is_other = self.plant == "paper" && *reading != Units::default().reading;
        let of_paper = is_other.then(|| {
            format!(
                "the readings are in {reading}, those of the report's spring in V; `--plant identify` compares with the gain, zero and \
                 time constants that the record shows"
            )
        });
        of_paper.into_iter().chain(self.doubts.iter().map(|doubt| format!("nominal spring: {doubt}"))).collect()
    }
}

impl Default for Options {
    /// Voltage held between rows, the paper's spring, and the normal effort.
    fn default() -> Self {
        Self {
            plant: "paper".into(),
            units: Units::default(),
            input: Input::Hold,
            base: Base::paper(),
            unsettled: false,
            identified: false,
            zero_unknown: false,
            decays: false,
            simpler: None,
            held_out_rmse: None,
            without_dynamics: false,
            unpredictive: false,
            doubts: Vec::new(),
            effort: Effort::Normal,
            linear: None,
            stop: Stop::default(),
        }
    }
}
