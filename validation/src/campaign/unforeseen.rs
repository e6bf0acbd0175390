//! Diagnoses of the laws of [`ground_truth::unforeseen`] and [`ground_truth::unseen`], graded by the names that are true of each.

use super::answer::Answer;
use super::answer_table::{legend, page as tables};
use super::case::{Case, Expected};
use super::part::seed;
use super::subject::{Nominal, Subject};
use crate::ground_truth::unforeseen::law::Law;
use crate::ground_truth::{unforeseen, unseen};
use crate::markdown::table;

/// The two sets of laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edition {
    /// [`ground_truth::unforeseen`].
    First,
    /// [`ground_truth::unseen`].
    Second,
}

impl Edition {
    /// The laws, each with the name of its family.
    fn laws(self) -> Vec<(&'static str, Law)> {
        match self {
            Self::First => unforeseen::all(),
            Self::Second => unseen::all(),
        }
    }

    /// `count` records of every law.
    pub fn cases(self, first: u64, count: usize) -> Vec<Case> {
        let part = match self {
            Self::First => 18,
            Self::Second => 20,
        };
        let each = self.laws().into_iter().flat_map(|law| std::iter::repeat_n(law, count));
        each.enumerate().map(|(index, (family, law))| of(family, law, seed(first, part, index))).collect()
    }

    /// Page with the answers and the laws.
    pub fn page(self, answers: &[Answer]) -> String {
        let unread = match self {
            Self::First => "nobody looked at a record while\nthe diagnosis was made.",
            Self::Second => "their author had not\nread the diagnosis.",
        };
        let row = |(_, law): (_, Law)| {
            let none = if law.or_none || law.first.is_empty() { vec!["none"] } else { Vec::new() };
            let first = [law.first.to_vec(), none].concat().join(" or ");
            [law.name, law.law, &first, &law.also.join(", "), law.source].map(str::to_owned).to_vec()
        };
        let header = ["law", "equation; x is the voltage over 500 V", "right as first", "true in addition", "source"];
        format!(
            "\
Laws from the literature. Which cause codes are true of each was fixed before the first diagnosis; {unread}
`unexplained` with a right first finding and nothing untrue counts as right.

{}
{}
{}",
            legend(),
            tables("law", &["family"], answers),
            table(&header, self.laws().into_iter().map(row))
        )
    }
}

fn of(family: &str, law: Law, seed: u64) -> Case {
    Case {
        group: law.name.to_owned(),
        kinds: vec![family.to_owned()],
        seed,
        expected: Expected {
            first: law.first.to_vec(),
            also: law.also.to_vec(),
            all: law.first.is_empty(),
            or_none: law.or_none,
        },
        draw: Box::new(move |seed| {
            let (hidden, record) = law.draw(seed);
            Subject { hidden, record, nominal: Nominal::Paper }
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_that_changes_the_noise_only_expects_no_finding() {
        let cases = Edition::First.cases(1, 1);
        let of = |name: &str| cases.iter().find(|case| case.group == name).unwrap();
        assert!(of("noise that grows with the level").expected.first.is_empty());
        assert!(of("noise in bursts").expected.or_none && !of("sensor lag").expected.or_none);
        assert_eq!(of("sensor lag").expected.first, ["series-lag"]);
    }

    #[test]
    fn the_page_lists_every_law_with_its_source() {
        for edition in [Edition::First, Edition::Second] {
            let page = edition.page(&[]);
            assert!(
                edition
                    .laws()
                    .iter()
                    .all(|(_, law)| page.contains(law.source) && page.contains(&law.law.replace('|', "\\|")))
            );
        }
    }
}
