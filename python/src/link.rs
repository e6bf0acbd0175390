//! A running MCU over its serial link, for `vsj.Link`: the client of the command `vsj link`, with heartbeats from a thread.

use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use link::adaptation::Adaptation;
use link::isolation::Isolation;
use link::{Desired, Reason, Request, Status};
use link_host::{Client, Failure, FaultRow, IsolationRow, Patience, Row, StatusReport, heartbeat, not_disarmed};
use pyo3::prelude::*;
use serde_json::json;
use simulation::settings_file::{SettingsFile, Source};
use simulation::{BadInput, bad_input, plant_file};

use crate::analysis::Plant;
use crate::error::link_exception;

/// Time for which one call waits for telemetry and holds the connection. Heartbeats, calls of other threads and the interpreter's
/// signals have their turn between two calls.
const TURN: Duration = Duration::from_millis(5);

/// A connection, shared with the thread of its heartbeats.
struct Connection {
    client: Client,
    status: Status,
    heartbeat: Duration,
    /// When this program last began to send a request.
    heard: Instant,
}

impl Connection {
    fn order(&mut self, request: Request) -> Result<(&'static str, f64)> {
        // Also of a refused one: an MCU that has restarted would get one with each turn.
        self.heard = Instant::now();
        let (state, target) = self.client.command(request)?;
        Ok((state.name(), target.to_f64()))
    }

    /// Sends a heartbeat if one is due.
    fn beat(&mut self) -> Result<()> {
        if self.heard.elapsed() >= self.heartbeat { self.order(Request::Heartbeat).map(drop) } else { Ok(()) }
    }

    fn name(&self) -> String {
        self.client.name().to_owned()
    }

    /// Reads the status of an MCU whose settings may have changed, and with it the time between heartbeats.
    fn learn(&mut self) -> Result<()> {
        let name = self.name();
        self.status = self.client.status().with_context(|| name)?;
        self.heartbeat = heartbeat(&self.status);
        Ok(())
    }

    /// Reads the status, which also holds after a restart.
    fn status(&mut self) -> Result<String> {
        self.learn()?;
        let name = self.name();
        let isolation = self.client.isolation(Isolation::Read).with_context(|| name.clone())?;
        let adaptation = self.client.adaptation(Adaptation::Read).with_context(|| name.clone())?;
        let brown_out = self.client.brown_out().with_context(|| name)?;
        self.heard = Instant::now();
        let report = StatusReport::new(&self.status, isolation.as_ref(), adaptation.as_ref(), brown_out);
        Ok(serde_json::to_string(&report)?)
    }

    /// The models that run and are stored, and what of `plant`, which is sent, the MCU does not run.
    fn models(&mut self, plant: Option<Plant>) -> Result<(String, Vec<String>)> {
        let (what, file) = match plant {
            None => {
                let name = self.name();
                return Ok((serde_json::to_string(&self.client.models().with_context(|| name)?)?, Vec::new()));
            }
            Some(Plant::Named(path)) => (path.clone(), plant_file::load(&path)?),
            Some(Plant::Text((name, text))) => (name.clone(), plant_file::parse(&name, &text)?),
        };
        let model = file.wire().map_err(|error| BadInput(format!("{what}: {error}")))?;
        let name = self.name();
        match self.client.install(&model) {
            Err(Failure::Refused(reason @ Reason::BadModel { .. })) => bad_input!("{what}: {reason}"),
            answer => Ok((serde_json::to_string(&answer.with_context(|| name)?)?, file.left_out())),
        }
    }

    fn settings(&mut self, path: Option<PathBuf>) -> Result<(String, String)> {
        let (name, path_is_given) = (self.name(), path.is_some());
        let blocks = match &path {
            None => self.client.settings(),
            Some(path) => {
                let source = Source::open(path)?;
                let built_in = self.client.read_settings(true).with_context(|| name.clone())?;
                self.client.install_settings(&source.over(&built_in)?)
            }
        };
        let blocks = match blocks {
            Err(Failure::Refused(reason @ (Reason::BadSettings { .. } | Reason::NotBuiltIn(_)))) => {
                bad_input!("{}: {reason}", path.unwrap_or_default().display())
            }
            blocks => blocks.with_context(|| name.clone())?,
        };
        let running = self.client.read_settings(false).with_context(|| name)?;
        if path_is_given {
            self.learn()?;
        }
        Ok((serde_json::to_string(&blocks)?, SettingsFile::from(&running).to_toml()?))
    }
}

