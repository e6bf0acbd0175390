//! The command line of `vsj link`.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::time::{Duration, Instant};

use link::isolation::Off;
use link::{AdaptationReport, BrownOut, Command, Frame, IsolationReport, Reply, State, Status, Telemetry};
use model::adaptation::{Parameters, Phase, Settings};
use model::isolation::{Cause, Causes, Finding, Verdict};
use model::{Plant, supervisor};
use serialport::{SerialPort, TTYPort};
use simulation::record::{MEASURED, Record};

use crate::mcu::{Mcu, Setup};
use crate::vsj::{bad, good, json, run, send, start, stdout, vsj};

#[test]
fn a_session_over_a_socket() {
    a_session(&Mcu::on_socket(Setup::default()));
}

#[test]
fn a_session_over_a_terminal() {
    a_session(&Mcu::on_terminal(Setup::default()));
}

fn a_session(mcu: &Mcu) {
    let port = &mcu.port;
    let status = json(port, &["status"]);
    assert_eq!((&status["sample"]["state"], &status["fault"]), (&"disarmed".into(), &"none".into()));
    assert_eq!((&status["protocol"], &status["rate_hz"]), (&link::VERSION.into(), &1000.into()));
    assert_eq!((&status["firmware"], &status["silence_limit_s"]), (&"0.1.0 (0000abcd)".into(), &5.0.into()));
    assert_eq!(status["controller"], "paper");
    let text = good(port, &["status"]);
    assert!(text.contains("disarmed, fault none") && text.contains("controller paper"), "{text}");

    assert!(bad(1, port, &["set", "300"]).contains("refused: not armed"));
    assert_eq!(json(port, &["arm"])["state"], "armed");
    assert_eq!(json(port, &["set", "300"])["target_v"], 300.0);
    let target = json(port, &["set", "1.5e9", "--unit", "pa"])["target_v"].as_f64().unwrap();
    assert!((target - 0.199e9 / 1.069e6).abs() < 1e-3, "{target}");
    let target = good(port, &["set", "0.25", "--unit", "N/m"]);
    assert!(target.starts_with("armed, target "));
    assert_eq!(good(port, &["set", "0.25N/m"]), target);
    let said = bad(2, port, &["set", "0.25N/mm"]);
    assert!(
        said.ends_with("`0.25N/mm` is no stiffness; expected a finite number, alone or with V, Pa or N/m\n"),
        "{said}"
    );
    assert!(bad(2, port, &["set", "700.1"]).contains("out of range: expected 0 to 700 V"));
    assert!(bad(2, port, &["set", "-1"]).contains("out of range"));
    assert!(bad(2, port, &["set", "1", "--unit", "pa"]).contains("expected 1301000000 to 2049300000 Pa"));
    assert!(mcu.with(|shared| shared.sample.target.to_f64()) > 100.0, "refused targets leave the last one");
    assert_eq!(json(port, &["disarm"])["state"], "disarmed");
    assert_eq!(mcu.with(|shared| shared.sample.code), 0);
}

#[test]
fn status_and_isolation_show_what_the_isolation_bank_says_and_its_alarm_is_acknowledged() {
    let mcu = Mcu::on_socket(Setup::default());
    let port = &mcu.port;
    let trips = Causes::NONE.with(Cause::StuckSensor);
    mcu.with(|shared| shared.isolation = IsolationReport::off(Off::NoSensor, 0, Causes::NONE));
    assert_eq!(json(port, &["status"])["isolation"]["why"], "no-sensor");
    assert!(good(port, &["status"]).contains("isolation  off: no-sensor\n"));
    let finding = Finding { cause: Cause::GainError, other: None, size: 0.1, half_width: 0.002, explained: 0.998 };
    let report = IsolationReport::new(Verdict::Named(Cause::GainError), Some(finding), 0, 20_096, trips);
    mcu.with(|shared| shared.isolation = report);
    let said = "named gain-error, size 0.1000 (0.0980 to 0.1020), explains 99.80 %, since 20.10 s; a fault if it names stuck-sensor";
    assert!(good(port, &["status"]).contains(&format!("isolation  {said}\n")));
    assert_eq!(good(port, &["isolation"]), format!("{said}\n"));
    let status = json(port, &["status"]);
    let isolation = &status["isolation"];
    assert_eq!((&isolation["verdict"], &isolation["cause"]), (&"named".into(), &"gain-error".into()));
    assert_eq!((&isolation["size"]["low"], &isolation["size"]["unit"]), (&0.098.into(), &"".into()));
    assert_eq!((&isolation["since_s"], &isolation["trip_on_cause"][0]), (&20.096.into(), &"stuck-sensor".into()));
    assert_eq!(json(port, &["isolation", "--acknowledge"])["verdict"], "quiet");
    assert!(good(port, &["status"]).contains("isolation  quiet\n"));
}

