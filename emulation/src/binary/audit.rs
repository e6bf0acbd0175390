//! Checks of an image's machine code:
//!
//! - No call from the control tick, or from that of the isolation bank, leads to a panic, directly or through other
//!   functions, and none has an unknown target. The tick contains no undefined instruction.
//! - The tick uses no floats: it calls no float arithmetic of the compiler's and has no instruction of the float unit.
//! - The image has no allocator.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};

use super::elf::{self, Function};
use super::thumb::Code;

/// Beginning and end of the demangled name of the function that must not panic.
const TICK: (&str, &str) = ("firmware::control::Control", "tick");
/// Beginning and end of the demangled name of the isolation bank's tick, which must not panic in an image that contains it.
const ISOLATION: (&str, &str) = ("firmware::isolation::enabled::Isolation", "tick");
/// Beginning and end of the demangled name of the adaptation's step after each tick, which must not panic either.
const ADAPTATION: (&str, &str) = ("firmware::adaptation::shared", "after_tick");
/// The tick of the C library.
const C_TICK: &str = "vsj_tick";

/// Runs all checks. Returns the number of functions that the tick consists of, its callees included.
pub(crate) fn run(bytes: &[u8]) -> Result<usize> {
    check(bytes, &[TICK])
}

/// Runs all checks, those of the control tick for the tick of the isolation bank as well.
pub(crate) fn with_isolation(bytes: &[u8]) -> Result<usize> {
    check(bytes, &[TICK, ISOLATION])
}

/// Runs all checks, those of the control tick for the bank and the adaptation as well.
pub(crate) fn with_adaptation(bytes: &[u8]) -> Result<usize> {
    check(bytes, &[TICK, ISOLATION, ADAPTATION])
}

fn check(bytes: &[u8], names: &[(&str, &str)]) -> Result<usize> {
    let functions = elf::functions(bytes)?;
    if let Some(found) = functions.iter().find(|f| is_heap(&f.name)) {
        bail!("`{}` is an allocator's", found.name);
    }
    // Otherwise a change of names would make every check pass.
    ensure!(functions.iter().any(|f| is_panic(&f.name)), "the image has no panic at all: have names changed?");
    ensure!(functions.iter().any(|f| is_float(&f.name)), "the image has no float at all: have names changed?");
    let mut roots = Vec::new();
    for name in names {
        roots.extend(instances(&functions, *name)?);
    }
    walk(bytes, &functions, &roots)
}

/// Runs the checks of a program around the C library, which contains no panic at all. Returns the number of functions that its
/// tick consists of.
pub(crate) fn run_c(bytes: &[u8]) -> Result<usize> {
    let functions = elf::functions(bytes)?;
    if let Some(found) = functions.iter().find(|f| is_panic(&f.name) || is_heap(&f.name)) {
        bail!("`{}` is a panic's or an allocator's", found.name);
    }
    ensure!(functions.iter().any(|f| is_float(&f.name)), "the image has no float at all: have names changed?");
    let tick = functions.iter().find(|f| f.name == C_TICK);
    walk(bytes, &functions, &[tick.with_context(|| format!("no function `{C_TICK}` in the image"))?])
}

/// Checks all that can be reached from `roots`; returns the number of functions.
fn walk(bytes: &[u8], functions: &[Function], roots: &[&Function]) -> Result<usize> {
    let code = Code::new(bytes)?;
    let by_address: BTreeMap<u32, &Function> = functions.iter().map(|f| (f.address, f)).collect();
    let mut seen = BTreeSet::new();
    let mut open: Vec<(&Function, String)> = roots.iter().map(|f| (*f, f.name.clone())).collect();
    while let Some((function, path)) = open.pop() {
        if !seen.insert(function.address) {
            continue;
        }
        if is_panic(&function.name) {
            bail!("a way into a panic: {path}");
        }
        ensure!(!is_float(&function.name), "a float: {path}");
        let shape = code.shape(function).with_context(|| format!("in {}", function.name))?;
        ensure!(!shape.floats, "a float's instruction in {path}");
        ensure!(!shape.traps, "an undefined instruction in {path}");
        ensure!(!shape.calls_by_register, "{path} calls through a register, whose target is unknown");
        for target in shape.calls {
            let callee = by_address.get(&target).with_context(|| format!("{path} calls {target:#x}, no function"))?;
            open.push((callee, format!("{path} -> {}", callee.name)));
        }
    }
    Ok(seen.len())
}

/// Every compiled instance of the control tick. None is an error.
pub(crate) fn ticks(functions: &[Function]) -> Result<Vec<&Function>> {
    instances(functions, TICK)
}

/// Every compiled instance of a function with this beginning and end of its name.
fn instances<'a>(functions: &'a [Function], (start, end): (&str, &str)) -> Result<Vec<&'a Function>> {
    let is_one = |f: &&Function| f.name.trim_start_matches('<').starts_with(start) && plain(&f.name).ends_with(end);
    let found: Vec<&Function> = functions.iter().filter(is_one).collect();
    ensure!(!found.is_empty(), "no function `{start}::{end}` in the image");
    Ok(found)
}

/// A function's name without generic arguments at its end.
fn plain(name: &str) -> &str {
    name.split_once("::<").map_or(name, |(name, _)| name)
}

fn is_panic(name: &str) -> bool {
    ["core::panicking", "panic_fmt", "rust_begin_unwind", "unwrap_failed", "expect_failed", "slice_index_fail"]
        .iter()
        .any(|part| name.contains(part))
}

fn is_heap(name: &str) -> bool {
    ["__rust_alloc", "__rustc::__rust_alloc", "__rg_alloc", "malloc", "realloc", "alloc::alloc::"]
        .iter()
        .any(|start| name.starts_with(start))
}

/// Whether a function is float arithmetic of the compiler's, by its own name or by its name in ARM's run-time ABI.
fn is_float(name: &str) -> bool {
    ["compiler_builtins::float", "compiler_builtins::math", "libm::"].iter().any(|part| name.contains(part))
        || name
            .strip_prefix("__aeabi_")
            .is_some_and(|rest| rest.starts_with(['d', 'f']) || rest.contains("2d") || rest.contains("2f"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn float_arithmetic_is_recognised_by_name() {
        for name in
            ["__aeabi_dmul", "__aeabi_fadd", "__aeabi_ui2d", "__aeabi_d2iz", "compiler_builtins::float::mul::__muldf3"]
        {
            assert!(is_float(name), "{name}");
        }
        for name in ["__aeabi_memcpy", "__aeabi_uldivmod", "__aeabi_lmul", "model::controller::Config<E>::tick"] {
            assert!(!is_float(name), "{name}");
        }
    }
}
