//! Edits that make an equation smaller.

use crate::equation::fitted::Fitted;
use crate::equation::kind::Kind;
use crate::equation::operator::Operator;
use crate::equation::problem::Problem;
use crate::equation::structure::Structure;

/// Returns the structures that lack one operator, branch or term of a fitted equation; a lag that varies becomes one that does not.
pub(super) fn taken_out(parent: &Fitted, problem: &Problem) -> Vec<Structure> {
    let (parent, scale) = (parent.weighted(), &problem.scale);
    let mut smaller = Vec::new();
    for (index, operator) in parent.chain.iter().enumerate() {
        if operator.kind != Kind::Parallel {
            let mut structure = parent.clone();
            structure.chain.remove(index);
            smaller.push(structure);
            continue;
        }
        for branch in 0..operator.chains.len() {
            if operator.chains.len() > 1 {
                let mut structure = parent.clone();
                structure.chain[index].chains.remove(branch);
                structure.chain[index].point.remove(branch);
                smaller.push(structure);
            }
            for (inner, of) in operator.chains[branch].iter().enumerate() {
                let mut structure = parent.clone();
                match of.kind {
                    Kind::Varying(_) => {
                        let tau_s = of.parameters(scale)[0];
                        structure.chain[index].chains[branch][inner] = Operator::new(Kind::Lag, &[tau_s], scale);
                    }
                    Kind::Curve(_) => drop(structure.chain[index].chains[branch].remove(inner)),
                    _ => continue,
                }
                smaller.push(structure);
            }
        }
    }
    for term in 0..parent.terms.len() {
        let mut structure = parent.clone();
        structure.terms.remove(term);
        smaller.push(structure);
    }
    smaller
}