/// The level that the board should have.
const BROWN_OUT: BrownOut = BrownOut { level: 4, expected: 4 };

#[test]
fn status_shows_the_brown_out_level_of_a_board_that_has_one() {
    let status = |brown_out| {
        let mcu = Mcu::on_socket(Setup { brown_out, ..Setup::default() });
        (good(&mcu.port, &["status"]), json(&mcu.port, &["status"])["brown_out"].clone())
    };
    let (text, value) = status(None);
    assert!(!text.contains("brown-out") && value.is_null(), "{text}");
    let (text, value) = status(Some(BROWN_OUT));
    assert!(text.contains("brown-out  level 4\n"), "{text}");
    assert_eq!((&value["level"], &value["expected"]), (&4.into(), &4.into()));
    let (text, _) = status(Some(BrownOut { level: 0, expected: 4 }));
    assert!(text.contains("brown-out  level 0, expected 4: "), "{text}");
}

/// An older program refuses requests that it does not know.
#[test]
fn the_status_of_an_older_program_shows_what_it_knows() {
    let mcu = Mcu::on_socket(Setup { is_older: true, brown_out: Some(BROWN_OUT), ..Setup::default() });
    let (text, status) = (good(&mcu.port, &["status"]), json(&mcu.port, &["status"]));
    assert!(text.contains("state      disarmed, ") && text.contains("running    "), "{text}");
    for name in ["brown_out", "isolation", "adaptation"] {
        assert!(status[name].is_null(), "{name}: {status}");
        assert!(!text.contains(&name.replace('_', "-")), "{name}: {text}");
    }
}

/// Read from what the MCU has noted, tick by tick: how fast this machine is decides nothing.
#[test]
fn status_and_adaptation_show_the_parameters_in_use_and_switch_it() {
    let mcu = Mcu::on_socket(Setup::default());
    let port = &mcu.port;
    mcu.with(|shared| shared.adaptation = AdaptationReport::off(Off::Settings, 0));
    assert!(good(port, &["status"]).contains("adaptation off: settings\n"));
    assert!(bad(1, port, &["adaptation", "--on"]).contains("nothing can adapt: settings"));
    let parameters = Parameters { time_constant: 1.2, share: 1.0, gain: 0.95 };
    let report = AdaptationReport::new(Phase::Trial, &parameters, &Settings::TYPICAL, Plant::PAPER);
    let report = AdaptationReport { exchanges: 34, exchange_tick: 39_680, ..report };
    mcu.with(|shared| shared.adaptation = report);
    let said = "trial, time constant 6.6000 s (model 5.5000, 4.1250 to 6.8750), share 0.0909 (model 0.0909, 0.0682 to 0.1136), \
                gain 0.9500 (model 1.0000, 0.8500 to 1.1500), 34 exchanges, the last at 39.68 s";
    assert!(good(port, &["status"]).contains(&format!("adaptation {said}\n")));
    assert_eq!(good(port, &["adaptation"]), format!("{said}\n"));
    let status = json(port, &["status"]);
    let adaptation = &status["adaptation"];
    assert_eq!((&adaptation["phase"], &adaptation["exchanges"]), (&"trial".into(), &34.into()));
    let tau_s = &adaptation["parameters"]["tau_s"];
    assert_eq!([&tau_s["value"], &tau_s["model"], &tau_s["low"], &tau_s["high"]], [6.6, 5.5, 4.125, 6.875]);
    assert_eq!(adaptation["last_exchange_s"], 39.68);
    assert_eq!(json(port, &["adaptation", "--off"])["phase"], "returning");
    assert_eq!(json(port, &["adaptation", "--on"])["phase"], "watching");
    assert!(bad(2, port, &["adaptation", "--on", "--off"]).contains("cannot be used with"));
}

