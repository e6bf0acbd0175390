//! Detection of a stack overflow: an access to the lowest 256 bytes of the stack is a fault.
//!
//! On the real board there is no memory below the stack, so that a stack frame larger than the guard faults as well. The
//! emulator permits such accesses and detects only those to the guard.

#![allow(unsafe_code)]

use cortex_m::peripheral::MPU;

/// Binary logarithm of the guard's size in bytes; the end of the stack is aligned to it.
const LOG2_SIZE: u32 = 8;

unsafe extern "C" {
    static _stack_end: u32;
}

/// Protects the lowest bytes of the stack with the memory protection unit.
pub fn set(mpu: &mut MPU) {
    let end = &raw const _stack_end as u32;
    const VALID: u32 = 1 << 4;
    const NEVER_EXECUTE: u32 = 1 << 28;
    const ENABLE: u32 = 1;
    // The default memory map applies elsewhere. Hard fault and NMI handlers run without protection.
    const DEFAULT_MAP: u32 = 1 << 2;
    // SAFETY: removes the access rights of 256 unused bytes only.
    unsafe { mpu.rbar.write(end | VALID) };
    // SAFETY: as above.
    unsafe { mpu.rasr.write(NEVER_EXECUTE | (LOG2_SIZE - 1) << 1 | ENABLE) };
    // SAFETY: as above.
    unsafe { mpu.ctrl.write(DEFAULT_MAP | ENABLE) };
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