/// Who needs the connection while a heartbeat waits for its answer.
#[derive(Default)]
struct Needs {
    closing: AtomicBool,
    /// Number of calls that wait for the connection.
    waiting: AtomicU32,
}

/// An open port.
#[pyclass(frozen, module = "vsj._vsj")]
pub(crate) struct Port {
    connection: Arc<Mutex<Option<Connection>>>,
    needs: Arc<Needs>,
    beating: Mutex<Option<JoinHandle<Option<Failure>>>>,
}

thread_local! {
    /// The exception of a signal that has come while a request waited for its answer.
    static SIGNAL: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// True if a signal has come for which the interpreter has an exception, as Ctrl-C has.
fn interrupted() -> bool {
    let signal = Python::attach(|py| py.check_signals().err());
    let is_signalled = signal.is_some();
    SIGNAL.set(signal);
    is_signalled
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Sends heartbeats until the port is closed, then disables the output; a lost connection is reported by the next call. Returns why the
/// output may still be enabled: of an MCU that has restarted it is not, and that of another program is not touched.
fn beat(connection: &Mutex<Option<Connection>>, needs: &Arc<Needs>) -> Option<Failure> {
    while !needs.closing.load(Ordering::Relaxed) {
        let mut pause = TURN;
        if let Some(connection) = lock(connection).as_mut() {
            let asked = needs.clone();
            // A call that waits for a heartbeat's answer could not be ended by a signal.
            connection.client.interrupt_when(move || {
                asked.closing.load(Ordering::Relaxed) || asked.waiting.load(Ordering::Relaxed) > 0
            });
            let _ = connection.beat();
            pause = pause.min(connection.heartbeat / 4);
        }
        thread::park_timeout(pause);
    }
    let left = lock(connection).as_mut()?.client.leave();
    left.err().filter(|failure| !matches!(failure, Failure::Refused(Reason::OtherSession | Reason::HelloFirst)))
}

impl Port {
    /// Does `work` with the connection, without the interpreter's lock. A signal ends the wait for an answer with its exception.
    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Connection) -> Result<T> + Send) -> PyResult<T> {
        let done = py.detach(|| {
            self.needs.waiting.fetch_add(1, Ordering::Relaxed);
            let mut connection = lock(&self.connection);
            self.needs.waiting.fetch_sub(1, Ordering::Relaxed);
            let Some(connection) = connection.as_mut() else { bail!("the link is closed") };
            connection.client.interrupt_when(interrupted);
            work(connection)
        });
        SIGNAL.take().map_or_else(|| done.map_err(link_exception), Err)
    }
}

#[pymethods]
impl Port {
    #[new]
    fn new(py: Python<'_>, port: &str, baud: u32, timeout: f64) -> PyResult<Self> {
        let open = || {
            if !(timeout > 0.0 && timeout <= 3600.0) {
                bad_input!("timeout {timeout}: expected a positive number of seconds, at most 3600");
            }
            let timeout = Duration::from_secs_f64(timeout);
            let opened = link_host::Port::open(port, baud, timeout)?;
            let (client, status) = Client::greet(opened, Patience::of(timeout)).with_context(|| port.to_owned())?;
            Ok(Connection { client, heartbeat: heartbeat(&status), status, heard: Instant::now() })
        };
        let connection = Arc::new(Mutex::new(Some(py.detach(open).map_err(link_exception)?)));
        let needs = Arc::<Needs>::default();
        let (shared, asked) = (connection.clone(), needs.clone());
        let beating = thread::spawn(move || beat(&shared, &asked));
        Ok(Self { connection, needs, beating: Mutex::new(Some(beating)) })
    }

