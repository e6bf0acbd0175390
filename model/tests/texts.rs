//! Texts for a person: each fault, each mismatch and each diagnosis of the sensor has words of its own.

use std::collections::BTreeSet;

use model::supervisor::{Fault, Mismatch};

/// Fails unless the texts differ from each other and have at least `shortest` letters.
fn own_words(texts: &[&str], shortest: usize) {
    let different: BTreeSet<_> = texts.iter().collect();
    assert_eq!(different.len(), texts.len(), "{texts:?}");
    assert!(texts.iter().all(|text| text.len() >= shortest), "{texts:?}");
}

#[test]
fn each_fault_says_how_it_is_detected_and_what_a_person_does() {
    own_words(&Fault::ALL.map(Fault::name), 5);
    own_words(&Fault::ALL.map(Fault::detection), 20);
    own_words(&Fault::ALL.map(Fault::remedy), 20);
}

#[test]
fn each_mismatch_has_a_name_and_a_code() {
    own_words(&Mismatch::ALL.map(Mismatch::name), 4);
    assert!(Mismatch::ALL.iter().map(|mismatch| mismatch.code()).eq(1..=7));
}

#[cfg(feature = "feedback")]
#[test]
fn each_diagnosis_of_the_sensor_has_a_name_and_a_code() {
    use model::Sensor::{Failed, Trusted};
    use model::feedback::Fault::{Absent, Jumping, OutOfRange, Stale, Stuck};
    let all = [Trusted, Failed(Absent), Failed(Stale), Failed(Stuck), Failed(Jumping), Failed(OutOfRange)];
    assert_eq!(all.map(|one| one.name()), ["trusted", "absent", "stale", "stuck", "jumping", "out-of-range"]);
    assert_eq!(all.map(|one| one.code()), [1, 2, 3, 4, 5, 6]);
}
