//! libFuzzer on the format `plan`; its properties are in `tests/src/fuzz/`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| end_to_end::fuzz::run("plan", bytes));