    fn status(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, Connection::status)
    }

    fn arm(&self, py: Python<'_>) -> PyResult<(&'static str, f64)> {
        self.with(py, |it| it.order(Request::Arm))
    }

    fn disarm(&self, py: Python<'_>) -> PyResult<(&'static str, f64)> {
        self.with(py, |it| it.order(Request::Disarm))
    }

    fn set(&self, py: Python<'_>, value: f64, unit: &str) -> PyResult<(&'static str, f64)> {
        self.with(py, |it| {
            if !value.is_finite() {
                bad_input!("{value} is not a stiffness; expected a finite number");
            }
            it.order(Request::Set(match unit {
                "V" => Desired::ScaledVolts(value),
                "Pa" => Desired::Pascal(value),
                "N/m" => Desired::NewtonPerMetre(value),
                other => bad_input!("`{other}` is not a unit of stiffness; expected V, Pa or N/m"),
            }))
        })
    }

    fn acknowledge(&self, py: Python<'_>, fault: &str) -> PyResult<(&'static str, f64)> {
        self.with(py, |it| it.order(Request::Acknowledge(link_host::fault(fault)?)))
    }

    /// Asks for telemetry at a rate in Hz, 0 for none.
    fn stream(&self, py: Python<'_>, rate_hz: f64) -> PyResult<()> {
        self.with(py, |it| {
            let every_ticks = match rate_hz {
                0.0 => 0,
                rate if (0.02..=10_000.0).contains(&rate) => {
                    (f64::from(it.status.rate_hz) / rate).round().clamp(1.0, f64::from(u16::MAX)) as u16
                }
                rate => bad_input!("rate_hz {rate}: expected 0.02 to 10000"),
            };
            // Samples of an earlier stream may have come after its end.
            let name = it.name();
            it.client.samples(Duration::ZERO).with_context(|| name)?.for_each(drop);
            it.order(Request::Stream { every_ticks }).map(drop)
        })
    }

    /// Telemetry that arrives within a few milliseconds, as a JSON array, each sample with what the isolation bank has said last.
    fn samples(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |it| {
            it.beat()?;
            let (name, rate_hz) = (it.name(), it.status.rate_hz);
            let samples: Vec<_> = it.client.samples(TURN).with_context(|| name)?.collect();
            let isolation = json!(it.client.verdict().map(|report| IsolationRow::new(&report, rate_hz)));
            let row = |sample| {
                let mut row = json!(Row::new(sample, rate_hz));
                row["isolation"] = isolation.clone();
                row
            };
            Ok(serde_json::to_string(&samples.iter().map(row).collect::<Vec<_>>())?)
        })
    }

    /// The faults that the MCU has reported since the last call, as a JSON array.
    fn faults(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |it| {
            let rows: Vec<_> =
                it.client.reports().iter().map(|report| FaultRow::new(report, it.status.rate_hz)).collect();
            Ok(serde_json::to_string(&rows)?)
        })
    }

    fn dropped_samples(&self, py: Python<'_>) -> PyResult<u64> {
        self.with(py, |it| Ok(it.client.dropped_samples()))
    }

    fn models(&self, py: Python<'_>, plant: Option<Plant>) -> PyResult<(String, Vec<String>)> {
        self.with(py, |it| it.models(plant))
    }

    fn settings(&self, py: Python<'_>, path: Option<PathBuf>) -> PyResult<(String, String)> {
        self.with(py, |it| it.settings(path))
    }

    /// Disables the output, ends the heartbeats and closes the port. Returns what is to be said if the MCU has not confirmed it.
    fn close(&self, py: Python<'_>) -> Option<String> {
        py.detach(|| {
            self.needs.closing.store(true, Ordering::Relaxed);
            let beating = lock(&self.beating).take()?;
            beating.thread().unpark();
            let ended = beating.join();
            let connection = lock(&self.connection).take()?;
            let failure = match ended {
                Ok(failure) => failure?.to_string(),
                Err(_) => "the thread of the heartbeats failed".to_owned(),
            };
            Some(not_disarmed(&connection.name(), &failure, &connection.status))
        })
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        self.needs.closing.store(true, Ordering::Relaxed);
        // The thread never waits for the interpreter.
        if let Some(beating) = lock(&self.beating).take() {
            beating.thread().unpark();
            let _ = beating.join();
        }
    }
}