#[test]
fn the_voltage_ramps_down_once_the_host_is_silent() {
    let mcu = Mcu::on_socket(Setup::default());
    good(&mcu.port, &["set", "200", "--arm", "--keep", "6.5"]);
    // Nobody is heard any more.
    mcu.with(|shared| shared.ahead = Duration::from_secs(10));
    mcu.wait_for(State::Disarmed);
    let (changes, heard) = mcu.with(|shared| (shared.changes.clone(), shared.heard));
    let states: Vec<State> = changes.iter().map(|sample| sample.state).collect();
    assert_eq!(states, [State::Disarmed, State::Armed, State::Ramping, State::Disarmed]);
    let [_, armed, ramping, disarmed] = changes[..] else { unreachable!() };
    assert!(heard > armed.tick + 3000, "heartbeats keep it armed: heard at {heard}, {changes:?}");
    assert_eq!(ramping.tick, heard + 5001, "the longest allowed silence is 5000 ticks");
    assert!(ramping.estimate.to_f64() > 150.0 && ramping.target.to_f64() <= 200.0, "{ramping:?}");
    assert_eq!((disarmed.tick - ramping.tick, disarmed.code), (285, 0), "200 V at 0.7 V a tick");
}

#[test]
fn two_faults_of_one_tick_are_both_reported_and_heard_of() {
    let mcu = Mcu::on_socket(Setup::default());
    let port = &mcu.port;
    let kept = start(port, &["set", "100", "--arm", "--keep", "inf"]);
    mcu.wait_for_target(100.0);
    mcu.with(|shared| (shared.interlock_open, shared.fault) = (true, Some(supervisor::Fault::Watchdog)));
    let remarks = String::from_utf8(kept.wait_with_output().unwrap().stderr).unwrap();
    let again = bad(1, port, &["arm"]);
    for report in ["fault interlock (4) at tick ", "fault watchdog (5) at tick "] {
        assert_eq!(remarks.matches(report).count(), 1, "{report}: {remarks}");
        assert!(!again.contains(report), "it was heard of: {again}");
    }
}

#[test]
fn a_command_prints_the_reports_that_it_received() {
    let mcu = Mcu::on_socket(Setup::default());
    let port = &mcu.port;
    mcu.with(|shared| shared.fault = Some(supervisor::Fault::Watchdog));
    mcu.wait_for(State::Faulted);
    let status = start(port, &["status"]).wait_with_output().unwrap();
    let remarks = String::from_utf8(status.stderr).unwrap();
    assert_eq!(remarks.matches("fault watchdog (5) at tick ").count(), 1, "{remarks}");
    let again = bad(1, port, &["arm"]);
    assert!(!again.contains(" at tick "), "it was heard of: {again}");
}

#[test]
fn an_open_interlock_and_its_fault() {
    let mcu = Mcu::on_socket(Setup::default());
    let port = &mcu.port;
    mcu.with(|shared| shared.interlock_open = true);
    assert!(bad(1, port, &["arm"]).contains("the interlock is open"));
    mcu.with(|shared| shared.interlock_open = false);
    let kept = start(port, &["set", "100", "--arm", "--keep", "inf"]);
    mcu.wait_for(State::Armed);
    std::thread::sleep(Duration::from_millis(200));
    mcu.with(|shared| shared.interlock_open = true);
    let kept = kept.wait_with_output().unwrap();
    assert_eq!(kept.status.code(), Some(1));
    let remarks = String::from_utf8(kept.stderr).unwrap();
    assert!(remarks.contains("no longer armed: faulted, fault interlock (4)"), "{remarks}");
    assert_eq!(remarks.matches("fault interlock (4) at tick ").count(), 1, "the MCU's own report: {remarks}");

    assert!(bad(1, port, &["acknowledge", "interlock"]).contains("refused: the interlock is open"));
    mcu.with(|shared| (shared.interlock_open, shared.fault) = (false, Some(supervisor::Fault::Watchdog)));
    let remarks = bad(1, port, &["arm"]);
    assert!(remarks.contains("faulted: interlock (4)"), "{remarks}");
    assert!(!remarks.contains("fault interlock (4) at tick "), "it was heard of: {remarks}");
    let text = stdout(&run(port, &["status"]));
    assert!(text.contains("remedy     close the safety circuit\n"), "{text}");
    assert_eq!(json(port, &["disarm"])["state"], "faulted", "a disarm does not acknowledge");
    assert!(bad(1, port, &["acknowledge", "panic"]).contains("a different fault is present: interlock (4)"));
    let output = run(port, &["acknowledge", "interlock"]);
    assert_eq!((stdout(&output).as_str(), output.status.code()), ("faulted, target 0.000 V\n", Some(0)));
    let remark = String::from_utf8(output.stderr).unwrap();
    assert!(remark.contains("interlock (4) is acknowledged; another fault stands: watchdog (5)"), "{remark}");
    assert_eq!(json(port, &["acknowledge", "watchdog"])["state"], "disarmed");
    assert_eq!(json(port, &["arm"])["state"], "armed");
}

