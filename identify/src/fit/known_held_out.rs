//! The held-out residuals of the last models, which several passes of a diagnosis ask for.

use std::collections::VecDeque;

use crate::effects::model::Model;
use crate::noise::Noise;

/// Residuals that are kept.
const MOST: usize = 4;

/// A model with its noise, whether its searched coordinates were searched without each fold, and its residual.
type Known = (Model, Noise, bool, Vec<f64>);

/// The last residuals, the newest first.
#[derive(Default)]
pub(super) struct KnownHeldOut(VecDeque<Known>);

impl KnownHeldOut {
    /// Returns the residual of a model if it is one of the last.
    pub(super) fn residual(&self, model: &Model, noise: &Noise, searches: bool) -> Option<Vec<f64>> {
        let known = self.0.iter().find(|known| known.2 == searches && known.0 == *model && known.1 == *noise);
        known.map(|(.., residual)| residual.clone())
    }

    /// Keeps a residual, and forgets the oldest one.
    pub(super) fn keep(&mut self, model: &Model, noise: &Noise, searches: bool, residual: &[f64]) {
        self.0.truncate(MOST - 1);
        self.0.push_front((model.clone(), noise.clone(), searches, residual.to_vec()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::model::Block;

    #[test]
    fn a_residual_is_that_of_its_model_noise_and_search_and_the_last_ones_are_kept() {
        let model = |gain: f64| Model::default().with(Block { effect: 4, form: 0 }, vec![gain]);
        let [quiet, loud] = [1.0, 2.0].map(|sigma| Noise::robust(&[sigma, -sigma]));
        let mut known = KnownHeldOut::default();
        for gain in 0..5 {
            known.keep(&model(f64::from(gain)), &quiet, false, &[f64::from(gain)]);
        }
        let found = |gain: f64, noise: &Noise, searches: bool| known.residual(&model(gain), noise, searches);
        assert_eq!(found(4.0, &quiet, false), Some(vec![4.0]));
        assert_eq!(found(1.0, &quiet, false), Some(vec![1.0]));
        assert_eq!([found(0.0, &quiet, false), found(4.0, &loud, false), found(4.0, &quiet, true)], [None, None, None]);
    }
}
