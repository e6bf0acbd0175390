//! The greatest depth of the stack, computed from the machine code: the frame of every function and the deepest chain
//! of calls.
//!
//! Interrupts nest, so the deepest handler of each level is added to the thread, each with the registers that the
//! processor saves. A call through a register may reach any function that no other function calls directly: from a
//! handler's own code (an executor) a task, from anywhere else (a waker, a formatter) any function but a task. This is
//! an assumption, and so is that such a call is not followed by another one of its kind.
//!
//! The function that stops the program disables interrupts first, so nothing nests above it: it is counted once for all
//! levels, and once more for a panic inside it.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail};

use super::elf::{self, Function};
use super::thumb::{Code, Shape};

/// Size of the guard region at the stack's lower end, in bytes: see the firmware's `stack_guard`.
pub(crate) const GUARD: u32 = 256;
/// Part of the name of the function through which an executor calls a task.
const POLL: &str = "TaskStorage<F>::poll";
/// Bytes that the processor saves at an interrupt, float registers and alignment included.
const SAVED: u32 = 104 + 4;
/// Name of the function that recurses on purpose, in the drill of a stack overflow.
const DRILL: &str = "deeper";
/// Path of the functions that every panic passes through.
const PANIC: &str = "core::panicking";
/// The function that disables interrupts, logs the cause and resets.
const STOP: &str = "firmware::stop::stop";
/// The function that continues at the top of the stack.
const FRESH: &str = "firmware::stop::on_fresh_stack";
/// Interrupt levels that can nest, deepest handlers first: SysTick, alarm, control, line, tasks below, NMI.
const LEVELS: usize = 6;

/// The greatest depth of the stack of thread and nested handlers together, in bytes. Unexpected recursion is an error.
pub(crate) fn worst(elf: &[u8]) -> Result<u32> {
    let code = Code::new(elf)?;
    let functions = elf::functions(elf)?;
    let shapes: BTreeMap<u32, Shape> =
        functions.iter().map(|f| Ok((f.address, code.shape(f)?))).collect::<Result<_>>()?;
    let called: BTreeSet<u32> = shapes.values().flat_map(|shape| shape.calls.iter().copied()).collect();
    let vectors = vectors(elf, &code)?;
    // Possible targets of calls through a register: not called directly, and not in the vector table.
    let free: Vec<u32> = functions
        .iter()
        .map(|f| f.address)
        .filter(|address| !called.contains(address) && !vectors.contains(address))
        .collect();
    let (polls, others): (Vec<u32>, Vec<u32>) =
        free.into_iter().partition(|address| name(&functions, *address).contains(POLL));
    let deepest = |depths: &Depths<'_>, addresses: &[u32]| {
        let all = addresses.iter().map(|address| depths.of(*address, &mut Vec::new())).collect::<Result<Vec<_>>>()?;
        anyhow::Ok(all.into_iter().max().unwrap_or(0))
    };
    let mut depths = Depths { shapes: &shapes, functions: &functions, behind_register: 0 };
    depths.behind_register = deepest(&depths, &others)?;
    let task = deepest(&depths, &polls)?;
    let reset = code.word(elf::symbol(elf, "__RESET_VECTOR")?)? & !1;
    let thread = depths.of(reset, &mut Vec::new())?;
    let mut handlers = vectors
        .iter()
        .filter(|address| **address != reset && shapes.contains_key(address))
        .map(|address| {
            let own = depths.of(*address, &mut Vec::new())?;
            let shape = &shapes[address];
            Ok(own.max(if shape.calls_by_register { shape.frame + task } else { 0 }))
        })
        .collect::<Result<Vec<_>>>()?;
    handlers.sort_unstable_by(|a, b| b.cmp(a));
    let again = functions.iter().filter(|f| f.name.contains(PANIC)).map(|f| depths.of(f.address, &mut Vec::new()));
    let again = again.collect::<Result<Vec<_>>>()?.into_iter().max().unwrap_or(0);
    let depth_of = |name: &str| {
        let found = functions.iter().find(|f| f.name == name).with_context(|| format!("no function {name}"))?;
        depths.of(found.address, &mut Vec::new())
    };
    let stopping = 2 * depth_of(STOP)?;
    let nested = thread + again + handlers.iter().take(LEVELS).map(|depth| depth + SAVED).sum::<u32>();
    Ok(nested.max(depth_of(FRESH)?) + stopping)
}

/// The addresses in the vector table: the functions that the processor starts.
fn vectors(elf: &[u8], code: &Code) -> Result<BTreeSet<u32>> {
    let (start, end) = elf::range(elf, ".vector_table")?;
    (start + 4..end).step_by(4).map(|at| Ok(code.word(at)? & !1)).collect()
}

struct Depths<'a> {
    shapes: &'a BTreeMap<u32, Shape>,
    functions: &'a [Function],
    behind_register: u32,
}

impl Depths<'_> {
    fn of(&self, address: u32, path: &mut Vec<u32>) -> Result<u32> {
        // Assembly without a size in the symbol table: it has no frame.
        let Some(shape) = self.shapes.get(&address) else { return Ok(0) };
        if [FRESH, STOP].contains(&self.name(address)) && !path.is_empty() {
            return Ok(0);
        }
        if path.contains(&address) {
            let name = self.name(address);
            // A panic inside a panic only resets, and `worst` adds it.
            let panicking = path.iter().any(|address| self.name(*address).contains(PANIC));
            if name.contains(DRILL) || panicking {
                return Ok(0);
            }
            let names: Vec<&str> = path.iter().map(|address| self.name(*address)).collect();
            bail!("recursion: {} -> {name}", names.join(" -> "));
        }
        path.push(address);
        let mut below = if shape.calls_by_register { self.behind_register } else { 0 };
        for call in &shape.calls {
            below = below.max(self.of(*call, path)?);
        }
        path.pop();
        Ok(shape.frame + below)
    }

    fn name(&self, address: u32) -> &str {
        name(self.functions, address)
    }
}

fn name(functions: &[Function], address: u32) -> &str {
    functions.iter().find(|f| f.address == address).map_or("?", |f| &f.name)
}