#[test]
fn set_with_arm_leaves_the_output_as_it_was_if_the_mcu_refuses_one_of_the_two() {
    let mcu = Mcu::on_socket(Setup::default());
    let port = &mcu.port;
    mcu.with(|shared| shared.interlock_open = true);
    assert!(bad(1, port, &["set", "300", "--arm"]).contains("refused: the interlock is open"));
    let ordered: Vec<_> = mcu.with(|shared| shared.ordered.iter().map(|command| command.arming).collect());
    assert_eq!(ordered, [Some(supervisor::Command::Arm)], "no target follows a refused arm");
    mcu.with(|shared| shared.interlock_open = false);
    let state = || mcu.with(|shared| shared.sample.state);
    assert!(bad(2, port, &["set", "701", "--arm"]).contains("out of range: expected 0 to 700 V"));
    assert_eq!(state(), State::Disarmed, "what this command has armed");
    good(port, &["set", "300", "--arm"]);
    assert!(bad(2, port, &["set", "701", "--arm"]).contains("out of range"));
    assert_eq!((state(), mcu.with(|shared| shared.sample.target.to_f64())), (State::Armed, 300.0), "armed before");
}

#[test]
fn an_acknowledgement_without_a_fault_says_that_there_was_none() {
    let mcu = Mcu::on_socket(Setup::default());
    let nothing = "no fault stands, so none was acknowledged";
    let output = run(&mcu.port, &["acknowledge", "interlock"]);
    assert_eq!((stdout(&output).as_str(), output.status.code()), ("disarmed, target 0.000 V\n", Some(0)));
    assert!(String::from_utf8(output.stderr).unwrap().contains(nothing));
    mcu.with(|shared| shared.fault = Some(supervisor::Fault::Watchdog));
    mcu.wait_for(State::Faulted);
    let output = run(&mcu.port, &["acknowledge", "watchdog"]);
    assert_eq!((stdout(&output).as_str(), output.stderr.as_slice()), ("disarmed, target 0.000 V\n", b"".as_slice()));
}

#[test]
fn a_restart_of_the_mcu_is_reported() {
    let mcu = Mcu::on_socket(Setup::default());
    let kept = start(&mcu.port, &["set", "100", "--arm", "--keep", "inf"]);
    mcu.wait_for(State::Armed);
    std::thread::sleep(Duration::from_millis(200));
    mcu.with(|shared| shared.restart = true);
    let kept = kept.wait_with_output().unwrap();
    assert_eq!(kept.status.code(), Some(1));
    assert!(String::from_utf8(kept.stderr).unwrap().contains("the MCU has restarted"));
    assert_eq!(mcu.with(|shared| shared.sample.state), State::Disarmed);
}

#[test]
fn watch_without_a_terminal_is_a_table() {
    let mcu = Mcu::on_terminal(Setup::default());
    let text = good(&mcu.port, &["watch", "--seconds", "2", "--every", "0.05"]);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].contains("state") && lines[1].contains("[V]"), "{text}");
    // The default, 0.2 s, would be 10 samples.
    assert!((14..=43).contains(&lines.len()) && lines[2..].iter().all(|line| line.contains("disarmed")), "{text}");
    let watched = json(&mcu.port, &["watch", "--seconds", "0.3"]);
    assert!(watched["samples"].as_u64().unwrap() >= 1);
    assert_eq!(watched["status"]["sample"]["state"], "disarmed");
}

