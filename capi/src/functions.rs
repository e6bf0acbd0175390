//! The functions that C calls. A null pointer is an error, never a fault, and so is a configuration or a state without its mark; every
//! other structure may have any bits.

use core::ffi::c_char;

use model::{OutOfRange, Output, Volts, units::Signal};

use crate::controller::{AnyConfig, AnyState};
use crate::settings::All;
use crate::slot::{ConfigSlot, StateSlot};
use crate::tick::{TickInput, TickOutput};

/// `vsj_status`.
pub type Status = i32;
/// `VSJ_OK`.
pub const OK: Status = 0;
/// `VSJ_OUT_OF_RANGE`: a setting or a voltage is outside of its range.
pub const OUT_OF_RANGE: Status = 1;
/// `VSJ_NULL`: a pointer is null.
pub const NULL: Status = 2;
/// `VSJ_NOT_CONFIGURED`: [`vsj_configure`] has not succeeded on this configuration.
pub const NOT_CONFIGURED: Status = 3;
/// `VSJ_NOT_STARTED`: [`vsj_start`] has not succeeded on this state, or with the other kind of spring.
pub const NOT_STARTED: Status = 4;

/// `vsj_error`: the setting that was refused. The texts end with 0.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Refused {
    /// Name of the setting.
    pub field: [c_char; 32],
    /// The value, in `unit`.
    pub value: f64,
    /// Lowest allowed value, in `unit`.
    pub lowest: f64,
    /// Highest allowed value, in `unit`.
    pub highest: f64,
    /// Unit.
    pub unit: [c_char; 64],
}

impl From<OutOfRange> for Refused {
    fn from(error: OutOfRange) -> Self {
        let OutOfRange { field, value, lowest, highest, unit } = error;
        Self { field: text(field), value, lowest, highest, unit: text(unit) }
    }
}

/// A text that ends with 0, cut where it is too long.
fn text<const N: usize>(text: &str) -> [c_char; N] {
    let mut letters = [0; N];
    for (letter, byte) in letters.iter_mut().take(N - 1).zip(text.bytes()) {
        *letter = byte as c_char;
    }
    letters
}

/// A function that C finds by its name.
macro_rules! exported {
    ($($(#[$about:meta])* fn $name:ident($($argument:ident: $type:ty),* $(,)?) -> $answer:ty $body:block)*) => {$(
        $(#[$about])*
        #[unsafe(no_mangle)]
        pub extern "C" fn $name($($argument: $type),*) -> $answer $body
    )*};
}

/// Returns the value, or this function with a status.
macro_rules! expect {
    ($value:expr, $status:expr) => {
        match $value {
            Some(value) => value,
            None => return $status,
        }
    };
}

/// Advances a state by a tick of either kind.
#[inline(always)]
fn advance(
    config: Option<&ConfigSlot>,
    state: Option<&mut StateSlot>,
    input: Option<&TickInput>,
    output: Option<&mut TickOutput>,
    tick: impl FnOnce(&AnyConfig, &mut AnyState, &TickInput) -> Option<Output>,
) -> Status {
    let (config, state) = (expect!(config, NULL), expect!(state, NULL));
    let (input, output) = (expect!(input, NULL), expect!(output, NULL));
    let config = expect!(config.get(), NOT_CONFIGURED);
    let state = expect!(state.get_mut(), NOT_STARTED);
    *output = expect!(tick(config, state, input), NOT_STARTED).into();
    OK
}

exported! {
    /// Puts the report's settings into `settings`.
    fn vsj_paper(settings: Option<&mut All>) -> Status {
        *expect!(settings, NULL) = All::paper();
        OK
    }

    /// Validates and quantizes `settings`; fills `error`, which may be null, if one is refused.
    fn vsj_configure(
        config: Option<&mut ConfigSlot>,
        settings: Option<&All>,
        error: Option<&mut Refused>,
    ) -> Status {
        let (config, settings) = (expect!(config, NULL), expect!(settings, NULL));
        match AnyConfig::new(settings) {
            Ok(any) => {
                config.put(any);
                OK
            }
            Err(refused) => {
                config.clear();
                if let Some(error) = error {
                    *error = refused.into();
                }
                OUT_OF_RANGE
            }
        }
    }

    /// Puts a spring at rest at 0 V into `state`.
    fn vsj_start(config: Option<&ConfigSlot>, state: Option<&mut StateSlot>) -> Status {
        let (config, state) = (expect!(config, NULL), expect!(state, NULL));
        let config = expect!(config.get(), NOT_CONFIGURED);
        state.put(config.start());
        OK
    }

    /// One tick.
    fn vsj_tick(
        config: Option<&ConfigSlot>,
        state: Option<&mut StateSlot>,
        input: Option<&TickInput>,
        output: Option<&mut TickOutput>,
    ) -> Status {
        advance(config, state, input, output, |config, state, input| config.tick(state, input.input()))
    }

    /// One tick with the amplifier off.
    fn vsj_off(
        config: Option<&ConfigSlot>,
        state: Option<&mut StateSlot>,
        input: Option<&TickInput>,
        output: Option<&mut TickOutput>,
    ) -> Status {
        advance(config, state, input, output, |config, state, input| config.off(state, input.measured()))
    }

    /// Makes `config` take over a running state without moving the voltage.
    fn vsj_transfer(config: Option<&ConfigSlot>, state: Option<&mut StateSlot>, target: i32) -> Status {
        let (config, state) = (expect!(config, NULL), expect!(state, NULL));
        let config = expect!(config.get(), NOT_CONFIGURED);
        let state = expect!(state.get_mut(), NOT_STARTED);
        expect!(config.transfer(state, Volts(Signal::from_bits(target))), NOT_STARTED);
        OK
    }

    /// Puts the lowest and the highest voltage that is put out into `lowest` and `highest`.
    fn vsj_range(
        config: Option<&ConfigSlot>,
        lowest: Option<&mut i32>,
        highest: Option<&mut i32>,
    ) -> Status {
        let config = expect!(expect!(config, NULL).get(), NOT_CONFIGURED);
        let (lowest, highest) = (expect!(lowest, NULL), expect!(highest, NULL));
        let range = config.range();
        (*lowest, *highest) = (range.0.0.to_bits(), range.1.0.to_bits());
        OK
    }

    /// Rounds a voltage in V to steps of 2^-20 V.
    fn vsj_from_volts(volts: f64, steps: Option<&mut i32>) -> Status {
        let steps = expect!(steps, NULL);
        match Volts::new(volts) {
            Ok(volts) => {
                *steps = volts.0.to_bits();
                OK
            }
            Err(_) => OUT_OF_RANGE,
        }
    }

    /// Converts steps of 2^-20 V to V, exactly.
    fn vsj_to_volts(steps: i32) -> f64 {
        Volts(Signal::from_bits(steps)).to_f64()
    }
}

/// `vsj_text`: a line of text that ends with 0.
#[cfg(not(target_os = "none"))]
pub type Text = [c_char; 200];

#[cfg(not(target_os = "none"))]
exported! {
    /// Puts the error of `settings` into `line` as the command prints it; an empty line if there is none.
    fn vsj_explain(settings: Option<&All>, line: Option<&mut Text>) -> Status {
        let (settings, line) = (expect!(settings, NULL), expect!(line, NULL));
        match AnyConfig::new(settings) {
            Ok(_) => {
                *line = text("");
                OK
            }
            Err(error) => {
                *line = text(&std::format!("{error}"));
                OUT_OF_RANGE
            }
        }
    }
}
