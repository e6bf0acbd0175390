//! The functions of FMI 3.0, by the names and with the arguments of `fmi3FunctionTypes.h`. An importer may demand them all; what is
//! for model exchange and scheduled execution, for clocks and for types of variables that no unit has is an error.
#![allow(non_snake_case, reason = "the names of the standard")]

use std::ffi::{c_char, c_int, c_void};
use std::path::PathBuf;

use crate::ffi::{self, c_text, call, exported, free, free_state, get, instantiate, put, restore, save, set, text};
use crate::instance::Log;
use crate::status::{ERROR, OK, Status, category};
use crate::variable::Form;
use crate::version::Version;

type Logger = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);
type IntermediateUpdate = extern "C" fn(*mut c_void, f64, bool, bool, bool, bool, *mut bool, *mut f64);

/// The importer's logger as a function of a message.
fn log(logger: Option<Logger>, environment: *mut c_void) -> Log {
    Box::new(move |status, message| {
        let (message, category) = (c_text(message), c_text(category(status)));
        if let Some(logger) = logger {
            // SAFETY: the importer's logger stays as long as its instance; the texts live as long as the call.
            unsafe { logger(environment, status, category.as_ptr(), message.as_ptr()) }
        }
    })
}

exported! {
    fn fmi3GetVersion() -> *const c_char { c"3.0".as_ptr() }

    fn fmi3SetDebugLogging(_instance: *mut c_void, _on: bool, _count: usize, _categories: *const *const c_char) -> Status {
        OK
    }

    fn fmi3InstantiateCoSimulation(
        _name: *const c_char,
        token: *const c_char,
        resources: *const c_char,
        _visible: bool,
        _logging: bool,
        _events: bool,
        _early_return: bool,
        _intermediate: *const u32,
        _intermediate_count: usize,
        environment: *mut c_void,
        logger: Option<Logger>,
        _update: Option<IntermediateUpdate>,
    ) -> *mut c_void {
        instantiate(Version::Three, token, text(resources).map(PathBuf::from), log(logger, environment))
    }

    fn fmi3InstantiateModelExchange(
        _name: *const c_char,
        _token: *const c_char,
        _resources: *const c_char,
        _visible: bool,
        _logging: bool,
        environment: *mut c_void,
        logger: Option<Logger>,
    ) -> *mut c_void {
        log(logger, environment)(ERROR, "instantiated for model exchange: expected co-simulation");
        std::ptr::null_mut()
    }

    fn fmi3InstantiateScheduledExecution(
        _name: *const c_char,
        _token: *const c_char,
        _resources: *const c_char,
        _visible: bool,
        _logging: bool,
        environment: *mut c_void,
        logger: Option<Logger>,
        _clock_update: Option<extern "C" fn(*mut c_void)>,
        _lock: Option<extern "C" fn()>,
        _unlock: Option<extern "C" fn()>,
    ) -> *mut c_void {
        log(logger, environment)(ERROR, "instantiated for scheduled execution: expected co-simulation");
        std::ptr::null_mut()
    }

    fn fmi3FreeInstance(instance: *mut c_void) { free(instance) }

    fn fmi3EnterInitializationMode(
        instance: *mut c_void,
        _with_tolerance: bool,
        _tolerance: f64,
        start_s: f64,
        _with_stop: bool,
        _stop_s: f64,
    ) -> Status {
        call(instance, |instance| {
            instance.begin_at(start_s)?;
            instance.enter_initialization()
        })
    }

    fn fmi3ExitInitializationMode(instance: *mut c_void) -> Status {
        call(instance, |instance| instance.exit_initialization())
    }

    fn fmi3Terminate(instance: *mut c_void) -> Status {
        call(instance, |instance| {
            instance.terminate();
            Ok(())
        })
    }

    fn fmi3Reset(instance: *mut c_void) -> Status {
        call(instance, |instance| {
            instance.reset();
            Ok(())
        })
    }

    fn fmi3GetFMUState(instance: *mut c_void, state: *mut *mut c_void) -> Status { save(instance, state) }

    fn fmi3SetFMUState(instance: *mut c_void, state: *mut c_void) -> Status { restore(instance, state) }

    fn fmi3FreeFMUState(_instance: *mut c_void, state: *mut *mut c_void) -> Status { free_state(state) }

    fn fmi3DoStep(
        instance: *mut c_void,
        from_s: f64,
        step_s: f64,
        _without_return: bool,
        event_handling: *mut bool,
        terminate: *mut bool,
        early_return: *mut bool,
        last_s: *mut f64,
    ) -> Status {
        call(instance, |instance| {
            for place in [event_handling, terminate, early_return] {
                put(place, false);
            }
            put(last_s, from_s);
            instance.step(from_s, step_s)?;
            put(last_s, instance.time_s());
            Ok(())
        })
    }
}

