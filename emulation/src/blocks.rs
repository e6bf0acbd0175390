//! `cargo xtask emulate --blocks`: instructions per tick for each kind of spring under each controller. One run of
//! `test-bench/examples/blocks.rs` counts them; the digest of each combination is compared with the host's, and at opt-level s the
//! counts with what they were.

use anyhow::{Result, ensure};
use firmware::control::Untimed;
use serde_json::{Value, json};
use test_bench::blocks::{CONTROLLERS, SPRINGS, run as on_this_machine};

use xtask::build::Opt;

use crate::qemu::emulator;

/// Mean and largest number of instructions per tick: one row for each spring, one column for each controller.
type Table = Vec<[(u32, u32); CONTROLLERS.len()]>;

/// The table of docs/firmware.md, at opt-level s.
const EXPECTED: [[(u32, u32); CONTROLLERS.len()]; SPRINGS.len()] = [
    [(90, 91), (121, 121), (189, 189), (286, 389)],
    [(154, 154), (223, 223), (462, 462), (919, 1034)],
    [(294, 294), (363, 364), (1072, 1290), (1687, 1923)],
    [(222, 222), (291, 291), (626, 626), (1144, 1258)],
    [(198, 198), (283, 283), (560, 560), (1127, 1241)],
    [(202, 202), (271, 272), (616, 617), (1111, 1225)],
    [(171, 171), (246, 246), (502, 502), (1004, 1118)],
    [(205, 205), (292, 292), (582, 582), (1175, 1289)],
    [(505, 505), (608, 608), (1601, 1808), (2558, 2785)],
];

/// Counts and prints the table. A digest that differs from the host's is an error, and so is a count that is more than 5 % above or below
/// what it was.
pub(crate) fn run(opt: Opt, as_json: bool) -> Result<()> {
    let counted = count(opt)?;
    if as_json {
        println!("{}", report(opt, &counted));
    } else {
        print!("{}", table(opt, &counted));
    }
    if opt == Opt::S { check(&counted) } else { Ok(()) }
}

fn check(counted: &Table) -> Result<()> {
    for (((spring, _), row), expected) in SPRINGS.iter().zip(counted).zip(EXPECTED) {
        for (((controller, _), &is), was) in CONTROLLERS.iter().zip(row).zip(expected) {
            ensure!(
                near(is.0, was.0) && near(is.1, was.1),
                "{spring}, {controller}: {is:?} instructions (mean, max), expected {was:?} within 5 %: if that is right, \
                 change the table here and in docs/firmware.md"
            );
        }
    }
    Ok(())
}

/// True if a count differs by at most 5 % from what it was, either way.
pub(crate) fn near(is: u32, was: u32) -> bool {
    20 * is.abs_diff(was) <= was
}

fn count(opt: Opt) -> Result<Table> {
    let run = emulator::count("blocks", "mps2-an386,robust", opt)?;
    let mut counted = vec![[(0, 0); CONTROLLERS.len()]; SPRINGS.len()];
    for (row, (name, plant)) in SPRINGS.iter().enumerate() {
        for (column, (controller, compensation)) in CONTROLLERS.iter().enumerate() {
            let values = run.values(&format!("block spring={row} controller={column} "))?;
            let host = on_this_machine(plant.as_ref(), *compensation, &mut Untimed)?;
            let target = u64::from_str_radix(&values.get::<String>("digest")?, 16)?;
            ensure!(host == target, "{name}, {controller}: digest {target:016x} on the target, {host:016x} here");
            counted[row][column] = (values.get("mean")?, values.get("max")?);
        }
    }
    Ok(counted)
}

fn table(opt: Opt, counted: &Table) -> String {
    let head = format!("instructions/tick, opt-level {}: mean, max", opt.name());
    let mut text = format!("{head:<44}");
    for (name, _) in CONTROLLERS {
        text += &format!("{name:>14}");
    }
    text.push('\n');
    for ((name, _), row) in SPRINGS.iter().zip(counted) {
        text += &format!("{name:<44}");
        for (mean, most) in row {
            text += &format!("{mean:>8}{most:>6}");
        }
        text.push('\n');
    }
    text + "every code and estimate as on the host\n"
}

fn report(opt: Opt, counted: &Table) -> Value {
    let rows = SPRINGS.iter().zip(counted).flat_map(|((spring, _), row)| {
        CONTROLLERS.iter().zip(row).map(move |((controller, _), (mean, max))| {
            json!({"spring": spring, "controller": controller, "mean": mean, "max": max})
        })
    });
    json!({"opt": opt.name(), "rows": rows.collect::<Vec<_>>()})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_that_is_five_percent_off_either_way_is_an_error() {
        let with = |row: usize, column: usize, (mean, most): (u32, u32)| {
            let mut counted = EXPECTED.to_vec();
            counted[row][column] = (mean, most);
            check(&counted)
        };
        // The plain spring without a controller: 5 % of its counts is less than 5 and more than 4.
        let (mean, most) = EXPECTED[0][0];
        assert!(with(0, 0, (mean, most)).is_ok() && with(0, 0, (mean - 4, most + 4)).is_ok());
        for counts in [(mean - 5, most), (mean + 5, most), (mean, most - 5), (mean, most + 5)] {
            assert!(with(0, 0, counts).is_err(), "{counts:?}");
        }
        let (mean, most) = EXPECTED[8][3];
        let error = with(8, 3, (mean, 3000)).unwrap_err().to_string();
        let expected =
            format!("all of it, robust: ({mean}, 3000) instructions (mean, max), expected ({mean}, {most}) within 5 %");
        assert!(error.starts_with(&expected), "{error}");
    }

    /// The page shows the counts that are compared with.
    #[test]
    fn the_page_shows_the_expected_counts() {
        let page = std::fs::read_to_string(xtask::shell::root().join("docs/firmware.md")).unwrap();
        assert!(page.contains(&table(Opt::S, &EXPECTED.to_vec())), "{}", table(Opt::S, &EXPECTED.to_vec()));
    }
}
