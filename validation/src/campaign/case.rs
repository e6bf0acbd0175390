//! Records that can be drawn, with the cause codes that are true of them.

use std::fmt::{self, Debug};

use super::part::Job;
use super::subject::Subject;
use crate::ground_truth::Cause;
use crate::ground_truth::out_of_model::form::Form;

/// Cause codes that are true of a record; without one the record has no effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Expected {
    /// Codes that are correct as the first finding.
    pub first: Vec<&'static str>,
    /// Codes that are true in addition to a correct first finding.
    pub also: Vec<&'static str>,
    /// True if all codes of `first` must be named, false if one of them is enough.
    pub all: bool,
    /// True if `consistent` without a finding is correct too.
    pub or_none: bool,
}

impl Expected {
    /// Exactly these causes, in any order.
    pub fn exactly(causes: &[Cause]) -> Self {
        Self { first: causes.iter().map(|cause| cause.name()).collect(), also: Vec::new(), all: true, or_none: false }
    }

    /// True if the code is true of the record.
    pub fn is_true(&self, name: &str) -> bool {
        self.first.contains(&name) || self.also.contains(&name)
    }

    /// True if `names` contains what must be named.
    pub fn is_named(&self, mut names: impl FnMut(&str) -> bool) -> bool {
        let mut codes = self.first.iter();
        if self.all { codes.all(|code| names(code)) } else { codes.any(|code| names(code)) }
    }
}

/// A record that can be drawn, with the true names.
pub struct Case {
    /// Row of the first table in which the record counts.
    pub group: String,
    /// Rows of the further tables in which the record counts.
    pub kinds: Vec<String>,
    /// Seed of the record.
    pub seed: u64,
    /// True names.
    pub expected: Expected,
    /// Draws the record of a seed.
    pub draw: Box<dyn Fn(u64) -> Subject + Send + Sync>,
}

impl Debug for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}, seed {}", self.group, self.kinds.join(", "), self.seed)
    }
}

impl From<Job> for Case {
    /// A record of a part of the campaign, in which exactly its causes are true.
    fn from(Job { group, recipe, seed }: Job) -> Self {
        let expected = Expected::exactly(&recipe.causes);
        Self { group, kinds: Vec::new(), seed, expected, draw: Box::new(move |seed| recipe.draw(seed).into()) }
    }
}

impl From<(Form, u64)> for Case {
    /// A record of the out-of-model set.
    fn from((form, seed): (Form, u64)) -> Self {
        let names = |causes: &[Cause]| causes.iter().map(|cause| cause.name()).collect::<Vec<_>>();
        let first = [&[form.cause], form.or].concat();
        let expected = Expected { first: names(&first), also: names(form.also), ..Expected::default() };
        let draw = Box::new(move |seed| form.draw(seed).into());
        Self { group: form.name.to_owned(), kinds: Vec::new(), seed, expected, draw }
    }
}
