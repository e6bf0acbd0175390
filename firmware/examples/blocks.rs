//! Instructions of a tick for each kind of spring under each controller, counted by the emulated board:
//! `cargo xtask emulate --blocks`. In no image that is flashed.

#![no_std]
#![no_main]

use cortex_m::peripheral::Peripherals;
use defmt_semihosting as _;
use firmware::blocks::{CONTROLLERS, SPRINGS, run};
use firmware::hang_guard;
use firmware::mps2::instructions::Counter;
use firmware::mps2::registers::CLOCK_HZ;
use firmware::mps2::semihosting;

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(mut core) = Peripherals::take() {
        // Nobody ticks, so it guards nothing here: it runs the clock that counts.
        hang_guard::start(&mut core.SYST, CLOCK_HZ);
    }
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