/// Functions that get and set variables of a type: none is too large for a double.
macro_rules! accessed {
    ($($get:ident $set:ident $type:ty, $forms:expr;)*) => { exported! {$(
        fn $get(instance: *mut c_void, references: *const u32, count: usize, values: *mut $type, _value_count: usize) -> Status {
            get(instance, references, values, count, $forms, |value| value as $type)
        }

        fn $set(instance: *mut c_void, references: *const u32, count: usize, values: *const $type, _value_count: usize) -> Status {
            set(instance, references, values, count, $forms, |value| value as f64)
        }
    )*} };
}

accessed! {
    fmi3GetFloat64 fmi3SetFloat64 f64, &[Form::Real];
    fmi3GetFloat32 fmi3SetFloat32 f32, &[];
    fmi3GetInt8 fmi3SetInt8 i8, &[];
    fmi3GetUInt8 fmi3SetUInt8 u8, &[];
    fmi3GetInt16 fmi3SetInt16 i16, &[];
    fmi3GetUInt16 fmi3SetUInt16 u16, &[];
    fmi3GetInt32 fmi3SetInt32 i32, &[Form::Integer];
    fmi3GetUInt32 fmi3SetUInt32 u32, &[];
    fmi3GetInt64 fmi3SetInt64 i64, &[Form::Controller];
    fmi3GetUInt64 fmi3SetUInt64 u64, &[];
}

/// Functions that the description does not promise.
macro_rules! unsupported {
    ($($name:ident($($argument:ident: $type:ty),* $(,)?);)*) => { exported! {$(
        fn $name(instance: *mut c_void, $($argument: $type),*) -> Status {
            ffi::unsupported(instance, stringify!($name))
        }
    )*} };
}

