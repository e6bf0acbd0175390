//! Decodes those Thumb instructions that show which functions a function calls and how much stack it uses.

use anyhow::{Context, Result};

use xtask::segments::{self, Flash};

use super::elf::{self, Function};

/// The code of an image.
pub(crate) struct Code {
    flash: Flash,
    /// Address, and whether data or code begins there: see [`elf::marks`].
    marks: Vec<(u32, bool)>,
}

/// Calls and stack use of one function.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Addresses outside of the function that it calls or jumps to.
    pub(crate) calls: Vec<u32>,
    /// Whether it calls through a register, so that the target is unknown.
    pub(crate) calls_by_register: bool,
    /// Whether it contains an instruction of the float unit.
    pub(crate) floats: bool,
    /// Whether it contains a permanently undefined instruction (UDF).
    pub(crate) traps: bool,
    /// Bytes of stack: the sum of all reservations in the function, an upper bound.
    pub(crate) frame: u32,
}

impl Code {
    pub(crate) fn new(elf: &[u8]) -> Result<Self> {
        Ok(Self { flash: segments::flash(elf)?, marks: elf::marks(elf)? })
    }

    fn read(&self, address: u32) -> Result<u16> {
        let half = || {
            let offset = address.checked_sub(self.flash.address)? as usize;
            Some(u16::from_le_bytes(self.flash.bytes.get(offset..offset + 2)?.try_into().ok()?))
        };
        half().with_context(|| format!("code at {address:#x} outside of the flash"))
    }

    /// The 32-bit word at an address of the flash. An address outside of it is an error.
    pub(crate) fn word(&self, address: u32) -> Result<u32> {
        Ok(u32::from(self.read(address)?) | u32::from(self.read(address + 2)?) << 16)
    }

    fn is_data(&self, address: u32) -> bool {
        let next = self.marks.partition_point(|(at, _)| *at <= address);
        next > 0 && self.marks[next - 1].1
    }

    /// Decodes all instructions of a function.
    pub(crate) fn shape(&self, function: &Function) -> Result<Shape> {
        let mut shape = Shape::default();
        let mut at = function.address;
        while at < function.address + function.size {
            if self.is_data(at) {
                at += 2;
                continue;
            }
            let first = self.read(at)?;
            if first < 0xe800 {
                shape.short(function, at, first);
                at += 2;
            } else {
                shape.long(function, at, first, self.read(at + 2)?);
                at += 4;
            }
        }
        Ok(shape)
    }
}

impl Shape {
    fn short(&mut self, function: &Function, at: u32, code: u16) {
        let register = code >> 3 & 0xf;
        match code {
            // BLX register; BX to another register than the return address.
            _ if code & 0xff80 == 0x4780 => self.calls_by_register = true,
            _ if code & 0xff80 == 0x4700 && register != 14 => self.calls_by_register = true,
            // B
            _ if code & 0xf800 == 0xe000 => self.jump(function, at, sign(u32::from(code & 0x7ff), 11) * 2),
            // PUSH
            _ if code & 0xfe00 == 0xb400 => self.frame += 4 * (code & 0x1ff).count_ones(),
            // UDF
            _ if code & 0xff00 == 0xde00 => self.traps = true,
            // SUB SP
            _ if code & 0xff80 == 0xb080 => self.frame += 4 * u32::from(code & 0x7f),
            _ => {}
        }
    }

