//! What is added up over the ticks of a block, and the means at its end.

use super::Config;
use super::bank::{SLEW_TICKS, SMOOTH_V};
use crate::coefficient::WideGain;
use crate::units::{ScaledStiffness, Signal, Volts, saturated_to_32};

/// Changes of the voltage that are no jump, with 20 fraction bits.
const SMOOTH: u32 = (SMOOTH_V * 1_048_576.0) as u32;

/// Number of ticks that are added together: each sum is then loaded and stored once in as many ticks.
pub(super) const TOGETHER: usize = 4;
const _: () = assert!(TOGETHER == SLEW_TICKS as usize, "each slewed voltage takes one step among them");

/// Sums over the ticks of the present block, divided by their number: in V with 20 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sums {
    /// Number of ticks of the block so far.
    pub(super) ticks: u32,
    /// Inputs of the ticks that are added together.
    voltages: [i32; TOGETHER],
    models: [i32; TOGETHER],
    readings: [i32; TOGETHER],
    /// One bit for each of them without a reading.
    silent: u32,
    voltage: i32,
    model: i32,
    jumps: i64,
    heard: Heard,
    lags: [i32; 3],
    /// Sums of the model at the beginning of the last quarter and of the last half of the block.
    marks: [i32; 2],
    slewed: [i32; 3],
    last_voltage: i32,
}

/// Sums over the readings of the present block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Heard {
    residual: i64,
    /// Number of ticks without a reading.
    missing: u32,
    identical: u32,
    last: i32,
}

/// Means over a block, in V with 20 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Means {
    pub(super) voltage: i32,
    pub(super) model: i32,
    /// Sum of `du |du|`, in V^2 with 10 fraction bits.
    pub(super) jumps: i32,
    /// Mean distance of the slewed voltages from the voltage.
    pub(super) lags: [i32; 3],
    /// Sums of the model over the last quarter and the last half of the block, divided by the ticks of the block.
    pub(super) tails: [i32; 2],
    /// The model in the last tick.
    pub(super) end: i32,
    pub(super) residual: i32,
    /// True if there were enough readings.
    pub(super) usable: bool,
    pub(super) last_reading: i32,
    /// True if three quarters of the readings equal the one before.
    pub(super) pinned: bool,
}

impl Means {
    /// Before the first block.
    pub(super) const NEW: Self = Self {
        voltage: 0,
        model: 0,
        jumps: 0,
        lags: [0; 3],
        tails: [0; 2],
        end: 0,
        residual: 0,
        usable: false,
        last_reading: 0,
        pinned: false,
    };
}

impl Sums {
    /// Before the first tick.
    pub(super) const NEW: Self = Self {
        ticks: 0,
        voltages: [0; TOGETHER],
        models: [0; TOGETHER],
        readings: [0; TOGETHER],
        silent: 0,
        voltage: 0,
        model: 0,
        jumps: 0,
        heard: Heard { residual: 0, missing: 0, identical: 0, last: 0 },
        lags: [0; 3],
        marks: [0; 2],
        slewed: [0; 3],
        last_voltage: 0,
    };

    /// Keeps the inputs of a tick. Returns the number of ticks before it.
    #[inline(always)]
    pub(super) fn keep(&mut self, voltage: Volts, model: ScaledStiffness, reading: Option<ScaledStiffness>) -> u32 {
        let tick = self.ticks;
        let place = tick as usize % TOGETHER;
        self.voltages[place] = voltage.0.to_bits();
        self.models[place] = model.0.to_bits();
        if let Some(reading) = reading {
            self.readings[place] = reading.0.to_bits();
        } else {
            self.silent |= 1 << place;
        }
        self.ticks = tick + 1;
        tick
    }

    /// Adds the ticks that are kept.
    #[inline(always)]
    pub(super) fn add(&mut self, config: &Config) {
        // Written out: the MCU's compiler does not unroll loops.
        let [a, b, c, d] = self.voltages;
        self.jump(self.last_voltage, a);
        self.jump(a, b);
        self.jump(b, c);
        self.jump(c, d);
        self.last_voltage = d;
        let each = config.part;
        self.voltage += part(a, each) + part(b, each) + part(c, each) + part(d, each);
        self.slew(config, 0, a);
        self.slew(config, 1, b);
        self.slew(config, 2, c);
        if self.ticks & config.quarter_mask == TOGETHER as u32 {
            // The beginning of a quarter; at the end of the block those of the last two are left.
            self.marks = [self.model, self.marks[0]];
        }
        let ([a, b, c, d], [first, second, third, fourth]) = (self.models, self.readings);
        self.model += part(a, each) + part(b, each) + part(c, each) + part(d, each);
        if self.silent == 0 {
            let mut heard = self.heard;
            heard.add(first, a);
            heard.add(second, b);
            heard.add(third, c);
            heard.add(fourth, d);
            self.heard = heard;
        } else {
            self.add_heard();
        }
    }

    /// Adds the readings that there are.
    #[inline(never)]
    fn add_heard(&mut self) {
        for place in 0..TOGETHER {
            if self.silent >> place & 1 == 0 {
                self.heard.add(self.readings[place], self.models[place]);
            } else {
                self.heard.missing += 1;
            }
        }
        self.silent = 0;
    }

    /// Finds out whether a change of the voltage is a jump.
    #[inline(always)]
    fn jump(&mut self, from: i32, to: i32) {
        let change = to.saturating_sub(from);
        // One comparison: what is below -SMOOTH wraps to a large number.
        if change.wrapping_add(SMOOTH as i32) as u32 > 2 * SMOOTH {
            self.add_jump(change);
        }
    }

    #[cold]
    #[inline(never)]
    fn add_jump(&mut self, change: i32) {
        let change = i64::from(change);
        self.jumps += (change * change.abs()) >> 20;
    }