unsupported! {
    fmi3EnterEventMode();
    fmi3GetBoolean(_value_references: *const u32, _n_value_references: usize, _values: *mut bool, _n_values: usize);
    fmi3GetString(_value_references: *const u32, _n_value_references: usize, _values: *mut *const c_char, _n_values: usize);
    fmi3GetBinary(_value_references: *const u32, _n_value_references: usize, _value_sizes: *mut usize, _values: *mut *const u8, _n_values: usize);
    fmi3GetClock(_value_references: *const u32, _n_value_references: usize, _values: *mut bool);
    fmi3SetBoolean(_value_references: *const u32, _n_value_references: usize, _values: *const bool, _n_values: usize);
    fmi3SetString(_value_references: *const u32, _n_value_references: usize, _values: *const *const c_char, _n_values: usize);
    fmi3SetBinary(_value_references: *const u32, _n_value_references: usize, _value_sizes: *const usize, _values: *const *const u8, _n_values: usize);
    fmi3SetClock(_value_references: *const u32, _n_value_references: usize, _values: *const bool);
    fmi3GetNumberOfVariableDependencies(_value_reference: u32, _n_dependencies: *mut usize);
    fmi3GetVariableDependencies(_dependent: u32, _element_indices_of_dependent: *mut usize, _independents: *mut u32, _element_indices_of_independents: *mut usize, _dependency_kinds: *mut c_int, _n_dependencies: usize);
    fmi3SerializedFMUStateSize(_state: *mut c_void, _size: *mut usize);
    fmi3SerializeFMUState(_state: *mut c_void, _serialized_state: *mut u8, _size: usize);
    fmi3DeserializeFMUState(_serialized_state: *const u8, _size: usize, _state: *mut *mut c_void);
    fmi3GetDirectionalDerivative(_unknowns: *const u32, _n_unknowns: usize, _knowns: *const u32, _n_knowns: usize, _seed: *const f64, _n_seed: usize, _sensitivity: *mut f64, _n_sensitivity: usize);
    fmi3GetAdjointDerivative(_unknowns: *const u32, _n_unknowns: usize, _knowns: *const u32, _n_knowns: usize, _seed: *const f64, _n_seed: usize, _sensitivity: *mut f64, _n_sensitivity: usize);
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3GetIntervalDecimal(_value_references: *const u32, _n_value_references: usize, _intervals: *mut f64, _qualifiers: *mut c_int);
    fmi3GetIntervalFraction(_value_references: *const u32, _n_value_references: usize, _counters: *mut u64, _resolutions: *mut u64, _qualifiers: *mut c_int);
    fmi3GetShiftDecimal(_value_references: *const u32, _n_value_references: usize, _shifts: *mut f64);
    fmi3GetShiftFraction(_value_references: *const u32, _n_value_references: usize, _counters: *mut u64, _resolutions: *mut u64);
    fmi3SetIntervalDecimal(_value_references: *const u32, _n_value_references: usize, _intervals: *const f64);
    fmi3SetIntervalFraction(_value_references: *const u32, _n_value_references: usize, _counters: *const u64, _resolutions: *const u64);
    fmi3SetShiftDecimal(_value_references: *const u32, _n_value_references: usize, _shifts: *const f64);
    fmi3SetShiftFraction(_value_references: *const u32, _n_value_references: usize, _counters: *const u64, _resolutions: *const u64);
    fmi3EvaluateDiscreteStates();
    fmi3UpdateDiscreteStates(_discrete_states_need_update: *mut bool, _terminate_simulation: *mut bool, _nominals_of_continuous_states_changed: *mut bool, _values_of_continuous_states_changed: *mut bool, _next_event_time_defined: *mut bool, _next_event_time: *mut f64);
    fmi3EnterContinuousTimeMode();
    fmi3CompletedIntegratorStep(_no_set_state_prior_to_current_point: bool, _enter_event_mode: *mut bool, _terminate_simulation: *mut bool);
    fmi3SetTime(_time: f64);
    fmi3SetContinuousStates(_continuous_states: *const f64, _n_continuous_states: usize);
    fmi3GetContinuousStateDerivatives(_derivatives: *mut f64, _n_continuous_states: usize);
    fmi3GetEventIndicators(_event_indicators: *mut f64, _n_event_indicators: usize);
    fmi3GetContinuousStates(_continuous_states: *mut f64, _n_continuous_states: usize);
    fmi3GetNominalsOfContinuousStates(_nominals: *mut f64, _n_continuous_states: usize);
    fmi3GetNumberOfEventIndicators(_n_event_indicators: *mut usize);
    fmi3GetNumberOfContinuousStates(_n_continuous_states: *mut usize);
    fmi3EnterStepMode();
    fmi3GetOutputDerivatives(_value_references: *const u32, _n_value_references: usize, _orders: *const i32, _values: *mut f64, _n_values: usize);
    fmi3ActivateModelPartition(_clock_reference: u32, _activation_time: f64);
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::status::WARNING;

    static HEARD: Mutex<Vec<(Status, String, String)>> = Mutex::new(Vec::new());

    extern "C" fn hear(_: *mut c_void, status: Status, category: *const c_char, message: *const c_char) {
        let [category, message] = [category, message].map(|it| text(it).expect("a text").to_owned());
        HEARD.lock().expect("nothing panics in it").push((status, category, message));
    }

    #[test]
    fn a_message_has_the_category_of_its_status() {
        let log = log(Some(hear), std::ptr::null_mut());
        log(ERROR, "wrong");
        log(WARNING, "100 % without effect");
        let expected = [(ERROR, "logStatusError", "wrong"), (WARNING, "logStatusWarning", "100 % without effect")];
        let heard = HEARD.lock().expect("nothing panics in it");
        assert!(
            heard.iter().map(|(status, category, text)| (*status, category.as_str(), text.as_str())).eq(expected),
            "{heard:?}"
        );
    }
}
