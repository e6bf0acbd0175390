//! Writes one record and its true values, as `cargo campaign --write` asks for.

use std::path::Path;

use anyhow::Result;
use validation::ground_truth::LabelledRecord;
use validation::ground_truth::noise::Noise;
use validation::ground_truth::record::Recipe;

use crate::arguments::Wanted;

/// Writes a record as CSV and its true values as JSON.
pub(crate) fn write(folder: &Path, wanted: &Wanted) -> Result<()> {
    let mut causes = wanted.cause.clone();
    causes.sort_unstable();
    causes.dedup();
    let recipe = Recipe {
        causes,
        other_forms: wanted.other_form,
        noise: Noise::white(wanted.noise_percent).of(wanted.noise.into()),
        rows: wanted.rows as usize,
        uneven: wanted.uneven,
    };
    let (name, record): (String, LabelledRecord) = match wanted.out_of_model {
        Some(form) => (form.name.replace(' ', "-"), form.draw(wanted.seed)),
        None => {
            let record = recipe.draw(wanted.seed).at(wanted.size);
            let names: Vec<_> = record.effects.iter().map(|effect| effect.cause.name()).collect();
            (if names.is_empty() { "nothing".to_owned() } else { names.join("+") }, record)
        }
    };
    for path in record.write(folder, &format!("{name}-{}", wanted.seed))? {
        println!("wrote {}", path.display());
    }
    Ok(())
}
