//! The board with the adaptation, commanded by `vsj link`: its status, its settings, and the switch back to the stored model. No spring is
//! connected, so that its sensor is absent.

use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use xtask::shell;

use super::stage::Stage;
use crate::qemu::emulator;
use crate::talk;

/// Longest wait for a phase: a few blocks of the bank, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// `vsj link` on one port.
struct Host<'a> {
    vsj: &'a Path,
    port: String,
}

impl Host<'_> {
    /// Runs a command and returns its answer.
    fn ask(&self, arguments: &[&str]) -> Result<Value> {
        shell::json(shell::command(self.vsj).args(["link", &self.port, "--timeout", "10", "--json"]).args(arguments))
    }

    /// Runs a command that has to fail with this exit code and these words.
    fn refused(&self, arguments: &[&str], code: i32, words: &str) -> Result<()> {
        let output = shell::command(self.vsj).args(["link", &self.port, "--timeout", "10"]).args(arguments).output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.code() == Some(code) && said.contains(words), "{arguments:?}: {}, {said}", output.status);
        Ok(())
    }

    /// Waits until the adaptation is in this phase.
    fn wait_for(&self, phase: &str) -> Result<Value> {
        let begin = Instant::now();
        loop {
            let said = self.ask(&["adaptation"])?;
            if said["phase"] == phase {
                return Ok(said);
            }
            if begin.elapsed() > PATIENCE {
                bail!("never {phase}: {said}");
            }
            thread::sleep(Duration::from_millis(50));
        }
    }
}

/// Starts the board, and returns what its status says in a line.
pub(super) fn check(stage: &Stage, vsj: &Path) -> Result<String> {
    let folder = stage.folder("switching")?;
    let socket = stage.elf.with_file_name(format!("switching-{}", std::process::id()));
    let host = Host { vsj, port: format!("unix:{}", socket.display()) };
    let file = folder.join("settings.toml");
    let path = file.to_str().context("a path that is not UTF-8")?;
    let write = |text: &str| fs::write(&file, format!("schema = 1\n[adaptation]\n{text}\n"));
    let work = || {
        drop(talk::open(&host.port)?);
        // Without readings the sensor is not trusted.
        host.wait_for("frozen")?;
        let status = &host.ask(&["status"])?["adaptation"];
        let tau_s = &status["parameters"]["tau_s"];
        ensure!(tau_s["value"] == 5.5 && tau_s["model"] == 5.5 && tau_s["high"] == 6.875, "{status}");
        ensure!(status["exchanges"] == 0 && status["last_exchange_s"].is_null(), "{status}");
        let text = shell::output(shell::command(vsj).args(["link", &host.port, "--timeout", "10", "status"]))?;
        let line = text.lines().find(|line| line.starts_with("adaptation")).context("no line")?.to_owned();

        host.ask(&["adaptation", "--off"])?;
        host.wait_for("off")?;
        host.ask(&["adaptation", "--on"])?;
        host.wait_for("frozen")?;

        write("gain = 0.05")?;
        host.ask(&["arm"])?;
        host.refused(&["settings", path], 1, "armed; disarm it first")?;
        host.ask(&["disarm"])?;
        write("gain = 0.6")?;
        host.refused(&["settings", path], 2, "adaptation.gain = 0.6 is not allowed: expected 0 to 0.5")?;
        write("gain = 0.05")?;
        let sent = host.ask(&["settings", path])?;
        ensure!(sent["active"]["format"] == 4 && sent["settings"]["adaptation"]["gain"] == 0.05, "{sent}");
        let gain = &host.ask(&["status"])?["adaptation"]["parameters"]["gain"];
        ensure!(gain["low"] == 0.95 && gain["high"] == 1.05, "{gain}");
        write("enabled = false")?;
        host.ask(&["settings", path])?;
        let status = &host.ask(&["status"])?["adaptation"];
        ensure!(status["phase"] == "off" && status["why"] == "settings", "{status}");
        host.refused(&["adaptation", "--on"], 1, "nothing can adapt: settings")?;
        Ok(line)
    };
    let (line, run) = emulator::obey_in(&folder, &stage.elf, &socket, |_| {}, work)?;
    // On a busy machine the emulator's warnings damage single lines of the log: one of the two is enough.
    let logged = ["returning", "off"].map(|phase| format!("adaptation {phase}"));
    let logged = run.log.iter().any(|line| logged.iter().any(|start| line.message.starts_with(start)));
    ensure!(logged, "the log says nothing of the switch");
    Ok(line)
}
