//! Counts on the emulated board what the adaptation needs after a control tick: `cargo xtask emulate --isolation`.

#![no_std]
#![no_main]

use defmt_semihosting as _;
use test_bench::adaptation::run;
use test_bench::mps2::instructions::{Counter, start_clock};
use test_bench::mps2::semihosting;

#[cortex_m_rt::entry]
fn main() -> ! {
    start_clock();
    let mut counter = Counter::begin();
    let Ok(outcome) = run(&mut counter) else { semihosting::exit(1) };
    let counted = counter.instructions();
    defmt::info!(
        "adaptation min={=u32} mean={=u32} max={=u32} digest={=u64:x} exchanges={=u32} bytes={=usize}",
        counted.min,
        counted.mean,
        counted.max,
        outcome.digest,
        outcome.exchanges,
        size_of::<model::adaptation::Variant>()
    );
    semihosting::exit(0)
}
