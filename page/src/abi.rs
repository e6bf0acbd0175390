//! The functions that the worker calls. Requests, files and answers are bytes in this module's memory; the worker has a function
//! for reports on the way. Their prefix keeps the names apart from those of the C library, such as `free`.

use std::panic;
use std::sync::Once;

use identify::Stop;

use crate::request::answer;

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    /// Receives how far a request is, as JSON.
    safe fn progress(text: *const u8, length: usize);
    /// Returns another number than 0 if the worker has not looked for messages for a while.
    safe fn due() -> i32;
    /// Lets the worker look for messages, where the browser can suspend WebAssembly; returns another number than 0 if one asks for
    /// the best answer so far.
    safe fn look() -> i32;
    /// Receives the message of a panic, after which the module must not be called again.
    safe fn panicked(text: *const u8, length: usize);
}

/// Returns memory for `length` bytes, which the worker fills and hands to [`page_call`].
#[unsafe(no_mangle)]
extern "C" fn page_alloc(length: usize) -> *mut u8 {
    Box::into_raw(vec![0u8; length].into_boxed_slice()).cast()
}

/// Frees an answer.
#[unsafe(no_mangle)]
extern "C" fn page_free(bytes: *mut u8, length: usize) {
    drop(owned(bytes, length));
}

/// Answers a request, a JSON object, about files, which may be empty. Frees both; returns the address of the answer in the upper
/// half, its length in the lower.
#[unsafe(no_mangle)]
extern "C" fn page_call(request: *mut u8, request_length: usize, files: *mut u8, files_length: usize) -> u64 {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        panic::set_hook(Box::new(|panic| {
            let text = panic.to_string();
            panicked(text.as_ptr(), text.len());
        }));
    });
    let (request, files) = (owned(request, request_length), owned(files, files_length));
    let stop = Stop::when(|| due() != 0 && look() != 0);
    let answer = answer(&request, &files, &stop, &mut |text| progress(text.as_ptr(), text.len()));
    let length = answer.len() as u64;
    let bytes = Box::into_raw(answer.into_bytes().into_boxed_slice()).cast::<u8>();
    ((bytes as u64) << 32) | length
}

/// Takes back memory that [`page_alloc`] or [`page_call`] has given to the worker.
fn owned(bytes: *mut u8, length: usize) -> Box<[u8]> {
    // SAFETY: the worker passes an address and a length that it got from `page_alloc` or `page_call`, each once; both made them
    // from a boxed slice of this length.
    unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(bytes, length)) }
}
