//! Runs the parts of the campaign.
//!
//! In: a part and the arguments. Out: its result, or the records of it as files.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Result, bail};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use validation::campaign::answer;
use validation::campaign::case::Case;
use validation::campaign::diagnosis::{self, diagnose};
use validation::campaign::part::{self, Job};
use validation::campaign::score::Outcome;
use validation::campaign::sensitivity::{self, SIZES};
use validation::campaign::unforeseen::Edition;
use validation::campaign::{
    answer_table, criteria, equation, identified, out_of_model, plan, plants, real, reliability, rivals, scales,
    shared, steps, tables,
};
use validation::criterion::Criterion;
use validation::ground_truth::{self, Cause};

use crate::arguments::{Cli, Part};
use crate::done::Done;

impl Cli {
    fn count(&self, default: usize) -> usize {
        self.records.map_or(default, |records| records as usize)
    }

    /// Runs a part.
    pub(crate) fn part(&self, part: Part) -> Result<Done> {
        let first = self.first_seed;
        match part {
            Part::Singles => self.jobs(part, criteria::singles),
            Part::Nulls => self.jobs(part, criteria::nulls),
            Part::Pairs | Part::Long => self.jobs(part, criteria::pairs),
            Part::Triples => self.jobs(part, criteria::triples),
            Part::Forms | Part::Stress | Part::Speed => self.jobs(part, |_| Vec::new()),
            Part::Shared => self.answers(part, &["causes", "size"], &shared::cases(first, self.count(3))),
            Part::Steps => self.answers(part, &["causes", "experiment"], &steps::cases(first, self.count(3))),
            Part::Plants | Part::Identified => {
                let cases = if part == Part::Plants { plants::cases } else { identified::cases };
                let cases = cases(first, self.count(8));
                self.answers(part, &["cause", "schedule", "noise", "time constants"], &cases)
            }
            Part::Reliability => {
                let mut sets = Vec::new();
                for (name, cases) in reliability::sets(first, self.count(1)) {
                    let bar = bar(name, cases.len())?;
                    sets.push((name, answer::run(&cases, &diagnosis::answer, &bar)));
                    bar.finish_and_clear();
                }
                let markdown = reliability::page(&sets);
                let figure = Some(("reliability.svg", reliability::figure(&sets)));
                Ok(Done { figure, ..Done::new(part, markdown, json!(sets)) })
            }
            Part::Unforeseen => self.answers(part, &["law"], &Edition::First.cases(first, self.count(3))),
            Part::Unseen => self.answers(part, &["law"], &Edition::Second.cases(first, self.count(3))),
            Part::Small => self.sensitivities(part, &[0.2]),
            Part::Noise => self.sensitivities(part, &[0.1, 0.2, 0.5, 1.0]),
            Part::OutOfModel => {
                let (mut forms, causes) = (ground_truth::out_of_model::all(), &self.record.cause);
                let mut jobs = out_of_model::jobs(&forms, first, self.count(5));
                if !causes.is_empty() {
                    forms.retain(|form| causes.contains(&form.cause));
                    jobs.retain(|(form, _)| causes.contains(&form.cause));
                }
                let bar = bar("out-of-model", jobs.len())?;
                let answers = out_of_model::run(&jobs, &diagnose, &bar)?;
                bar.finish_and_clear();
                let (markdown, wrong) = (out_of_model::page(&forms, &answers), out_of_model::wrong(&forms, &answers));
                Ok(Done { wrong, ..Done::new(part, markdown, json!(answers)) })
            }
            Part::Scales => {
                let jobs = scales::jobs(first, self.count(20));
                let bar = bar("scales", jobs.len())?;
                let outcomes = scales::run(&jobs, &bar);
                bar.finish_and_clear();
                let (markdown, wrong) = (tables::named("cause", &jobs, &outcomes), tables::wrong(&jobs, &outcomes));
                Ok(Done { wrong, ..Done::new(part, markdown, json!({"records": outcomes})) })
            }
            Part::Equation => {
                let cases = equation::cases(first, self.count(1));
                let bar = bar("equation", cases.len())?;
                let rows = equation::run(&cases, true, &bar)?;
                bar.finish_and_clear();
                let markdown = equation::page(&rows);
                Ok(Done::new(part, markdown, json!(rows)))
            }
            Part::Rivals => {
                let bar = bar("rivals", rivals::RECORDS)?;
                let rows = rivals::run(first, &bar)?;
                bar.finish_and_clear();
                let markdown = rivals::table(&rows);
                Ok(Done::new(part, markdown, json!(rows)))
            }
            Part::Instruments => {
                let (rows, refused) = measured("instruments", &real::twins(first), true)?;
                if let Some(record) = refused.first() {
                    bail!("{}: {}", record.name, record.reason);
                }
                let markdown = real::table(&rows);
                Ok(Done::new(part, markdown, json!(rows)))
            }
            Part::Plan => {
                let cases = plan::cases(&ground_truth::out_of_model::all(), first, self.count(30));
                let bar = bar("plan", cases.len())?;
                let outcomes = plan::run(&cases, &bar)?;
                bar.finish_and_clear();
                let markdown = plan::page(&outcomes);
                Ok(Done::new(part, markdown, json!(outcomes)))
            }
            #[cfg(not(feature = "sensitivity"))]
            Part::Thresholds => bail!("thresholds: expected the feature `sensitivity`; run `cargo thresholds`"),
            #[cfg(feature = "sensitivity")]
            Part::Thresholds => {
                use validation::campaign::thresholds;

                let cases = thresholds::cases(first, self.count(1));
                let bar = bar("thresholds", thresholds::diagnoses(&cases))?;
                let (as_set, rows) = thresholds::run(&cases, diagnosis::vary, &diagnose, &bar)?;
                bar.finish_and_clear();
                let markdown = thresholds::page(&cases, &as_set, &rows);
                Ok(Done::new(part, markdown, json!({"as_set": as_set, "thresholds": rows})))
            }
        }
    }