#[test]
fn watch_on_a_terminal_refreshes_in_place() {
    let mcu = Mcu::on_socket(Setup::default());
    let (mut screen, slave) = TTYPort::pair().unwrap();
    screen.set_timeout(Duration::from_secs(10)).unwrap();
    let terminal = File::options().read(true).write(true).open(slave.name().unwrap()).unwrap();
    let mut watching =
        vsj(&mcu.port, &["watch", "--every", "0.05"]).stdout(terminal.try_clone().unwrap()).spawn().unwrap();
    let mut text = String::new();
    while text.matches("\x1b[10A").count() < 3 {
        let mut buffer = [0; 256];
        let count = screen.read(&mut buffer).unwrap();
        text += std::str::from_utf8(&buffer[..count]).unwrap();
    }
    watching.kill().unwrap();
    watching.wait().unwrap();
    let shown = text.split("\x1b[10A").nth(1).unwrap();
    assert_eq!(shown.matches("\x1b[K").count(), 10, "{shown}");
    assert!(shown.starts_with("state      disarmed, fault none"), "{shown}");
}

#[test]
fn a_recording_follows_a_schedule_and_is_a_record() {
    let mcu = Mcu::on_terminal(Setup { sensor: true, ..Setup::default() });
    let folder = tempfile::tempdir().unwrap();
    let (out, input) = (folder.path().join("out.csv"), folder.path().join("in.csv"));
    std::fs::write(&input, "time_s,voltage_v\n10,50\n10.6,150\n11.2,150\n").unwrap();
    let (out, input) = (out.to_str().unwrap(), input.to_str().unwrap());
    assert!(bad(1, &mcu.port, &["record", out, "--input", input]).contains("not armed"));
    let beyond = folder.path().join("beyond.csv");
    std::fs::write(&beyond, "time_s,voltage_v\n0,50\n1,701\n2,701\n").unwrap();
    let text = bad(2, &mcu.port, &["record", out, "--input", beyond.to_str().unwrap(), "--arm"]);
    assert!(text.contains("701") && !Path::new(out).exists() && mcu.with(|shared| shared.ordered.is_empty()), "{text}");
    let summary = json(&mcu.port, &["record", out, "--input", input, "--arm"]);
    let record = Record::open(Path::new(out), MEASURED).unwrap();
    assert_eq!(summary["rows"].as_u64().unwrap() as usize, record.rows.len());
    assert_eq!(summary["stiffness"], "measured");
    // On a busy machine the MCU's thread may miss samples, which are then counted as lost.
    let samples = record.rows.len() as u64 + summary["lost"].as_u64().unwrap();
    assert!(samples > 90 && record.rows.len() > 60, "{summary}");
    // The controller overshoots the target voltage deliberately while the spring relaxes.
    // Which row is which follows from the voltages: on a busy machine the second target comes later.
    let rows = &record.rows;
    let first = rows.iter().position(|row| (51.0..200.0).contains(&row.voltage_v)).unwrap();
    let second = rows.iter().position(|row| row.voltage_v > rows[first].voltage_v + 80.0).unwrap();
    let (early, late) = (rows[second - 1], rows[rows.len() - 1]);
    assert!(first < second && (51.0..200.0).contains(&early.voltage_v), "{early:?}");
    assert!(early.measured.unwrap() > 5.0 && late.measured > early.measured, "{early:?} {late:?}");
    assert!(bad(2, &mcu.port, &["record", out]).contains("--force"));
}

#[test]
fn a_recording_names_each_verdict_that_comes_with_the_telemetry() {
    let folder = tempfile::tempdir().unwrap();
    for says_verdict in [true, false] {
        let mcu = Mcu::on_socket(Setup { says_verdict, ..Setup::default() });
        let out = folder.path().join(format!("{says_verdict}.csv"));
        let recording = start(&mcu.port, &["record", out.to_str().unwrap(), "--json"]);
        let rows = || std::fs::read_to_string(&out).map_or(0, |text| text.lines().count());
        let wait_for = |count| {
            while rows() < count {
                std::thread::sleep(Duration::from_millis(5));
            }
        };
        wait_for(20);
        mcu.with(|shared| shared.isolation = IsolationReport { verdict: 0x302, size: 0.5, ..Default::default() });
        wait_for(60);
        send("-INT", &recording);
        let recording = recording.wait_with_output().unwrap();
        let summary: serde_json::Value = serde_json::from_str(&stdout(&recording)).unwrap();
        let verdicts: Vec<_> =
            summary["isolation"].as_array().unwrap().iter().map(|said| said["verdict"].as_str().unwrap()).collect();
        let remarks = String::from_utf8(recording.stderr).unwrap();
        let named = format!("{}: isolation named time-constant, size 0.5000", mcu.port);
        assert_eq!(
            (verdicts.as_slice(), remarks.matches(&named).count()),
            match says_verdict {
                true => (&["quiet", "named"][..], 1),
                false => (&[][..], 0),
            },
            "{remarks}"
        );
        assert!(!remarks.contains("quiet"), "{remarks}");
    }
}

