//! Counts on the emulated board the instructions of the isolation bank's tick: `cargo xtask emulate --isolation`.

#![no_std]
#![no_main]

use defmt_semihosting as _;
use test_bench::isolation::run;
use test_bench::mps2::instructions::{Counter, start_clock};
use test_bench::mps2::semihosting;

#[cortex_m_rt::entry]
fn main() -> ! {
    start_clock();
    let mut counter = Counter::begin();
    let Ok(outcome) = run(&mut counter) else { semihosting::exit(1) };
    let counted = counter.instructions();
    defmt::info!(
        "isolation min={=u32} mean={=u32} max={=u32} digest={=u64:x} bytes={=usize} config={=usize}",
        counted.min,
        counted.mean,
        counted.max,
        outcome.digest,
        size_of::<model::isolation::State>(),
        size_of::<model::isolation::Config>()
    );
    semihosting::exit(0)
}
