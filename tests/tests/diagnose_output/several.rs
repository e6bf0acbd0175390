//! Several records of one spring in one diagnosis.

use std::fs;

use end_to_end::vsj::{run, text};
use serde_json::Value;

use super::{folder, papers};

/// The second record has a zero of its own and a stretch of shifted readings: both belong to that record.
#[test]
fn a_fault_is_reported_with_the_record_that_has_it() {
    let folder = folder();
    let shifted = |row: u32| -7.0 + if (150..260).contains(&row) { 25.0 } else { 0.0 };
    fs::write(folder.path().join("monday.csv"), papers(600, |_| 0.0)).unwrap();
    fs::write(folder.path().join("tuesday.csv"), papers(500, shifted)).unwrap();
    let files = ["diagnose", "monday.csv", "tuesday.csv"];
    let output = run(folder.path(), &[&files[..], &["--json", "--out", "out"]].concat());
    assert!(output.status.success(), "{output:?}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((report["verdict"].as_str(), report["rows"].as_u64()), (Some("explained"), Some(1100)), "{report:#}");
    assert!(report["findings"].as_array().unwrap().is_empty(), "{report:#}");
    let records = report["records"].as_array().unwrap();
    let faults = |of: &Value| -> Vec<String> {
        let findings = of["findings"].as_array().unwrap().iter();
        findings.map(|finding| finding["cause"].as_str().unwrap().to_owned()).collect()
    };
    assert!(faults(&records[0]).is_empty() && faults(&records[1]) == ["reading-offset"], "{records:#?}");
    let zero = records[1]["offset"].as_f64().unwrap();
    // The shifted stretch draws a robust estimate a little to its side.
    assert!((zero + 7.0).abs() < 1.0, "{zero}");

    let residuals = fs::read_to_string(folder.path().join("out/residuals.csv")).unwrap();
    assert!(residuals.lines().nth(1).unwrap().ends_with(",record"), "{residuals}");
    let (last, first) = (residuals.lines().nth(601).unwrap(), residuals.lines().nth(602).unwrap());
    assert!(last.starts_with("59.9") && last.ends_with(",1") && first.starts_with("0,0,") && first.ends_with(",2"));
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("Each record") && page.contains("tuesday.csv"), "no section on each record");

    let said = text(&run(folder.path(), &files).stdout);
    let line = said.lines().find(|line| line.starts_with("tuesday.csv ")).expect("a line for each record");
    assert!(line.contains("reading-offset (from_s = 15.00"), "{said}");
}
