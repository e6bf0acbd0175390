//! libFuzzer on the format `columns`; its properties are in `tests/src/fuzz/`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| end_to_end::fuzz::run("columns", bytes));
