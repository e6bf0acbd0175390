//! The parts of the campaign and the records in each.

use indicatif::ProgressBar;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::diagnosis::Diagnose;
use super::score::Outcome;
use crate::ground_truth::cause::{Block, Cause};
use crate::ground_truth::noise::{Kind, Noise};
use crate::ground_truth::record::Recipe;

/// A record to simulate and diagnose.
#[derive(Clone, Debug)]
pub struct Job {
    /// Row of the part's table in which the record counts.
    pub group: String,
    /// Causes, noise and rows of the record.
    pub recipe: Recipe,
    /// Seed of the record.
    pub seed: u64,
}

/// Seed of record `index` of a part; seeds of different parts do not overlap.
pub(super) fn seed(first: u64, part: u64, index: usize) -> u64 {
    first.wrapping_mul(1_000_000_007) + part * 100_000_000 + index as u64
}

/// `count` records of each of 19 causes in its first form, 0.2 % white noise.
pub fn singles(first: u64, count: usize) -> Vec<Job> {
    each_cause(first, 1, count, &Cause::ALL, |recipe| recipe)
}

/// `count` records of each cause that has other forms, in one of these.
pub fn forms(first: u64, count: usize) -> Vec<Job> {
    let causes: Vec<_> = Cause::ALL.into_iter().filter(|cause| cause.facts().forms.len() > 1).collect();
    each_cause(first, 2, count, &causes, |recipe| Recipe { other_forms: true, ..recipe })
}

pub(super) fn each_cause(
    first: u64,
    part: u64,
    count: usize,
    causes: &[Cause],
    change: impl Fn(Recipe) -> Recipe,
) -> Vec<Job> {
    let job = |(index, (cause, _)): (usize, (&Cause, usize))| Job {
        group: cause.name().to_owned(),
        recipe: change(Recipe::of(&[*cause])),
        seed: seed(first, part, index),
    };
    causes.iter().flat_map(|cause| (0..count).map(move |k| (cause, k))).enumerate().map(job).collect()
}

/// `count` records of the paper's spring with white, coloured (both kinds) and heavy-tailed noise in turn.
pub fn nulls(first: u64, count: usize) -> Vec<Job> {
    const TURN: [Kind; 6] =
        [Kind::White, Kind::Coloured, Kind::HeavyTailed, Kind::White, Kind::OneOverF, Kind::HeavyTailed];
    let job = |index: usize| {
        let kind = TURN[index % TURN.len()];
        let recipe = Recipe { noise: Noise::white(0.2).of(kind), ..Recipe::of(&[]) };
        Job { group: kind.name().to_owned(), recipe, seed: seed(first, 3, index) }
    };
    let mut jobs: Vec<_> = (0..count).map(job).collect();
    jobs.sort_by_key(|job| job.recipe.noise.kind as u8);
    jobs
}

/// `count` records of every pair of causes of different blocks.
pub fn pairs(first: u64, count: usize) -> Vec<Job> {
    let mut jobs = Vec::new();
    for (i, &a) in Cause::ALL.iter().enumerate() {
        for &b in Cause::ALL[i + 1..].iter().filter(|b| b.block() != a.block()) {
            jobs.extend((0..count).map(|_| several(&[a, b])));
        }
    }
    numbered(first, 4, jobs)
}

/// `count` records of 20 000 rows of every pair of causes of different blocks, with white and coloured noise (both
/// kinds) in turn.
pub fn long(first: u64, count: usize) -> Vec<Job> {
    let kinds = [Kind::White, Kind::Coloured, Kind::OneOverF].into_iter().cycle();
    let longer = |(job, kind): (Job, Kind)| {
        let recipe = Recipe { noise: job.recipe.noise.of(kind), rows: 20_000, ..job.recipe };
        Job { group: kind.name().to_owned(), recipe, ..job }
    };
    let mut jobs = numbered(first, 11, pairs(first, count).into_iter().zip(kinds).map(longer).collect());
    jobs.sort_by_key(|job| job.recipe.noise.kind as u8);
    jobs
}

/// `count` records of three random causes of three different blocks.
pub fn triples(first: u64, count: usize) -> Vec<Job> {
    let mut random = ChaCha8Rng::seed_from_u64(seed(first, 5, 0));
    let jobs = (0..count).map(|_| {
        let mut blocks = vec![Block::Amplifier, Block::Static, Block::Relaxation, Block::Reading];
        blocks.remove(random.random_range(0..blocks.len()));
        let mut one_of = |block: &Block| {
            let inside: Vec<Cause> = Cause::ALL.into_iter().filter(|cause| cause.block() == *block).collect();
            *inside.choose(&mut random).expect("no block is empty")
        };
        several(&blocks.iter().map(&mut one_of).collect::<Vec<_>>())
    });
    let jobs = jobs.collect();
    numbered(first, 5, jobs)
}