/// Nobody commands anything meanwhile, so no command is refused.
#[test]
fn a_recording_names_a_fault_when_it_comes_and_fails_if_the_mcu_was_armed() {
    let folder = tempfile::tempdir().unwrap();
    for is_armed in [true, false] {
        let mcu = Mcu::on_socket(Setup::default());
        if is_armed {
            good(&mcu.port, &["set", "100", "--arm"]);
        }
        let out = folder.path().join(format!("{is_armed}.csv"));
        let mut recording = start(&mcu.port, &["record", out.to_str().unwrap(), "--seconds", "3"]);
        let rows = || std::fs::read_to_string(&out).map_or(0, |text| text.lines().count());
        while rows() < 20 {
            std::thread::sleep(Duration::from_millis(5));
        }
        mcu.with(|shared| shared.fault = Some(supervisor::Fault::Watchdog));
        let mut said = String::new();
        BufReader::new(recording.stderr.as_mut().unwrap()).read_line(&mut said).unwrap();
        assert!(said.contains("fault watchdog (5) at tick ") && said.ends_with("standing: watchdog (5)\n"), "{said}");
        assert_eq!(recording.try_wait().unwrap(), None, "it goes on: {said}");
        let ended = recording.wait_with_output().unwrap();
        let (remarks, wrote) = (String::from_utf8(ended.stderr.clone()).unwrap(), stdout(&ended));
        assert_eq!(ended.status.code(), Some(i32::from(is_armed)), "{remarks}");
        assert_eq!(remarks.contains("no longer armed: faulted, fault watchdog (5)"), is_armed, "{remarks}");
        assert!(wrote.starts_with("wrote ") && !remarks.contains(" at tick "), "{wrote} {remarks}");
    }
}

#[test]
fn a_recording_that_is_killed_keeps_whole_rows() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv");
    let mut recording = start(&mcu.port, &["record", out.to_str().unwrap(), "--rate-hz", "500"]);
    while std::fs::read_to_string(&out).map_or(0, |text| text.lines().count()) < 50 {
        std::thread::sleep(Duration::from_millis(5));
    }
    recording.kill().unwrap();
    recording.wait().unwrap();
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.ends_with('\n') && text.contains("no measurement"));
    assert!(Record::open(&out, MEASURED).unwrap().rows.len() >= 48);
}

#[test]
fn ctrl_c_ends_a_recording_with_its_summary() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv");
    let recording = start(&mcu.port, &["record", out.to_str().unwrap(), "--json"]);
    while std::fs::read_to_string(&out).map_or(0, |text| text.lines().count()) < 20 {
        std::thread::sleep(Duration::from_millis(5));
    }
    send("-INT", &recording);
    let recording = recording.wait_with_output().unwrap();
    assert!(recording.status.success(), "{recording:?}");
    let summary: serde_json::Value = serde_json::from_str(&stdout(&recording)).unwrap();
    assert_eq!(summary["rows"].as_u64().unwrap() as usize, Record::open(&out, MEASURED).unwrap().rows.len());
}

