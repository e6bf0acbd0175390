//! The lowest 256 bytes of the stack may not be touched: an overflow is a fault, before it leaves the stack.
//!
//! Below the stack there is no memory on the real board, so that even a frame larger than the guard faults. The emulator
//! lets such accesses pass, and there the guard is all there is.

#![allow(unsafe_code)]

use cortex_m::peripheral::MPU;

/// Bytes, a power of two; the stack's end is aligned to it.
const LOG2_SIZE: u32 = 8;

unsafe extern "C" {
    static _stack_end: u32;
}

/// Sets the guard up.
pub fn set(mpu: &mut MPU) {
    let end = &raw const _stack_end as u32;
    const VALID: u32 = 1 << 4;
    const NEVER_EXECUTE: u32 = 1 << 28;
    const ENABLE: u32 = 1;
    // Everything else stays as without a memory protection unit. Hard faults and NMI run without it.
    const DEFAULT_MAP: u32 = 1 << 2;
    // SAFETY: takes rights away from 256 bytes that nobody uses.
    unsafe {
        mpu.rbar.write(end | VALID);
        mpu.rasr.write(NEVER_EXECUTE | (LOG2_SIZE - 1) << 1 | ENABLE);
        mpu.ctrl.write(DEFAULT_MAP | ENABLE);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