/// `count` records of each cause under each difficulty: few rows, uneven rows, coloured, heavy-tailed and strong noise.
pub fn stress(first: u64, count: usize) -> Vec<Job> {
    let reference = Recipe::of(&[]);
    let hard = [
        ("600 rows", Recipe { rows: 600, ..reference.clone() }),
        ("uneven rows", Recipe { uneven: true, ..reference.clone() }),
        ("600 uneven rows", Recipe { rows: 600, uneven: true, ..reference.clone() }),
        ("coloured noise, AR(1)", Recipe { noise: reference.noise.of(Kind::Coloured), ..reference.clone() }),
        ("coloured noise, 1/f", Recipe { noise: reference.noise.of(Kind::OneOverF), ..reference.clone() }),
        ("heavy-tailed noise", Recipe { noise: reference.noise.of(Kind::HeavyTailed), ..reference.clone() }),
        ("1 % noise", Recipe { noise: Noise::white(1.0), ..reference.clone() }),
    ];
    let jobs = hard.iter().flat_map(|(group, recipe)| {
        Cause::ALL.into_iter().flat_map(move |cause| {
            let recipe = Recipe { causes: vec![cause], ..recipe.clone() };
            (0..count).map(move |_| Job { group: (*group).to_owned(), recipe: recipe.clone(), seed: 0 })
        })
    });
    let jobs = jobs.collect();
    numbered(first, 6, jobs)
}

/// `count` records of each cause of 2401 to 100 000 rows, with white and coloured noise (both kinds). Records of every
/// length have the same schedules and values.
pub fn speed(first: u64, count: usize) -> Vec<Job> {
    let of = |kind, rows| {
        let change = move |recipe| Recipe { noise: Noise::white(0.2).of(kind), rows, ..recipe };
        let group = format!("{}, {rows} rows", Kind::name(kind));
        each_cause(first, 8, count, &Cause::ALL, change).into_iter().map(move |job| Job { group: group.clone(), ..job })
    };
    let kinds = [Kind::White, Kind::Coloured, Kind::OneOverF];
    kinds
        .into_iter()
        .flat_map(|kind| [2401, 10_000, 30_000, 100_000].into_iter().flat_map(move |rows| of(kind, rows)))
        .collect()
}

/// A record with several causes, grouped by their blocks.
fn several(causes: &[Cause]) -> Job {
    let mut blocks: Vec<_> = causes.iter().map(|cause| cause.block()).collect();
    blocks.sort_unstable();
    let names: Vec<_> = blocks.iter().map(|block| format!("{block:?}").to_lowercase()).collect();
    Job { group: names.join(" + "), recipe: Recipe::of(causes), seed: 0 }
}

fn numbered(first: u64, part: u64, jobs: Vec<Job>) -> Vec<Job> {
    let numbered = |(index, job)| Job { seed: seed(first, part, index), ..job };
    jobs.into_iter().enumerate().map(numbered).collect()
}

/// Simulates and diagnoses the records on all cores; the outcomes are in the order of the jobs.
pub fn run(jobs: &[Job], diagnose: &Diagnose<'_>, progress: &ProgressBar) -> Vec<Outcome> {
    let one = |job: &Job| {
        let outcome = Outcome::of(&job.recipe.draw(job.seed), diagnose);
        progress.inc(1);
        outcome
    };
    jobs.par_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_the_documented_records_and_share_none() {
        assert_eq!(singles(1, 20).len(), 380);
        let nulls = nulls(1, 500);
        let of = |kind| nulls.iter().filter(|job| job.recipe.noise.kind == kind).count();
        assert!(nulls.len() == 500 && of(Kind::White) == 167 && of(Kind::HeavyTailed) == 166);
        let blocks = |job: &Job| {
            let mut blocks: Vec<_> = job.recipe.causes.iter().map(|cause| cause.block()).collect();
            blocks.sort_unstable();
            blocks.dedup();
            blocks.len()
        };
        // 3 amplifier, 3 static, 8 relaxation, 5 reading.
        assert_eq!(pairs(1, 1).len(), 9 + 24 + 15 + 24 + 15 + 40);
        assert!(pairs(1, 1).iter().all(|job| blocks(job) == 2));
        assert!(triples(1, 50).iter().all(|job| blocks(job) == 3));
        let all =
            [singles(1, 20), forms(1, 20), nulls, pairs(1, 5), triples(1, 100), stress(1, 5), long(1, 1)].concat();
        let mut seeds: Vec<_> = all.iter().map(|job| job.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), all.len(), "two jobs share a record");
    }
}