/// The MCU would ramp down by itself after a minute, and the program would give up after another.
#[test]
fn a_signal_disables_the_output_although_no_answer_arrives() {
    let mcu = Mcu::on_socket(Setup { silence_ms: 60_000, ..Setup::default() });
    for (signal, code, mute) in [("-INT", 130, true), ("-TERM", 143, true), ("-TERM", 143, false)] {
        mcu.with(|shared| shared.changes.clear());
        let kept = start(&mcu.port, &["set", "100", "--arm", "--keep", "inf", "--timeout", "120"]);
        mcu.wait_for_target(100.0);
        let before = mcu.with(|shared| {
            shared.mute = mute;
            shared.counters.repeated
        });
        // A request waits for its answer.
        while mute && mcu.with(|shared| shared.counters.repeated == before) {
            std::thread::sleep(Duration::from_millis(5));
        }
        send(signal, &kept);
        let kept = kept.wait_with_output().unwrap();
        let remarks = String::from_utf8(kept.stderr).unwrap();
        assert_eq!(kept.status.code(), Some(code), "{remarks}");
        let states: Vec<State> = mcu.with(|shared| shared.changes.iter().map(|sample| sample.state).collect());
        assert_eq!(states, [State::Disarmed, State::Armed, State::Disarmed], "{remarks}");
        let said = match mute {
            true => "not disarmed: no answer to 5 requests",
            false => "ended by a signal; the output is disabled",
        };
        assert!(remarks.contains(said), "{remarks}");
        mcu.with(|shared| shared.mute = false);
    }
}

#[test]
fn ctrl_c_while_the_mcu_is_armed_sends_no_target_and_disables_the_output() {
    let mcu =
        Mcu::on_socket(Setup { silence_ms: 60_000, mute_when: |it| it.state == State::Armed, ..Setup::default() });
    for arguments in [&["arm"][..], &["set", "100", "--arm"], &["set", "100", "--arm", "--keep", "inf"]] {
        mcu.with(|shared| (shared.changes.clear(), shared.ordered.clear()));
        let arming = start(&mcu.port, &[arguments, &["--timeout", "120"]].concat());
        mcu.wait_for(State::Armed);
        send("-INT", &arming);
        // Sooner than the request is given up.
        std::thread::sleep(Duration::from_millis(50));
        mcu.with(|shared| shared.mute = false);
        let arming = arming.wait_with_output().unwrap();
        let remarks = String::from_utf8(arming.stderr).unwrap();
        assert_eq!(arming.status.code(), Some(130), "{arguments:?}: {remarks}");
        assert!(remarks.contains("ended by a signal; the output is disabled"), "{arguments:?}: {remarks}");
        let (state, ordered) = mcu.with(|shared| (shared.sample.state, shared.ordered.clone()));
        assert_eq!(state, State::Disarmed, "{arguments:?}: {remarks}");
        assert!(ordered.iter().all(|it| it.target.is_none() || it.arming.is_some()), "{arguments:?}: {ordered:?}");
    }
}

#[test]
fn a_signal_while_the_first_target_is_set_disables_the_output_once() {
    let mute_when = |sample: &Telemetry| sample.target.to_f64() == 100.0;
    let mcu = Mcu::on_socket(Setup { silence_ms: 60_000, mute_when, ..Setup::default() });
    let arming = start(&mcu.port, &["set", "100", "--arm", "--timeout", "120"]);
    mcu.wait_for_target(100.0);
    send("-TERM", &arming);
    let arming = arming.wait_with_output().unwrap();
    let remarks = String::from_utf8(arming.stderr).unwrap();
    assert_eq!((arming.status.code(), remarks.matches("not disarmed").count()), (Some(143), 1), "{remarks}");
    let disarm = |command: &&Command| command.arming == Some(supervisor::Command::Disarm);
    assert_eq!(mcu.with(|shared| shared.ordered.iter().filter(disarm).count()), 1, "{remarks}");
}

#[test]
fn a_signal_ends_a_capture_without_its_rows_and_disables_the_output() {
    let mcu = Mcu::on_socket(Setup { silence_ms: 60_000, ..Setup::default() });
    let folder = tempfile::tempdir().unwrap();
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        good(&mcu.port, &["set", "100", "--arm"]);
        let out = folder.path().join(format!("{code}.csv"));
        let capturing = start(&mcu.port, &["capture", "--seconds", "2", "--out", out.to_str().unwrap()]);
        // Created before the capture begins.
        while !out.exists() {
            std::thread::sleep(Duration::from_millis(5));
        }
        send(signal, &capturing);
        let capturing = capturing.wait_with_output().unwrap();
        let (text, remarks) = (stdout(&capturing), String::from_utf8(capturing.stderr).unwrap());
        assert_eq!(capturing.status.code(), Some(code), "{text}{remarks}");
        assert!(text.contains(": 0 rows") && remarks.contains("the output is disabled"), "{text}{remarks}");
        assert_eq!(mcu.with(|shared| shared.sample.state), State::Disarmed, "{text}{remarks}");
    }
}

