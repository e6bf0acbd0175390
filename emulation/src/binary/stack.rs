//! The greatest depth of the stack, computed from the machine code: the frame of every function and the deepest chain
//! of calls.
//!
//! Interrupts nest, so the deepest handler of each level is added to the thread, each with the registers that the
//! processor saves. A call through a register may reach any function that no other function calls directly: from an
//! executor a task, from anywhere else (a waker, a formatter) any function but a task. This is an assumption, and so is
//! that such a call is not followed by another one of its kind. A task belongs to one executor, which runs one at a
//! time: as many tasks are added as there are executors, the deepest ones.
//!
//! The function that stops the program disables interrupts first, so nothing nests above it: it is counted once for all
//! levels, and once more for a panic inside it.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};

use super::elf::{self, Function};
use super::thumb::{Code, Shape};

/// Size of the guard region at the stack's lower end, in bytes: see the firmware's `stack_guard`.
pub(crate) const GUARD: u32 = 256;
/// Part of the name of the function through which an executor calls a task.
const POLL: &str = "TaskStorage<F>::poll";
/// The function in which an executor calls its tasks.
const EXECUTOR: &str = "embassy_executor::platform::interrupt::InterruptExecutor::on_interrupt";
/// Number of executors in an image.
const EXECUTORS: usize = 2;
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
    let reset = code.word(elf::symbol(elf, "__RESET_VECTOR")?)? & !1;
    nested(&functions, &shapes, &vectors(elf, &code)?, reset)
}

/// The greatest depth of these functions, of which the vector table contains some and the processor starts one.
fn nested(functions: &[Function], shapes: &BTreeMap<u32, Shape>, vectors: &BTreeSet<u32>, reset: u32) -> Result<u32> {
    let called: BTreeSet<u32> = shapes.values().flat_map(|shape| shape.calls.iter().copied()).collect();
    // Possible targets of calls through a register: not called directly, and not in the vector table.
    let free: Vec<u32> = functions
        .iter()
        .map(|f| f.address)
        .filter(|address| !called.contains(address) && !vectors.contains(address))
        .collect();
    let (polls, others): (Vec<u32>, Vec<u32>) =
        free.into_iter().partition(|address| name(functions, *address).contains(POLL));
    // Of each of these functions, the greatest first.
    let deepest = |depths: &Depths<'_>, addresses: &[u32]| {
        let mut all =
            addresses.iter().map(|address| depths.of(*address, &mut Vec::new())).collect::<Result<Vec<_>>>()?;
        all.sort_unstable_by(|a, b| b.cmp(a));
        anyhow::Ok(all)
    };
    let mut depths = Depths { shapes, functions, behind_register: 0 };
    depths.behind_register = deepest(&depths, &others)?.first().copied().unwrap_or(0);
    let tasks = deepest(&depths, &polls)?;
    let thread = depths.of(reset, &mut Vec::new())?;
    let handlers: Vec<u32> =
        vectors.iter().copied().filter(|address| *address != reset && shapes.contains_key(address)).collect();
    let executes = |handler: &&u32| shapes[handler].calls.iter().any(|call| name(functions, *call) == EXECUTOR);
    let executors = handlers.iter().filter(executes).count();
    ensure!(executors == EXECUTORS, "{executors} interrupts call {EXECUTOR}, expected {EXECUTORS}");
    let handlers = deepest(&depths, &handlers)?;
    let panics: Vec<u32> = functions.iter().filter(|f| f.name.contains(PANIC)).map(|f| f.address).collect();
    let again = deepest(&depths, &panics)?.first().copied().unwrap_or(0);
    let depth_of = |name: &str| {
        let found = functions.iter().find(|f| f.name == name).with_context(|| format!("no function {name}"))?;
        depths.of(found.address, &mut Vec::new())
    };
    let stopping = 2 * depth_of(STOP)?;
    let interrupts = handlers.iter().take(LEVELS).map(|depth| depth + SAVED).sum::<u32>();
    let nested = thread + again + interrupts + tasks.iter().take(EXECUTORS).sum::<u32>();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Frame, calls, and whether it calls through a register, of each function; at address 16 times its place.
    fn depth(functions: &[(&str, u32, &[u32], bool)], vectors: &[u32]) -> Result<u32> {
        let at = |place: usize| 16 * place as u32;
        let named = functions.iter().enumerate();
        let named: Vec<Function> =
            named.map(|(place, f)| Function { name: f.0.into(), address: at(place), size: 16 }).collect();
        let shapes = functions.iter().enumerate().map(|(place, (_, frame, calls, calls_by_register))| {
            let calls = calls.iter().map(|call| 16 * call).collect();
            (at(place), Shape { calls, frame: *frame, calls_by_register: *calls_by_register, ..Shape::default() })
        });
        nested(&named, &shapes.collect(), &vectors.iter().map(|place| 16 * place).collect(), 0)
    }

    #[test]
    fn the_deepest_task_of_each_executor_is_counted_and_no_other() {
        const TASK: &str = "embassy_executor::raw::TaskStorage<F>::poll";
        let image: [(&str, u32, &[u32], bool); 10] = [
            ("Reset", 1000, &[5], false),
            ("CORDIC", 1, &[4], false),
            ("FMAC", 2, &[4], false),
            ("LPUART1", 3, &[], true),
            (EXECUTOR, 10, &[], true),
            (STOP, 0, &[6], false),
            (FRESH, 0, &[], false),
            (TASK, 200, &[], false),
            (TASK, 400, &[], false),
            (TASK, 30, &[], false),
        ];
        assert_eq!(depth(&image, &[0, 1, 2, 3]).unwrap(), 1000 + (1 + 10) + (2 + 10) + 3 + 3 * SAVED + 400 + 200);
        let error = depth(&image, &[0, 1, 3]).unwrap_err().to_string();
        assert!(error.starts_with("1 interrupts call"), "{error}");
    }
}
