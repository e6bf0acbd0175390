//! Pointers of the C interface, which an importer promises to be valid, as references and slices; and errors as its status.

use std::any::Any;
use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::slice;

use anyhow::{Context, Result};
use simulation::bad_input;

use crate::instance::{Instance, Log, State};
use crate::status::{ERROR, FATAL, OK, Status};
use crate::unit::Unit;
use crate::variable::Form;
use crate::version::Version;

/// A function that an importer finds by its name.
macro_rules! exported {
    ($($(#[$about:meta])* fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $answer:ty)? $body:block)*) => {$(
        $(#[$about])*
        #[unsafe(no_mangle)]
        extern "C" fn $name($($argument: $type),*) $(-> $answer)? $body
    )*};
}
pub(crate) use exported;

/// Makes an instance of the unit in a folder of resources; null, with a message, if that fails.
pub(crate) fn instantiate(version: Version, token: *const c_char, resources: Result<PathBuf>, log: Log) -> *mut c_void {
    let make = || -> Result<Unit> {
        let resources = resources?;
        let unit = Unit::read(&resources)?;
        let (found, expected) = (text(token)?, unit.token(version));
        if found != expected {
            bad_input!(
                "the unit's token is {found}: expected {expected}; export the unit again to change its plant file or version"
            );
        }
        Ok(unit)
    };
    match catch_unwind(AssertUnwindSafe(make)) {
        Ok(Ok(unit)) => Box::into_raw(Box::new(Instance::new(unit, log))).cast(),
        Ok(Err(error)) => {
            log(ERROR, &format!("{error:#}"));
            std::ptr::null_mut()
        }
        Err(panic) => {
            log(ERROR, &panic_text(&*panic));
            std::ptr::null_mut()
        }
    }
}

/// Frees an instance.
pub(crate) fn free(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: the importer passes what `instantiate` has returned, once.
        drop(unsafe { Box::from_raw(instance.cast::<Instance>()) });
    }
}

/// Calls `work` with an instance; an error becomes a message and a status, and so does a panic, which must not leave Rust.
pub(crate) fn call(instance: *mut c_void, work: impl FnOnce(&mut Instance) -> Result<()>) -> Status {
    // SAFETY: the importer passes what `instantiate` has returned, one call at a time, and not after `free`.
    let Some(instance) = (unsafe { instance.cast::<Instance>().as_mut() }) else { return ERROR };
    let (message, status) = match catch_unwind(AssertUnwindSafe(|| work(instance))) {
        Ok(Ok(())) => return OK,
        Ok(Err(error)) => (format!("{error:#}"), ERROR),
        Err(panic) => (panic_text(&*panic), FATAL),
    };
    instance.log(ERROR, &message);
    status
}

fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    format!("an error of the unit itself: {}", text.unwrap_or("a panic"))
}

/// Reads variables into an array of the importer.
pub(crate) fn get<T>(
    instance: *mut c_void,
    references: *const u32,
    values: *mut T,
    count: usize,
    forms: &[Form],
    convert: fn(f64) -> T,
) -> Status {
    call(instance, |instance| {
        for (&reference, value) in list(references, count)?.iter().zip(list_to_fill(values, count)?) {
            *value = convert(instance.get(reference, forms)?);
        }
        Ok(())
    })
}

/// Sets variables from an array of the importer.
pub(crate) fn set<T: Copy>(
    instance: *mut c_void,
    references: *const u32,
    values: *const T,
    count: usize,
    forms: &[Form],
    convert: fn(T) -> f64,
) -> Status {
    call(instance, |instance| {
        for (&reference, &value) in list(references, count)?.iter().zip(list(values, count)?) {
            instance.set(reference, forms, convert(value))?;
        }
        Ok(())
    })
}

/// Writes a value to a place of the importer; without a place it is not wanted.
pub(crate) fn put<T>(place: *mut T, value: T) {
    // SAFETY: the importer passes a place for one value, or null.
    if let Some(place) = unsafe { place.as_mut() } {
        *place = value;
    }
}

/// Copies the state of an instance: to a new place if the importer has none yet.
pub(crate) fn save(instance: *mut c_void, place: *mut *mut c_void) -> Status {
    call(instance, |instance| {
        // SAFETY: the importer passes a place for one pointer.
        let place = unsafe { place.as_mut() }.context("no place for a state")?;
        // SAFETY: it holds null or a state of this unit that is not freed.
        match unsafe { place.cast::<State>().as_mut() } {
            Some(state) => *state = instance.save(),
            None => *place = Box::into_raw(Box::new(instance.save())).cast(),
        }
        Ok(())
    })
}

/// Puts an instance into a state.
pub(crate) fn restore(instance: *mut c_void, state: *mut c_void) -> Status {
    call(instance, |instance| {
        // SAFETY: the importer passes a state that `save` has made and that is not freed.
        instance.restore(unsafe { state.cast::<State>().as_ref() }.context("no state")?);
        Ok(())
    })
}

/// Frees a state, and puts null in its place.
pub(crate) fn free_state(place: *mut *mut c_void) -> Status {
    // SAFETY: the importer passes a place with a state, or null.
    if let Some(state) = unsafe { place.as_mut() }.filter(|state| !state.is_null()) {
        // SAFETY: `save` has made it from a box, and null takes its place.
        drop(unsafe { Box::from_raw(state.cast::<State>()) });
        *state = std::ptr::null_mut();
    }
    OK
}

/// A text for the importer, with blanks in place of zeros.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// The status of a function that the description does not promise.
pub(crate) fn unsupported(instance: *mut c_void, name: &str) -> Status {
    call(instance, |_| bad_input!("{name} is called: expected what modelDescription.xml says that the unit can"))
}

/// A text of the importer.
pub(crate) fn text<'a>(text: *const c_char) -> Result<&'a str> {
    if text.is_null() {
        bad_input!("a text is missing");
    }
    // SAFETY: the importer passes texts that end with 0 and live as long as the call.
    Ok(unsafe { CStr::from_ptr(text) }.to_str()?)
}

fn list<'a, T>(values: *const T, count: usize) -> Result<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    if values.is_null() {
        bad_input!("an array of {count} values is missing");
    }
    // SAFETY: the importer passes arrays of this length that live as long as the call.
    Ok(unsafe { slice::from_raw_parts(values, count) })
}

fn list_to_fill<'a, T>(values: *mut T, count: usize) -> Result<&'a mut [T]> {
    if count == 0 {
        return Ok(&mut []);
    }
    if values.is_null() {
        bad_input!("an array for {count} values is missing");
    }
    // SAFETY: the importer passes arrays of this length, for this call alone, with numbers in them.
    Ok(unsafe { slice::from_raw_parts_mut(values, count) })
}
