//! Checksum of a whole run: FNV-1a with 64 bits over every DAC code and every estimate, little-endian.

use firmware::control::Tick;
use model::Output;
use model::isolation::Verdict;

/// Digest of the ticks so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    /// Adds the DAC code that the tick has output, and its estimate.
    pub fn add(&mut self, tick: &Tick) {
        self.bytes(&tick.drive.code().0.to_le_bytes());
        self.bytes(&tick.output.stiffness.0.to_bits().to_le_bytes());
    }

    /// Adds code and estimate of a controller without a supervisor.
    pub fn add_output(&mut self, output: &Output) {
        self.bytes(&output.code.0.to_le_bytes());
        self.bytes(&output.stiffness.0.to_bits().to_le_bytes());
    }

    /// Adds what the isolation bank says, by the number of [`Verdict::code`].
    pub fn add_verdict(&mut self, verdict: Verdict) {
        self.bytes(&verdict.code().to_le_bytes());
    }

    /// The digest as a number.
    pub const fn value(self) -> u64 {
        self.0
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors published by the authors of FNV.
    #[test]
    fn the_digest_is_fnv_1a() {
        let of = |text: &str| {
            let mut digest = Digest::default();
            digest.bytes(text.as_bytes());
            digest.value()
        };
        assert_eq!(of(""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of("a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(of("foobar"), 0x8594_4171_f739_67e8);
    }
}
