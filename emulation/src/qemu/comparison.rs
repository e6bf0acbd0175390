//! A run on the emulated board, compared with the same code on the host.

use anyhow::{Result, bail};
use firmware::control::{Control, Tick};
use link::WireModel;
use model::Volts;
use serde_json::{Value, json};
use test_bench::script::Script;
use test_bench::simulation;
use xtask::build::Opt;

use super::emulator::{Run, SAFE, Written};

/// Results of a run on the emulated board and of the same script on the host.
pub(crate) struct Comparison {
    pub(crate) ticks: u32,
    pub(crate) missed: u32,
    pub(crate) host_digest: u64,
    pub(crate) target_digest: u64,
    /// Index of the first write to the DAC that is not the host's.
    pub(crate) first_difference: Option<usize>,
    /// Smallest, mean and largest number of instructions per tick.
    pub(crate) instructions: [u32; 3],
    /// The emulator's exit code.
    pub(crate) exit: i32,
}

impl Comparison {
    /// Runs the script `name` on the host, without a stored model and without a sensor.
    pub(crate) fn new(name: &str, run: &Run) -> Result<Self> {
        Self::with(name, None, |_| None, run)
    }

    /// Runs the script `name` on the host with the stored model `found`; `measured` returns the sensor's reading before
    /// each tick.
    pub(crate) fn with(
        name: &str,
        found: Option<&WireModel>,
        measured: impl FnMut(u32) -> Option<Volts>,
        run: &Run,
    ) -> Result<Self> {
        Self::after_each(name, found, measured, run, |_, _| ())
    }

    /// Runs the script `name` as [`Comparison::with`] does, and calls `each` after each tick on the host.
    pub(crate) fn after_each(
        name: &str,
        found: Option<&WireModel>,
        measured: impl FnMut(u32) -> Option<Volts>,
        run: &Run,
        mut each: impl FnMut(&mut Control, &Tick),
    ) -> Result<Self> {
        let Some(script) = Script::parse(name) else { bail!("no script `{name}`") };
        // The board writes zero once before its first tick.
        let mut expected = vec![SAFE];
        let digest = simulation::simulate_with(script, found, measured, |control, tick| {
            expected.push(Written { code: tick.drive.code().0, enabled: tick.drive.enabled() });
            each(control, tick);
        })?;
        let different = expected.iter().zip(&run.dac).position(|(host, target)| host != target);
        let done = run.done()?;
        let shorter = expected.len().min(run.dac.len());
        Ok(Self {
            ticks: done.ticks,
            missed: done.missed,
            host_digest: digest.value(),
            target_digest: done.digest,
            first_difference: different.or((expected.len() != run.dac.len()).then_some(shorter)),
            instructions: [done.min, done.mean, done.max],
            exit: run.exit,
        })
    }

    /// An error unless digests and codes agree, no tick was missed and the exit code is 0.
    pub(crate) fn check(&self) -> Result<()> {
        let Self { host_digest, target_digest, .. } = self;
        if host_digest != target_digest {
            bail!("target and host differ: digest {target_digest:016x} on the target, {host_digest:016x} on the host");
        }
        if let Some(index) = self.first_difference {
            bail!("the codes on the DAC's wire differ from the host's from write {index} on");
        }
        if self.missed != 0 || self.exit != 0 {
            bail!("{} ticks missed, the emulator's exit code is {}", self.missed, self.exit);
        }
        Ok(())
    }

    /// The JSON of `cargo xtask emulate`.
    pub(crate) fn report(&self, opt: Opt, run: &Run) -> Value {
        let [min, mean, max] = self.instructions;
        json!({
            "ticks": self.ticks, "missed_ticks": self.missed, "host_digest": hexadecimal(self.host_digest),
            "target_digest": hexadecimal(self.target_digest), "instructions_per_tick": {"min": min, "mean": mean, "max": max},
            "exit": self.exit, "opt": opt.name(), "wall_s": run.took.as_secs_f64(), "dac_writes": run.dac.len(),
        })
    }

    /// The last line of `cargo xtask emulate`.
    pub(crate) fn summary(&self, run: &Run) -> String {
        let [min, mean, max] = self.instructions;
        format!(
            "{} ticks in {:.1} s, {} missed; digest {:016x} on the target, {:016x} on the host; \
             instructions per tick {min} to {max}, mean {mean}",
            self.ticks,
            run.took.as_secs_f64(),
            self.missed,
            self.target_digest,
            self.host_digest,
        )
    }
}

fn hexadecimal(digest: u64) -> String {
    format!("{digest:016x}")
}
