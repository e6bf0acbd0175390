//! The extended simulation over rows that the diagnosis has not seen.

use simulation::record::Record;

use crate::fit::engine::Engine;
use crate::record::data::Data;
use crate::record::input::Input;
use crate::record::observed::Observed;
use crate::verdict::diagnosis::Diagnosis;

impl Diagnosis {
    /// Returns reading minus prediction of the extended simulation, in the reading's unit, at each row of a record of which the first
    /// rows were diagnosed. Initial state, zero, gain and all parameters are those of the diagnosed rows.
    pub fn errors_on(&self, record: &Record, input: Input) -> Vec<f64> {
        let normalisation = &self.data.normalisation;
        let scales = &normalisation.scales;
        let mut data = Data::thinned(&normalisation.record(record), input, 1, normalisation);
        // Some parameters of the model are relative to the range of the record that it was fitted to.
        data.full_scale_v = self.data.full_scale_v / scales.volt_v;
        data.largest_v = self.data.largest_v / scales.volt_v;
        data.origin_v = self.data.origin_v / scales.volt_v;
        let observed = Observed::new(&data);
        let mut engine = Engine::new(&data, &observed, &self.base);
        let residual = engine.residual_by_first(self.data.rows(), &self.extended.model);
        residual.into_iter().map(|left| scales.reading * left).collect()
    }
}
