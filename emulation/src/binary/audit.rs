//! What must not be in an image, looked up in the image itself.
//!
//! - From the control tick no call leads to a panic, directly or through others, and none goes to an unknown place; nothing
//!   in it is an undefined instruction.
//! - No float in it: neither a call of the compiler's own arithmetic nor an instruction of the float unit.
//! - No allocator.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};

use super::elf::{self, Function};
use super::thumb::Code;

/// The function that must not panic, as its demangled name begins and ends.
const TICK: (&str, &str) = ("firmware::control::Control", "tick");

/// All checks; returns how many functions the tick consists of.
pub(crate) fn run(bytes: &[u8]) -> Result<usize> {
    let functions = elf::functions(bytes)?;
    if let Some(found) = functions.iter().find(|f| is_heap(&f.name)) {
        bail!("`{}` is an allocator's", found.name);
    }
    // A search that finds nothing because names look different would pass everything.
    ensure!(functions.iter().any(|f| is_panic(&f.name)), "the image has no panic at all: have names changed?");
    ensure!(functions.iter().any(|f| is_float(&f.name)), "the image has no float at all: have names changed?");
    let code = Code::new(bytes)?;
    let by_address: BTreeMap<u32, &Function> = functions.iter().map(|f| (f.address, f)).collect();
    let ticks = ticks(&functions)?;

    let mut seen = BTreeSet::new();
    let mut open: Vec<(&Function, String)> = ticks.iter().map(|f| (*f, f.name.clone())).collect();
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
        ensure!(!shape.calls_by_register, "{path} calls through a register: that may lead anywhere");
        for target in shape.calls {
            let callee = by_address.get(&target).with_context(|| format!("{path} calls {target:#x}, no function"))?;
            open.push((callee, format!("{path} -> {}", callee.name)));
        }
    }
    Ok(seen.len())
}

/// The control tick, as often as it was compiled.
pub(crate) fn ticks(functions: &[Function]) -> Result<Vec<&Function>> {
    let is_tick =
        |f: &&Function| f.name.trim_start_matches('<').starts_with(TICK.0) && plain(&f.name).ends_with(TICK.1);
    let ticks: Vec<&Function> = functions.iter().filter(is_tick).collect();
    ensure!(!ticks.is_empty(), "no function `{}::{}` in the image", TICK.0, TICK.1);
    Ok(ticks)
}

/// Without generic arguments at the end.
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

/// Of the arithmetic that the compiler brings along: by its own name, or by that of ARM's run-time interface.
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
    fn floats_are_told_by_name() {
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
