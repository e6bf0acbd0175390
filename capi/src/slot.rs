//! Memory of the caller for a configuration or a state.

use core::mem::MaybeUninit;

use crate::controller::{AnyConfig, AnyState};

/// Memory for a value; `MARK` says that there is one.
#[repr(C)]
#[derive(Debug)]
pub struct Slot<T, const MARK: u32> {
    mark: u32,
    value: MaybeUninit<T>,
}

/// `vsj_config`.
pub type ConfigSlot = Slot<AnyConfig, 0x7673_6a43>;
/// `vsj_state`.
pub type StateSlot = Slot<AnyState, 0x7673_6a53>;

/// Bytes of `vsj_config`, at least those of [`ConfigSlot`].
pub const CONFIG_BYTES: usize = 1152;
/// Bytes of `vsj_state`, at least those of [`StateSlot`].
pub const STATE_BYTES: usize = 512;
const _: () = assert!(size_of::<ConfigSlot>() <= CONFIG_BYTES && align_of::<ConfigSlot>() <= 8);
const _: () = assert!(size_of::<StateSlot>() <= STATE_BYTES && align_of::<StateSlot>() <= 8);

impl<T, const MARK: u32> Default for Slot<T, MARK> {
    /// Memory without a value.
    fn default() -> Self {
        Self { mark: 0, value: MaybeUninit::uninit() }
    }
}

impl<T, const MARK: u32> Slot<T, MARK> {
    /// Puts a value into the memory.
    pub fn put(&mut self, value: T) {
        self.value.write(value);
        self.mark = MARK;
    }

    /// Makes the memory one without a value.
    pub fn clear(&mut self) {
        self.mark = 0;
    }

    /// The value, if there is one.
    pub fn get(&self) -> Option<&T> {
        // SAFETY: only `put` writes this mark, after the value.
        (self.mark == MARK).then(|| unsafe { self.value.assume_init_ref() })
    }

    /// The value to be changed, if there is one.
    pub fn get_mut(&mut self) -> Option<&mut T> {
        // SAFETY: only `put` writes this mark, after the value.
        (self.mark == MARK).then(|| unsafe { self.value.assume_init_mut() })
    }
}
