//! The fuzzers' properties on their corpora, on damaged copies of these, and on random bytes: the share of `cargo xtask fuzz`
//! that every run of the tests has.
//!
//! `cargo test -p end-to-end --test fuzz -- --nocapture` prints the number of inputs of each format.

use std::fs;
use std::path::PathBuf;

use end_to_end::fuzz::{TARGETS, frames, run};
use proptest::test_runner::{Config, TestRunner};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of damaged copies of each file of a corpus.
const COPIES: usize = 400;
/// Number of inputs of random bytes for each format.
const RANDOM: u32 = 3000;

/// The files of a format's corpus.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(target);
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("a folder can be read").path())
        .collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).expect("a file can be read")).collect()
}

/// A copy with a few bytes changed, removed, repeated or taken from another file.
fn damaged(files: &[Vec<u8>], file: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for _ in 0..random.random_range(1..=6) {
        let at = random.random_range(0..=bytes.len());
        let end = (at + random.random_range(1..=16)).min(bytes.len());
        match random.random_range(0..6) {
            0 => drop(bytes.drain(at..end)),
            1 => bytes[at..end].iter_mut().for_each(|byte| *byte ^= 1 << random.random_range(0..8)),
            2 => bytes[at..end].fill(*[0, 0xff, b'9', b',', b'-', b'.'].get(random.random_range(0..6)).unwrap_or(&0)),
            3 => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            4 => bytes.insert(at, random.random()),
            _ => {
                let other = &files[random.random_range(0..files.len())];
                let from = random.random_range(0..=other.len());
                let until = (from + random.random_range(1..=64)).min(other.len());
                bytes.splice(at..end, other[from..until].iter().copied());
            }
        }
    }
    bytes
}

/// Frames of an earlier version of the protocol would test nothing but that they are refused.
#[test]
fn the_corpus_of_frames_has_requests_replies_and_notices_of_this_version() {
    let read = corpus("wire").into_iter().map(|file| frames::messages(&file));
    let [requests, replies, notices] = read.fold([0; 3], |sum, read| std::array::from_fn(|at| sum[at] + read[at]));
    assert!(requests > 10 && replies > 10 && notices > 0, "{requests} requests, {replies} replies, {notices} notices");
}

#[test]
fn every_format_keeps_its_properties_for_any_bytes() {
    for (target, check) in TARGETS {
        let files = corpus(target);
        assert!(files.len() >= 3, "a corpus of {} files for {target}", files.len());
        let mut random = ChaCha8Rng::seed_from_u64(20261123);
        let mut inputs = 0;
        for file in &files {
            check(file);
            for _ in 0..COPIES {
                check(&damaged(&files, file, &mut random));
                inputs += 1;
            }
        }
        let config = Config { cases: RANDOM, failure_persistence: None, ..Config::default() };
        let bytes = proptest::collection::vec(proptest::num::u8::ANY, 0..512);
        TestRunner::new_with_rng(config, proptest::test_runner::TestRng::deterministic_rng(Default::default()))
            .run(&bytes, |bytes| {
                run(target, &bytes);
                Ok(())
            })
            .unwrap_or_else(|error| panic!("{target}: {error}"));
        println!("count: {} inputs of the format {target}", inputs + files.len() + RANDOM as usize);
    }
}
