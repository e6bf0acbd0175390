use std::path::{Path, PathBuf};

use link::reply::{Counters, Firmware};
use link::{
    AdaptationReport, Controller, Fault, FaultReport, IsolationReport, Mismatch, Sensor, State, Status, Telemetry,
    WireVolts,
};
use model::Plant;
use model::adaptation::{Parameters, Phase, Settings};
use model::isolation::{Cause, Verdict};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::KeyCode;

use super::draw;
use crate::watch::message::{Event, Playing, Progress};
use crate::watch::view::View;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The screen of a terminal of this size as text, a line for each row.
fn screen(view: &View, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(view, frame)).unwrap();
    let buffer = terminal.backend().buffer();
    let cells = buffer.content().chunks(usize::from(width));
    let row = |row: &[ratatui::buffer::Cell]| row.iter().map(ratatui::buffer::Cell::symbol).collect::<String>();
    cells.map(|cells| row(cells).trim_end().to_owned() + "\n").collect()
}

/// Compares with an approved screen in `host-sim/tests/golden/watch/`; with `GOLDEN=write` in the environment, writes it instead.
fn golden(name: &str, found: &str) {
    let path = root().join("host-sim/tests/golden/watch").join(name);
    if std::env::var_os("GOLDEN").is_some_and(|what| what == "write") {
        std::fs::write(&path, found).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == expected, "{name} differs from the screen; GOLDEN=write replaces it. Screen:\n{found}");
}

fn volts(volts: f64) -> WireVolts {
    WireVolts::from_f64(volts)
}

/// A step from 100 V to 300 V that is overshot on purpose, seen for 25 s at 100 Hz; without samples from 18 s to 20 s.
fn sample(tick: u64) -> Telemetry {
    let since_s = tick as f64 / 1000.0 - 10.0;
    let decay = (-since_s.max(0.0) / 1.2).exp();
    let (target, applied, estimate) =
        if since_s < 0.0 { (100.0, 100.0, 100.0) } else { (300.0, 300.0 + 280.0 * decay, 300.0 - 180.0 * decay) };
    Telemetry {
        tick,
        state: State::Armed,
        target: volts(target),
        applied: volts(applied),
        estimate: volts(estimate),
        measured: Some(volts(0.97 * estimate)),
        code: (applied / 700.0 * 4095.0) as u16,
        limits: 0,
        mismatch: Mismatch(0),
        sensor: Sensor(1),
    }
}

fn status(sample: Telemetry) -> Status {
    Status {
        firmware: Firmware { major: 0, minor: 1, patch: 0, revision: 0x1234_abcd, controller: Controller::Paper },
        rate_hz: 1000,
        silence_limit_ticks: 500,
        lowest: volts(0.0),
        highest: volts(700.0),
        overruns: 0,
        fault: Fault::NONE,
        last_fault: Fault::NONE,
        sample,
        counters: Counters::default(),
    }
}

/// A view after 25 s.
fn view() -> View {
    let mut view = View::new("/dev/ttyACM0", "stair", status(sample(0)));
    for second in (0..25u64).filter(|second| !(18..20).contains(second)) {
        let samples = (0..100).map(|step| sample(second * 1000 + step * 10)).collect();
        view.on_event(Event::Samples { host_s: second as f64, samples });
    }
    view
}

#[test]
fn an_armed_mcu_whose_schedule_is_recorded() {
    let mut view = view();
    view.on_event(Event::Playing(Some(Playing { elapsed_s: 24.9, length_s: 70.0 })));
    view.on_event(Event::Recording(Some(Progress { file: "out.csv".into(), rows: 2301, lost: 200 })));
    view.on_event(Event::Done("armed, target 300.000 V".into()));
    let found = screen(&view, 100, 30);
    golden("armed.txt", &found);
    in_manual(&found);
}

