//! The functions of FMI 2.0 for co-simulation, by the names and with the arguments of `fmi2FunctionTypes.h`.
#![allow(non_snake_case, reason = "the names of the standard")]

use std::ffi::{c_char, c_int, c_void};

use simulation::bad_input;

use crate::ffi::{
    c_text, call, exported, free, free_state, get, instantiate, put, restore, save, set, text, unsupported,
};
use crate::instance::Log;
use crate::status::{DISCARD, OK, Status, category};
use crate::uri::path;
use crate::variable::Form;
use crate::version::Version;

/// `fmi2CoSimulation`.
const CO_SIMULATION: c_int = 1;
/// `fmi2LastSuccessfulTime`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
/// FMI 2.0 accesses enumerations as integers.
const INTEGERS: &[Form] = &[Form::Integer, Form::Controller];

type Logger = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`.
#[repr(C)]
struct Callbacks {
    logger: Option<Logger>,
    allocate_memory: Option<extern "C" fn(usize, usize) -> *mut c_void>,
    free_memory: Option<extern "C" fn(*mut c_void)>,
    step_finished: Option<extern "C" fn(*mut c_void, Status)>,
    environment: *mut c_void,
}

/// The importer's logger as a function of a message.
fn log(callbacks: *const Callbacks, name: *const c_char) -> Log {
    let name = c_text(text(name).unwrap_or_default());
    // SAFETY: the importer passes its functions, or null.
    let Some(callbacks) = (unsafe { callbacks.as_ref() }) else { return Box::new(|_, _| {}) };
    let (logger, environment) = (callbacks.logger, callbacks.environment);
    Box::new(move |status, message| {
        // The message is a format of `printf`.
        let (message, category) = (c_text(&message.replace('%', "%%")), c_text(category(status)));
        if let Some(logger) = logger {
            // SAFETY: the importer's logger stays as long as its instance; the texts live as long as the call.
            unsafe { logger(environment, name.as_ptr(), status, category.as_ptr(), message.as_ptr()) }
        }
    })
}

exported! {
    fn fmi2GetTypesPlatform() -> *const c_char { c"default".as_ptr() }

    fn fmi2GetVersion() -> *const c_char { c"2.0".as_ptr() }

    fn fmi2SetDebugLogging(_instance: *mut c_void, _on: c_int, _count: usize, _categories: *const *const c_char) -> Status {
        OK
    }

    fn fmi2Instantiate(
        name: *const c_char,
        kind: c_int,
        token: *const c_char,
        resources: *const c_char,
        callbacks: *const Callbacks,
        _visible: c_int,
        _logging: c_int,
    ) -> *mut c_void {
        let resources = || {
            if kind != CO_SIMULATION {
                bad_input!("instantiated for model exchange: expected co-simulation");
            }
            path(text(resources)?)
        };
        instantiate(Version::Two, token, resources(), log(callbacks, name))
    }

    fn fmi2FreeInstance(instance: *mut c_void) { free(instance) }

    fn fmi2SetupExperiment(
        instance: *mut c_void,
        _with_tolerance: c_int,
        _tolerance: f64,
        start_s: f64,
        _with_stop: c_int,
        _stop_s: f64,
    ) -> Status {
        call(instance, |instance| instance.begin_at(start_s))
    }

    fn fmi2EnterInitializationMode(instance: *mut c_void) -> Status {
        call(instance, |instance| instance.enter_initialization())
    }

    fn fmi2ExitInitializationMode(instance: *mut c_void) -> Status {
        call(instance, |instance| instance.exit_initialization())
    }

    fn fmi2Terminate(instance: *mut c_void) -> Status {
        call(instance, |instance| {
            instance.terminate();
            Ok(())
        })
    }

    fn fmi2Reset(instance: *mut c_void) -> Status {
        call(instance, |instance| {
            instance.reset();
            Ok(())
        })
    }

    fn fmi2GetReal(instance: *mut c_void, references: *const u32, count: usize, values: *mut f64) -> Status {
        get(instance, references, values, count, &[Form::Real], |value| value)
    }

    fn fmi2GetInteger(instance: *mut c_void, references: *const u32, count: usize, values: *mut c_int) -> Status {
        get(instance, references, values, count, INTEGERS, |value| value as c_int)
    }

    fn fmi2GetBoolean(instance: *mut c_void, references: *const u32, count: usize, values: *mut c_int) -> Status {
        get(instance, references, values, count, &[], |value| value as c_int)
    }

    fn fmi2GetString(instance: *mut c_void, references: *const u32, count: usize, values: *mut *const c_char) -> Status {
        get(instance, references, values, count, &[], |_| c"".as_ptr())
    }

    fn fmi2SetReal(instance: *mut c_void, references: *const u32, count: usize, values: *const f64) -> Status {
        set(instance, references, values, count, &[Form::Real], |value| value)
    }

    fn fmi2SetInteger(instance: *mut c_void, references: *const u32, count: usize, values: *const c_int) -> Status {
        set(instance, references, values, count, INTEGERS, f64::from)
    }

    fn fmi2SetBoolean(instance: *mut c_void, references: *const u32, count: usize, values: *const c_int) -> Status {
        set(instance, references, values, count, &[], f64::from)
    }

    fn fmi2SetString(instance: *mut c_void, references: *const u32, count: usize, values: *const *const c_char) -> Status {
        set(instance, references, values, count, &[], |_| 0.0)
    }

    fn fmi2GetFMUstate(instance: *mut c_void, state: *mut *mut c_void) -> Status { save(instance, state) }

    fn fmi2SetFMUstate(instance: *mut c_void, state: *mut c_void) -> Status { restore(instance, state) }

    fn fmi2FreeFMUstate(_instance: *mut c_void, state: *mut *mut c_void) -> Status { free_state(state) }

    fn fmi2SerializedFMUstateSize(instance: *mut c_void, _state: *mut c_void, _size: *mut usize) -> Status {
        unsupported(instance, "fmi2SerializedFMUstateSize")
    }

    fn fmi2SerializeFMUstate(instance: *mut c_void, _state: *mut c_void, _bytes: *mut u8, _size: usize) -> Status {
        unsupported(instance, "fmi2SerializeFMUstate")
    }

    fn fmi2DeSerializeFMUstate(instance: *mut c_void, _bytes: *const u8, _size: usize, _state: *mut *mut c_void) -> Status {
        unsupported(instance, "fmi2DeSerializeFMUstate")
    }

    fn fmi2GetDirectionalDerivative(
        instance: *mut c_void,
        _unknowns: *const u32,
        _unknown_count: usize,
        _knowns: *const u32,
        _known_count: usize,
        _seed: *const f64,
        _sensitivity: *mut f64,
    ) -> Status {
        unsupported(instance, "fmi2GetDirectionalDerivative")
    }

    fn fmi2SetRealInputDerivatives(
        instance: *mut c_void,
        _references: *const u32,
        _count: usize,
        _orders: *const c_int,
        _values: *const f64,
    ) -> Status {
        unsupported(instance, "fmi2SetRealInputDerivatives")
    }

    fn fmi2GetRealOutputDerivatives(
        instance: *mut c_void,
        _references: *const u32,
        _count: usize,
        _orders: *const c_int,
        _values: *mut f64,
    ) -> Status {
        unsupported(instance, "fmi2GetRealOutputDerivatives")
    }

    fn fmi2DoStep(instance: *mut c_void, from_s: f64, step_s: f64, _without_return: c_int) -> Status {
        call(instance, |instance| instance.step(from_s, step_s))
    }

    fn fmi2CancelStep(instance: *mut c_void) -> Status { unsupported(instance, "fmi2CancelStep") }

    fn fmi2GetStatus(_instance: *mut c_void, _kind: c_int, _value: *mut Status) -> Status { DISCARD }

    fn fmi2GetRealStatus(instance: *mut c_void, kind: c_int, value: *mut f64) -> Status {
        if kind != LAST_SUCCESSFUL_TIME {
            return DISCARD;
        }
        call(instance, |instance| {
            put(value, instance.time_s());
            Ok(())
        })
    }

    fn fmi2GetIntegerStatus(_instance: *mut c_void, _kind: c_int, _value: *mut c_int) -> Status { DISCARD }

    fn fmi2GetBooleanStatus(_instance: *mut c_void, _kind: c_int, _value: *mut c_int) -> Status { DISCARD }

    fn fmi2GetStringStatus(_instance: *mut c_void, _kind: c_int, _value: *mut *const c_char) -> Status { DISCARD }
}