    /// One of the slewed voltages takes its step.
    #[inline(always)]
    fn slew(&mut self, config: &Config, index: usize, voltage: i32) {
        let (slewed, reach) = (&mut self.slewed[index], config.reach[index]);
        *slewed = voltage.max(slewed.saturating_sub(reach)).min(slewed.saturating_add(reach));
        self.lags[index] += part(slewed.saturating_sub(voltage), config.slew_part);
    }

    /// Returns the means and starts the next block.
    #[inline(never)]
    pub(super) fn finish(&mut self, config: &Config) -> Means {
        let readings = self.ticks.saturating_sub(self.heard.missing);
        let means = Means {
            voltage: self.voltage,
            model: self.model,
            jumps: saturated_to_32(self.jumps >> 10),
            lags: self.lags,
            tails: self.marks.map(|mark| self.model - mark),
            end: self.models[TOGETHER - 1],
            residual: quotient(self.heard.residual, readings),
            usable: readings >= config.fewest,
            last_reading: self.heard.last,
            pinned: readings >= 4 && 4 * self.heard.identical >= 3 * readings,
        };
        let Self { slewed, last_voltage, heard: Heard { last, .. }, .. } = *self;
        *self = Self { slewed, last_voltage, heard: Heard { last, ..Self::NEW.heard }, ..Self::NEW };
        means
    }
}

impl Heard {
    /// Adds a reading where the model is at `model`.
    #[inline(always)]
    fn add(&mut self, reading: i32, model: i32) {
        self.residual += i64::from(reading.saturating_sub(model));
        self.identical += u32::from(reading == self.last);
        self.last = reading;
    }
}

/// Returns `sum / count`, rounded towards zero, of at most `count` numbers of 32 bits, and 0 without any. In two divisions of 32 bits, for
/// which the MCU has an instruction: `count` is at most the 1024 ticks of a block.
fn quotient(sum: i64, count: u32) -> i32 {
    let magnitude = sum.unsigned_abs();
    let high = (magnitude >> 16) as u32;
    let upper = high.checked_div(count).unwrap_or(0);
    let rest = ((high - upper * count) << 16) + (magnitude as u32 & 0xffff);
    let whole = (upper << 16) + rest.checked_div(count).unwrap_or(0);
    (if sum.is_negative() { whole.wrapping_neg() } else { whole }) as i32
}

/// Returns `value * part / 2^32`, rounded down: a multiplication in place of a shift, since the MCU adds its product in one instruction.
#[inline(always)]
fn part(value: i32, part: i32) -> i32 {
    ((i64::from(value) * i64::from(part)) >> 32) as i32
}

/// Returns `bits * gain`, saturated to 32 bits.
#[inline(always)]
pub(super) fn times(gain: WideGain, bits: i32) -> i32 {
    gain.times(Signal::from_bits(bits)).to_bits()
}

#[cfg(test)]
mod tests {
    use super::{Config, Sums, quotient};
    use crate::isolation::Settings;
    use crate::units::{SampleTime, ScaledStiffness, Signal, Volts};
    use crate::validated::Validate;
    use random_numbers::Xorshift32;

    fn config() -> Config {
        Settings::PAPER.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap().quantize()
    }

    /// A change of the voltage by at most 1 V in a tick is no jump, in either direction; a larger one counts with its square.
    #[test]
    fn a_change_of_more_than_a_volt_is_a_jump() {
        let volt = Signal::ONE.to_bits();
        for (change, squared_v) in
            [(volt, 0), (-volt, 0), (volt + 1, 1), (-volt - 1, -1), (2 * volt, 4), (-2 * volt, -4)]
        {
            let mut sums = Sums::NEW;
            for volts in [0, 0, 0, change] {
                sums.keep(Volts(Signal::from_bits(volts)), ScaledStiffness(Signal::ZERO), None);
            }
            sums.add(&config());
            let jumps = sums.finish(&config()).jumps;
            assert!((jumps - (squared_v << 10)).abs() <= 1, "{change}: {jumps}");
        }
    }

    /// Readings are pinned from three quarters on that equal the one before, the first of a block counted with the last of the block
    /// before.
    #[test]
    fn three_quarters_of_identical_readings_are_pinned() {
        let pinned = |readings: [i32; 8]| {
            let mut sums = Sums::NEW;
            let mut block = |readings: [i32; 8]| {
                for four in readings.as_chunks::<4>().0 {
                    for reading in four {
                        let reading = ScaledStiffness(Signal::from_num(*reading));
                        sums.keep(Volts(Signal::ZERO), ScaledStiffness(Signal::ZERO), Some(reading));
                    }
                    sums.add(&config());
                }
                sums.finish(&config()).pinned
            };
            block([5; 8]);
            block(readings)
        };
        assert!(pinned([5, 5, 5, 5, 5, 5, 6, 7]));
        assert!(!pinned([4, 4, 4, 4, 4, 4, 6, 7]) && !pinned([0, 0, 0, 0, 0, 0, 6, 7]));
    }

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn a_quotient_of_two_short_divisions_is_that_of_a_long_one() {
        assert_eq!(quotient(i64::MAX >> 20, 0), 0);
        let mut numbers = Xorshift32::new(7);
        let mut next = || numbers.draw();
        for _ in 0..100_000 {
            let count = next() % 1024 + 1;
            let sum = (i64::from(next() as i32) >> (next() % 32)) * i64::from(count) + i64::from(next() % count);
            for sum in [sum, i64::from(i32::MIN) * i64::from(count), i64::from(i32::MAX) * i64::from(count)] {
                assert_eq!(i64::from(quotient(sum, count)), sum / i64::from(count), "{sum} {count}");
            }
        }
    }
}
