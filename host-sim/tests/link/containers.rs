//! Recordings as MCAP and Parquet, and telemetry as datagrams.

use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use link::IsolationReport;
use record_files::open;
use serde_json::Value;
use simulation::record::Format;

use crate::mcu::{Mcu, Setup};
use crate::vsj::{bad, good, json, start};

fn with_sensor() -> Mcu {
    Mcu::on_socket(Setup { sensor: true, ..Setup::default() })
}

#[test]
fn a_recording_is_the_same_record_in_every_format() {
    let mcu = with_sensor();
    let folder = tempfile::tempdir().unwrap();
    for name in ["out.mcap", "out.parquet"] {
        let out = folder.path().join(name);
        let path = out.to_str().unwrap();
        let summary = json(&mcu.port, &["record", path, "--input", "stair", "--arm", "--seconds", "0.4"]);
        let rows = open(&out, &Format::default(), None).unwrap().record.rows;
        assert_eq!(summary["rows"], rows.len(), "{name}");
        assert!(rows.len() >= 20 && rows[0].time_s == 0.0 && rows.iter().all(|row| row.measured.is_some()), "{name}");
        let error = bad(2, &mcu.port, &["record", path, "--seconds", "0.1"]);
        assert!(error.contains("already exists; expected a new file, or --force"), "{error}");
        good(&mcu.port, &["record", path, "--seconds", "0.1", "--force"]);
        let capture = json(&mcu.port, &["capture", "--out", path, "--seconds", "0.2", "--force", "--timeout", "10"]);
        let rows = open(&out, &Format::default(), None).unwrap().record.rows;
        assert_eq!((capture["rows"].as_u64(), rows.len()), (Some(200), 200), "{name}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "no temporary folder is left");
}

#[test]
fn without_a_sensor_they_hold_estimates_which_no_diagnosis_accepts() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    for name in ["out.mcap", "out.parquet"] {
        let out = folder.path().join(name);
        good(&mcu.port, &["record", out.to_str().unwrap(), "--seconds", "0.2"]);
        let output = Command::new(env!("CARGO_BIN_EXE_vsj")).arg("identify").arg(&out).output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && text.contains("the controller's own estimate"), "{text}");
    }
}

/// Killed without a chance to react.
#[test]
fn of_a_killed_recording_mcap_keeps_its_rows_and_parquet_nothing() {
    let mcu = with_sensor();
    let folder = tempfile::tempdir().unwrap();
    for name in ["out.mcap", "out.parquet"] {
        let out = folder.path().join(name);
        let mut child = start(&mcu.port, &["record", out.to_str().unwrap()]);
        std::thread::sleep(Duration::from_millis(2500));
        child.kill().unwrap();
        child.wait().unwrap();
        if Path::new(name).extension().unwrap() == "parquet" {
            assert!(!out.exists());
            continue;
        }
        let found = open(&out, &Format::default(), None).unwrap();
        assert!(found.record.rows.len() > 80, "{} rows", found.record.rows.len());
        assert!(found.remarks.iter().any(|remark| remark.contains("cut off after")), "{:?}", found.remarks);
    }
}

#[test]
fn watch_sends_each_sample_as_a_datagram_and_goes_on_without_a_receiver() {
    let mcu = Mcu::on_socket(Setup { silence_ms: 1000, ..Setup::default() });
    let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
    receiver.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let address = receiver.local_addr().unwrap().to_string();
    let named = IsolationReport { verdict: 0x302, size: 0.5, ..IsolationReport::default() };
    mcu.with(|shared| shared.isolation = named);
    let watch = ["watch", "--seconds", "1.5", "--udp", &address, "--rate-hz", "50", "--json"];
    let child = start(&mcu.port, &watch);
    let (mut times, mut causes) = (Vec::new(), Vec::new());
    for _ in 0..30 {
        let mut bytes = [0; 2048];
        let count = receiver.recv(&mut bytes).unwrap();
        let sample: Value = serde_json::from_slice(&bytes[..count]).unwrap();
        assert!(sample["vsj"]["applied_v"].is_number() && sample["vsj"]["state"] == "disarmed", "{sample}");
        causes.push(sample["vsj"]["isolation"]["cause"].clone());
        times.push(sample["timestamp"].as_f64().unwrap());
    }
    // The default rate would be 0.01 s from one to the next; on a busy machine samples may be lost.
    let mean_s = (times[29] - times[0]) / 29.0;
    assert!(mean_s > 0.018 && times.is_sorted(), "{times:?}");
    assert!(causes[5..].iter().all(|cause| cause == "time-constant"), "{causes:?}");
    drop(receiver);
    let output = child.wait_with_output().unwrap();
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(output.status.success() && report["datagrams"].as_u64() >= Some(30), "{report}");
    let error = bad(2, &mcu.port, &["watch", "--udp", "nowhere"]);
    assert!(error.contains("--udp nowhere: ") && error.contains("expected HOST:PORT"), "{error}");
}
