//! The other forms of what comes close to the best structure: the form of a cause in a structure that never was the best was chosen
//! before the other causes joined, and may be the reason why that structure is not the best.

use crate::search::evaluator::Evaluator;
use crate::search::scored::{Scored, effects};
use crate::search::structure_search::Search;
use crate::stats::thresholds::empirical::NATS_TO_REFORM;

/// Structures whose forms are tried again.
const REFORMED: usize = 3;

impl<E: Evaluator> Search<'_, E> {
    /// The best structure after the other forms were tried in sets of causes that come close to `best` and have no more causes.
    pub(super) fn with_rivals_reformed(&mut self, best: Scored, progress: &mut impl FnMut(&Scored)) -> Scored {
        let most = best.fit.model.blocks.len();
        if most < 2 {
            return best;
        }
        let own = effects(&best.fit.model);
        let least = best.score - NATS_TO_REFORM.get();
        let close = self.ranked().into_iter().take_while(|other| other.score > least);
        let may_be_better = |other: &&Scored| {
            let set = effects(&other.fit.model);
            (2..=most).contains(&set.len()) && set != own
        };
        let rivals: Vec<Scored> = close.filter(may_be_better).take(REFORMED).cloned().collect();
        let mut found = best.clone();
        for rival in rivals {
            if self.evaluator.is_over() {
                break;
            }
            let reformed = self.reformed(rival);
            if reformed.score > found.score {
                found = reformed;
            }
        }
        if found.score <= best.score {
            return best;
        }
        progress(&found);
        self.pruned(found)
    }
}
