//! Counts on the emulated board the instructions of a tick with each kind of spring and each controller:
//! `cargo xtask emulate --blocks`.

#![no_std]
#![no_main]

use defmt_semihosting as _;
use test_bench::blocks::{CONTROLLERS, SPRINGS, run};
use test_bench::mps2::instructions::{Counter, start_clock};
use test_bench::mps2::semihosting;

#[cortex_m_rt::entry]
fn main() -> ! {
    start_clock();
    for (spring, (_, plant)) in SPRINGS.iter().enumerate() {
        for (controller, (_, compensation)) in CONTROLLERS.iter().enumerate() {
            let mut counter = Counter::begin();
            let Ok(digest) = run(plant.as_ref(), *compensation, &mut counter) else { semihosting::exit(1) };
            let counted = counter.instructions();
            defmt::info!(
                "block spring={=usize} controller={=usize} min={=u32} mean={=u32} max={=u32} digest={=u64:x}",
                spring,
                controller,
                counted.min,
                counted.mean,
                counted.max,
                digest
            );
        }
    }
    semihosting::exit(0)
}
