//! Files of one run: all of them are written, or none.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use model::Spring;
use tempfile::NamedTempFile;

use simulation::bad_input;
use simulation::experiment::{Experiment, Run, Sample};

/// Files that are written under temporary names and moved to their places when all are complete.
pub struct Files {
    folder: PathBuf,
    written: Vec<(NamedTempFile, PathBuf)>,
}

impl Files {
    /// Prepares files for `folder`, which is created if it does not exist.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if the folder cannot be created.
    pub fn new(folder: &Path) -> Result<Self> {
        if let Err(error) = std::fs::create_dir_all(folder) {
            bad_input!("{}: cannot be created: {error}; expected a writable folder", folder.display());
        }
        Ok(Self { folder: folder.to_owned(), written: Vec::new() })
    }

    /// Writes one file under a temporary name.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, name: &str, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
        let path = self.folder.join(name);
        let complete = || -> std::io::Result<NamedTempFile> {
            let mut buffer = BufWriter::new(tempfile::Builder::new().prefix(".vsj-").tempfile_in(&self.folder)?);
            write(&mut buffer)?;
            Ok(buffer.into_inner()?)
        };
        let file = complete().with_context(|| format!("{} cannot be written", path.display()))?;
        self.written.push((file, path));
        Ok(())
    }

    /// Moves all files to their places; returns their paths.
    ///
    /// # Errors
    /// If a file cannot be moved; [`simulation::bad_input::BadInput`] if its place is taken by something that is not a
    /// file.
    pub fn finish(self) -> Result<Vec<PathBuf>> {
        // Foreseeable errors are checked before the first file is moved.
        for (_, path) in &self.written {
            if path.exists() && !path.is_file() {
                bad_input!("{} cannot be written: it is not a file; expected another folder", path.display());
            }
        }
        let mut paths = Vec::new();
        for (file, path) in self.written {
            let kept = file.persist(&path).with_context(|| format!("{} cannot be written", path.display()))?;
            readable_by_all(&kept).with_context(|| path.display().to_string())?;
            paths.push(path);
        }
        Ok(paths)
    }
}

/// Temporary files are readable by their owner only; results should be readable by all.
#[cfg(unix)]
fn readable_by_all(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable_by_all(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}

/// Writes the run as CSV, one row every `stride` ticks.
///
/// # Errors
/// If `out` cannot be written.
pub fn write_csv<P>(
    out: &mut dyn Write,
    experiment: &Experiment<P>,
    run: &Run,
    samples: &[Sample],
    spring: &Spring,
    stride: usize,
) -> std::io::Result<()> {
    writeln!(
        out,
        "# {} at {} Hz, fixed point; stiffness in volts of equivalent static voltage",
        experiment.name, run.rate_hz
    )?;
    writeln!(out, "time_s,target_v,applied_v,dac_code,stiffness,youngs_modulus_pa")?;
    let mut reader = experiment.schedule.reader();
    for (tick, sample) in samples.iter().enumerate().step_by(stride) {
        let time = run.time_s(tick);
        writeln!(
            out,
            "{},{:.6},{:.6},{},{:.6},{:.1}",
            // Nine decimals hide floating-point errors of decimal times.
            (time * 1e9).round() / 1e9,
            reader.at(time),
            sample.applied.to_f64(),
            sample.code.0,
            sample.stiffness.to_f64(),
            spring.estimate_pa(sample.stiffness),
        )?;
    }
    Ok(())
}