    fn long(&mut self, function: &Function, at: u32, first: u16, second: u16) {
        let (a, b) = (u32::from(first), u32::from(second));
        // Coprocessors 10 and 11.
        self.floats |= a & 0xec00 == 0xec00 && b & 0x0e00 == 0x0a00;
        // UDF.W
        self.traps |= a & 0xfff0 == 0xf7f0 && b & 0xf000 == 0xa000;
        let immediate = (a >> 10 & 1) << 11 | (b >> 12 & 7) << 8 | b & 0xff;
        match (first, second) {
            // BL and B
            _ if a & 0xf800 == 0xf000 && (b & 0xd000 == 0xd000 || b & 0xd000 == 0x9000) => {
                let s = a >> 10 & 1;
                let i1 = !(b >> 13 ^ s) & 1;
                let i2 = !(b >> 11 ^ s) & 1;
                let offset = s << 24 | i1 << 23 | i2 << 22 | (a & 0x3ff) << 12 | (b & 0x7ff) << 1;
                self.jump(function, at, sign(offset, 25));
            }
            // STMDB SP!
            (0xe92d, _) => self.frame += 4 * b.count_ones(),
            // VPUSH of double or single registers
            _ if a & 0xffbf == 0xed2d => self.frame += 4 * (b & 0xff),
            // STR register, [SP, #-immediate]!
            (0xf84d, _) if b & 0x0f00 == 0x0d00 => self.frame += b & 0xff,
            // SUB.W SP, SP, #modified immediate; SUBW SP, SP, #12 bits
            _ if a & 0xfbef == 0xf1ad && b & 0x8f00 == 0x0d00 => self.frame += modified(immediate),
            _ if a & 0xfbff == 0xf2ad && b & 0x8f00 == 0x0d00 => self.frame += immediate,
            _ => {}
        }
    }

    fn jump(&mut self, function: &Function, at: u32, offset: i32) {
        let target = at.wrapping_add(4).wrapping_add_signed(offset);
        if !(function.address..function.address + function.size).contains(&target) {
            self.calls.push(target);
        }
    }
}

/// The value of a modified immediate constant (ARMv7-M manual, A5.3.2): a repeated byte, or a byte with its first bit
/// set, rotated.
fn modified(immediate: u32) -> u32 {
    let byte = immediate & 0xff;
    match immediate >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (byte & 0x7f | 0x80).rotate_right(immediate >> 7),
    }
}

/// Sign-extends the lower `bits` bits.
fn sign(value: u32, bits: u32) -> i32 {
    (value << (32 - bits)) as i32 >> (32 - bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(halves: &[u16]) -> Shape {
        let bytes = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        let code = Code { flash: Flash { address: 0x100, bytes }, marks: Vec::new() };
        code.shape(&Function { name: "f".into(), address: 0x100, size: 2 * halves.len() as u32 }).unwrap()
    }

    #[test]
    fn targets_of_calls_and_jumps_are_decoded() {
        // bl .+4+0x10; bl .+4-0x20; bx lr
        assert_eq!(shape(&[0xf000, 0xf808, 0xf7ff, 0xfff0, 0x4770]).calls, [0x114, 0xe8]);
        // b.w .+4+0x100; a short jump within
        assert_eq!(shape(&[0xf000, 0xb880, 0xe7fe]).calls, [0x204]);
        assert!(shape(&[0x4798]).calls_by_register, "blx r3");
        assert_eq!(shape(&[0x4770]), Shape::default(), "bx lr");
    }

    #[test]
    fn float_and_undefined_instructions_are_found() {
        // vmul.f32 s0, s0, s1; vldr d0, [r0]; vmov r0, s0; vcvt.f32.s32 s0, s0
        for float in [[0xee20, 0x0a20], [0xed90, 0x0b00], [0xee10, 0x0a10], [0xeeb8, 0x0ac0]] {
            assert!(shape(&float).floats, "{float:x?}");
        }
        // smull r0, r1, r2, r3; ldrd r0, r1, [r2]; lsl.w r0, r0, r1
        for integer in [[0xfb82, 0x0103], [0xe9d2, 0x0100], [0xfa00, 0xf001]] {
            assert_eq!(shape(&integer), Shape::default(), "{integer:x?}");
        }
        assert!(shape(&[0xdefe]).traps && shape(&[0xf7f0, 0xa000]).traps);
    }

    #[test]
    fn frame_is_the_sum_of_all_stack_reservations() {
        // push {r4, r5, r7, lr}; sub sp, #8
        assert_eq!(shape(&[0xb5b0, 0xb082]).frame, 24);
        // push.w {r4-r11, lr}; vpush {d8, d9}; sub.w sp, sp, #1024; str r11, [sp, #-4]!
        assert_eq!(shape(&[0xe92d, 0x4ff0, 0xed2d, 0x8b04, 0xf5ad, 0x6d80, 0xf84d, 0xbd04]).frame, 36 + 16 + 1024 + 4);
    }
}