/// Compares with the screen in the manual.
fn in_manual(found: &str) {
    let path = root().join("docs/watch.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once("```text\n").expect("the page has a screen");
    let (quoted, after) = rest.split_once("```").expect("the screen has an end");
    if std::env::var_os("GOLDEN").is_some_and(|what| what == "write") {
        std::fs::write(&path, format!("{before}```text\n{found}```{after}")).unwrap();
        return;
    }
    assert!(quoted == found, "docs/watch.md differs from the screen; GOLDEN=write replaces it");
}

#[test]
fn faults_with_remedy_and_a_lost_connection() {
    let mut view = view();
    let faulted =
        Telemetry { state: State::Faulted, applied: volts(0.0), code: 0, mismatch: Mismatch(3), ..sample(25_000) };
    view.on_event(Event::Status(Status { fault: Fault(6), overruns: 3, ..status(faulted) }));
    view.on_event(Event::Faults(FaultReport { fault: Fault(6), standing: 0b10_1000, ..FaultReport::default() }));
    view.on_event(Event::Failed("refused: the cause of the fault is still there: monitor (6)".into()));
    let found = screen(&view, 80, 24);
    assert!(found.contains("FAULT monitor (6): remove what the monitors name"), "{found}");
    golden("faulted.txt", &found);
    view.on_event(Event::Lost("the other side closed the connection".into()));
    let found = screen(&view, 80, 24);
    assert!(found.starts_with(" WAS FAULTED  LOST, reconnecting: the other side closed the connection"), "{found}");
}

#[test]
fn a_cause_that_the_isolation_bank_has_named_is_shown_until_the_bank_is_quiet() {
    let mut view = view();
    let report = |verdict: Verdict| IsolationReport {
        verdict: verdict.code(),
        since_tick: 20_096,
        size: 0.1,
        half_width: 0.002,
        explained: 0.998,
        ..IsolationReport::default()
    };
    view.on_event(Event::Isolation(report(Verdict::Named(Cause::GainError))));
    let found = screen(&view, 110, 30);
    let expected = "ISOLATION named gain-error, size 0.1000 (0.0980 to 0.1020), explains 99.80 %, since 20.10 s";
    assert!(found.contains(expected), "{found}");
    view.on_event(Event::Isolation(report(Verdict::Quiet)));
    assert!(!screen(&view, 110, 30).contains("ISOLATION"));
}

#[test]
fn an_adaptation_is_shown_unless_it_watches_with_the_stored_model() {
    let mut view = view();
    let report = |phase, gain| {
        let parameters = Parameters { gain, ..Parameters::STORED };
        Event::Adaptation(AdaptationReport::new(phase, &parameters, &Settings::TYPICAL, Plant::PAPER))
    };
    view.on_event(report(Phase::Watching, 1.05));
    let found = screen(&view, 200, 30);
    assert!(found.contains("ADAPTATION watching, time constant 5.5000 s") && found.contains("gain 1.0500"), "{found}");
    view.on_event(report(Phase::Watching, 1.0));
    assert!(!screen(&view, 200, 30).contains("ADAPTATION"));
    view.on_event(report(Phase::Off, 1.0));
    assert!(screen(&view, 200, 30).contains("ADAPTATION off"));
}

#[test]
fn help_and_input() {
    let mut view = view();
    view.on_key(KeyCode::Char('?').into());
    golden("help.txt", &screen(&view, 80, 24));
    view.on_key(KeyCode::Esc.into());
    view.on_key(KeyCode::Char('4').into());
    assert!(screen(&view, 80, 24).contains(" target, 0 to 700 V or with Pa, N/m: 4_"));
}

#[test]
fn every_size_is_drawn_and_state_and_keys_remain_to_the_last() {
    let mut all = view();
    let view = view();
    all.on_key(KeyCode::Char('?').into());
    for (width, height) in
        [(100, 30), (200, 60), (80, 24), (60, 15), (40, 10), (30, 6), (20, 3), (5, 2), (1, 1), (500, 3)]
    {
        let text = screen(&view, width, height);
        screen(&all, width, height);
        if width >= 30 && height >= 3 {
            assert!(text.starts_with(" ARMED  /dev/ttyACM0 connected"), "{width} x {height}:\n{text}");
            assert!(text.contains("space STOP"), "{width} x {height}:\n{text}");
        }
        if width >= 24 && height >= 10 {
            assert!(
                text.contains("estimate   299.999 V") || text.contains("estimate   300.000 V"),
                "{width} x {height}:\n{text}"
            );
        }
    }
}