    /// The records of a part that draws every one from a recipe.
    fn recipes(&self, part: Part) -> Result<Vec<Job>> {
        let first = self.first_seed;
        Ok(match part {
            Part::Singles => part::singles(first, self.count(20)),
            Part::Forms => part::forms(first, self.count(20)),
            Part::Nulls => part::nulls(first, self.count(500)),
            Part::Pairs => part::pairs(first, self.count(3)),
            Part::Triples => part::triples(first, self.count(100)),
            Part::Long => part::long(first, self.count(1)),
            Part::Stress => part::stress(first, self.count(5)),
            Part::Speed => part::speed(first, self.count(1)),
            _ => bail!("{}: expected singles, forms, nulls, pairs, triples, long, stress or speed", part.name()),
        })
    }

    /// Writes the records of the parts as files, with their true values.
    pub(crate) fn export(&self, folder: &Path) -> Result<()> {
        let parts = self.parts.iter().map(|&part| Ok((part, self.recipes(part)?))).collect::<Result<Vec<_>>>()?;
        for (part, jobs) in parts {
            for Job { group, recipe, seed } in &jobs {
                recipe.draw(*seed).write(&folder.join(group), &format!("seed-{seed}"))?;
            }
            println!("wrote {} records of {} to {}", jobs.len(), part.name(), folder.display());
        }
        Ok(())
    }

    fn jobs(&self, part: Part, criteria: fn(&[Outcome]) -> Vec<Criterion>) -> Result<Done> {
        let jobs = &self.recipes(part)?;
        let bar = bar(&format!("{part:?}"), jobs.len())?;
        let outcomes = part::run(jobs, &diagnose, &bar);
        bar.finish_and_clear();
        // If every record fails, the set-up is at fault, not the diagnosis.
        if let Some(failure) = outcomes.iter().find_map(|outcome| outcome.failure.as_ref())
            && outcomes.iter().all(|outcome| outcome.failure.is_some())
        {
            bail!("no record was diagnosed: {failure}");
        }
        let what = match part {
            Part::Nulls | Part::Long => "noise",
            Part::Pairs | Part::Triples => "blocks",
            Part::Stress => "record",
            _ => "cause",
        };
        let mut markdown =
            if part == Part::Speed { tables::speed(jobs, &outcomes) } else { tables::named(what, jobs, &outcomes) };
        if matches!(part, Part::Singles | Part::Pairs | Part::Triples) {
            write!(markdown, "\n{}", tables::accuracy(&outcomes))?;
        }
        if part == Part::Singles {
            write!(markdown, "\n{}", tables::confusion(&outcomes))?;
        }
        let wrong = tables::wrong(jobs, &outcomes);
        let criteria = criteria(&outcomes);
        let json = json!({"aims": criteria, "records": outcomes});
        Ok(Done { wrong, criteria, ..Done::new(part, markdown, json) })
    }

    /// Diagnoses cases and grades the answers; `heads` are those of the tables' first columns.
    fn answers(&self, part: Part, heads: &[&str], cases: &[Case]) -> Result<Done> {
        let bar = bar(&part.name(), cases.len())?;
        let answers = answer::run(cases, &diagnosis::answer, &bar);
        bar.finish_and_clear();
        let markdown = match part {
            Part::Unforeseen => Edition::First.page(&answers),
            Part::Unseen => Edition::Second.page(&answers),
            _ => format!("{}\n{}", answer_table::legend(), answer_table::page(heads[0], &heads[1..], &answers)),
        };
        let wrong = answer_table::wrong(&answers);
        Ok(Done { wrong, ..Done::new(part, markdown, json!({"records": answers})) })
    }

    fn sensitivities(&self, part: Part, levels: &[f64]) -> Result<Done> {
        let count = self.count(20);
        // The largest possible number: most searches end at the first sizes.
        let bar = bar(&format!("{part:?}, at most"), levels.len() * Cause::ALL.len() * SIZES.len() * count)?;
        let each = levels.iter().flat_map(|&level| Cause::ALL.map(|cause| (level, cause)));
        let found: Vec<_> = each
            .map(|(level, cause)| sensitivity::measure(cause, level, self.first_seed, count, &diagnose, &bar))
            .collect();
        bar.finish_and_clear();
        let small = part == Part::Small;
        let markdown = if small { tables::sensitivity(&found) } else { tables::noise(&found) };
        let criteria = if small { criteria::small(&found) } else { Vec::new() };
        let json = json!({"aims": criteria, "climbs": found});
        Ok(Done { criteria, ..Done::new(part, markdown, json) })
    }
}

/// Results of records with their own units; with `python`, also of the other tools.
pub(crate) fn measured(
    what: &str,
    subjects: &[real::Subject],
    python: bool,
) -> Result<(Vec<real::Row>, Vec<real::Refused>)> {
    let bar = bar(what, subjects.len())?;
    let measured = real::run(subjects, python, &bar)?;
    bar.finish_and_clear();
    Ok(measured)
}

fn bar(what: &str, length: usize) -> Result<ProgressBar> {
    let style = ProgressStyle::with_template("{msg} {bar:40} {pos} of {len}, {elapsed}, {eta} left")?;
    Ok(ProgressBar::new(length as u64).with_style(style).with_message(what.to_owned()))
}
