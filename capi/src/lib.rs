//! The controller's tick for C and C++. `include/vsj_tick.h` is the reference for its users.
//!
//! Settings are a plain structure, configuration and state are memory that the caller provides: no heap, no global state, and for a
//! Cortex-M no panic. Every function returns a status.
//!
//! | module | content |
//! | --- | --- |
//! | [`settings`], `conversion` | the settings as C has them, and their conversion |
//! | [`controller`] | configuration and state for both kinds of springs |
//! | [`tick`] | input and output of a tick |
//! | [`slot`] | memory of the caller for a configuration or a state |
//! | [`functions`] | the functions that C calls |
#![no_std]

// A host's library has the panic handler of std, and nothing else of it.
#[cfg(not(target_os = "none"))]
extern crate std;

pub mod controller;
mod conversion;
pub mod functions;
pub mod settings;
pub mod slot;
pub mod tick;

/// Never called, as the test of the linked example shows: no function of this library can panic.
#[cfg(all(target_os = "none", not(test)))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