#[test]
fn a_lost_connection_keeps_the_rows() {
    let mcu = Mcu::on_socket(Setup { hang_up_after: Some(1500), ..Setup::default() });
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv");
    let text = bad(1, &mcu.port, &["record", out.to_str().unwrap(), "--rate-hz", "20"]);
    let rows = Record::open(&out, MEASURED).unwrap().rows.len();
    // In 1.5 s; with the default rate 150.
    assert!((11..40).contains(&rows) && text.contains(&format!("contains {rows} rows")), "{rows}: {text}");
}

#[test]
fn a_missing_answer_is_reported_within_the_timeout() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deaf");
    let listener = UnixListener::bind(&path).unwrap();
    let port = format!("unix:{}", path.display());
    let begin = Instant::now();
    assert!(bad(1, &port, &["status", "--timeout", "0.3"]).contains("no answer to 3 requests"));
    assert!(begin.elapsed() < Duration::from_secs(2));
    drop(listener);
    assert!(bad(2, &port, &["status"]).contains("cannot be opened"));
}

/// Answers the first request with the bytes that `answer` makes of it.
fn fake(path: &Path, answer: impl FnOnce(&[u8]) -> Vec<u8> + Send + 'static) -> String {
    let listener = UnixListener::bind(path).unwrap();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut buffer = [0; 64];
        let count = stream.read(&mut buffer).unwrap();
        stream.write_all(&answer(&buffer[..count])).unwrap();
        while stream.read(&mut buffer).is_ok_and(|count| count > 0) {}
    });
    format!("unix:{}", path.display())
}

#[test]
fn another_version_and_a_wrong_baud_rate_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let port = fake(&folder.path().join("version"), |request| {
        let mut receiver = link::Receiver::new();
        let sequence = request.iter().find_map(|&byte| receiver.on_byte(byte).map(|packet| packet.sequence));
        Frame::with_version(7, sequence.unwrap(), &Reply::Status(Status::default())).as_bytes().to_vec()
    });
    let expected = format!("the MCU speaks version 7 of the protocol, this program {}", link::VERSION);
    assert!(bad(1, &port, &["status"]).contains(&expected));
    let port = fake(&folder.path().join("baud"), |_| vec![0xf3; 90]);
    assert!(bad(1, &port, &["status", "--timeout", "0.2"]).contains("no valid answer to 2 requests, but 90 bytes"));
    // A line that echoes its input.
    let port = fake(&folder.path().join("echo"), <[u8]>::to_vec);
    assert!(bad(1, &port, &["status", "--timeout", "0.2"]).contains("no valid answer"));
}

#[cfg(target_os = "linux")]
#[test]
fn the_baud_rate_is_that_of_the_device() {
    let mcu = Mcu::on_terminal(Setup::default());
    for (arguments, expected) in [(&["status"][..], 115_200), (&["status", "--baud", "57600"], 57_600)] {
        good(&mcu.port, arguments);
        let terminal = rustix::termios::tcgetattr(File::open(&mcu.port).unwrap()).unwrap();
        assert_eq!((terminal.input_speed(), terminal.output_speed()), (expected, expected));
    }
}

#[test]
fn bad_arguments_send_nothing() {
    let mcu = Mcu::on_socket(Setup::default());
    for arguments in [
        &["set", "nan"][..],
        &["set", "inf"],
        &["set", "abc"],
        &["set", "1", "--keep", "0"],
        &["arm", "--keep", "nan"],
        &["acknowledge", "none"],
        &["acknowledge", "0"],
        &["status", "--timeout", "-1"],
        &["status", "--baud", "0"],
        &["watch", "--every", "0"],
        &["watch", "--seconds", "-2"],
        &["record", "x.csv", "--rate-hz", "0"],
        &["record", "x.csv", "--input", "/nonexistent.csv"],
        &["jump"],
    ] {
        bad(2, &mcu.port, arguments);
    }
    bad(2, &mcu.port, &["record", "/nonexistent/x.csv"]);
    assert!(mcu.with(|shared| shared.ordered.is_empty()));
}
