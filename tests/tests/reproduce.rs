//! The source report's printed numbers, end to end: what must come out, and what must be found wrong.

use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use tempfile::tempdir;

fn report() -> Value {
    json(tempdir().unwrap().path(), &["reproduce", "--json"])
}

fn items(report: &Value) -> &Vec<Value> {
    report["items"].as_array().expect("items")
}

fn item<'a>(report: &'a Value, place: &str) -> &'a Value {
    let found = items(report).iter().find(|item| item["where"] == place);
    found.unwrap_or_else(|| panic!("{place} is not there"))
}

#[test]
fn every_item_is_complete_and_the_counts_are_right() {
    let report = report();
    let items = items(&report);
    assert!(items.len() >= 150, "{}", items.len());
    let mut places: Vec<&str> = items.iter().map(|item| item["where"].as_str().expect("where")).collect();
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), items.len(), "a place is listed twice");
    for item in items {
        let agrees = item["agrees"].as_bool().expect("agrees");
        assert!(item["printed"].is_f64() && item["computed"].is_f64(), "{item}");
        assert_eq!(agrees, item["note"].is_null(), "{item}");
        assert!(agrees || item["note"].as_str().is_some_and(|note| note.len() > 20), "{item}");
    }
    let agree = items.iter().filter(|item| item["agrees"] == true).count() as u64;
    assert_eq!(
        (report["agree"].as_u64(), report["disagree"].as_u64()),
        (Some(agree), Some(items.len() as u64 - agree))
    );
}

/// What must come out, by hand or by other tests of this repository.
#[test]
fn what_agrees() {
    let report = report();
    for (place, computed) in [
        ("Section 2.5, second moment of area", 19.8e-3 * 190e-6f64.powi(3) / 12.0),
        ("Section 2.5, Young's modulus at 0 V", 206.03 * 6.2987e6),
        ("Section 8.2.3, PET, volume", 59.8e-3 * 19.8e-3 * 45e-6),
        ("Section 8.2.3, nylon, weight", 2.07632e-5 * 9.8),
        ("Section 8.2.3, reaction of the second fixture", 29.1365f64.hypot(48.1737).hypot(0.678528)),
    ] {
        let item = item(&report, place);
        assert_eq!(item["agrees"], true, "{item}");
        assert!((item["computed"].as_f64().unwrap() / computed - 1.0).abs() < 1e-9, "{item}");
    }
    let simulated = items(&report).iter().filter(|item| {
        let place = item["where"].as_str().unwrap();
        place.starts_with("Table 3") && place.ends_with("controller")
    });
    let (right, wrong): (Vec<&Value>, Vec<&Value>) = simulated.partition(|item| item["agrees"] == true);
    assert_eq!((right.len(), wrong.len()), (32, 2));
    assert_eq!(report["truncated_groups"], serde_json::json!(["Table 3, simulated"]), "found out by counting");
    let parts = items(&report).iter().filter(|item| {
        let place = item["where"].as_str().unwrap();
        [", volume", ", mass", ", weight", ", density"].iter().any(|end| place.ends_with(end))
    });
    assert!(parts.filter(|item| item["agrees"] == true).count() >= 20, "the part table of 8.2.3");
}

/// What must be found, each with the words that say why.
#[test]
fn what_disagrees_and_why() {
    let report = report();
    for (place, words) in [
        ("Section 2.5, growth of Young's modulus by the fit", "10^-1 of the computed"),
        ("Equation 6, factor of the integral", "reciprocal"),
        ("Conclusion, largest error of the finite elements", "4 in place of 1"),
        ("Section 4.1.2, Young's modulus of PET", "7 in place of 9"),
        ("Table 3, t=55, with controller", "digits 0 and 3 swapped"),
        ("Table 3, t=41, without controller", "integration error"),
        ("Figure 6, slope at 700 V", "+4.3 standard errors off"),
        ("Table 1, 0 V at 1.70 mm, measured", "351"),
        ("Table 3, t=50.1, measured", "the next goes on from there: what was measured shifted"),
        ("Section 4.1.4, 300 uN at 400 V, measured", "this one alone"),
        ("Section 4.1.4, 300 uN at 0 V, measured", "a common cause"),
        ("Section 8.2.3, reaction along Z against the weight of all layers", "1 of the 6 terms"),
        ("Section 8.2.3, Young's modulus of the aluminium layers", "Table 2 prints 6.9e10"),
        ("Section 8.2.3, largest displacement", "aluminium_gpa = 69"),
        ("Figure 14, 500 uN at 700 V, against section 8.2.3", "3 times the computed"),
        ("Section 4.1.4, finite elements at 400 V: 500 uN against 300 uN", "proportional to force"),
        ("Section 4.2.2, time constant for -3 dB", "part = 0.6321"),
    ] {
        let item = item(&report, place);
        assert_eq!(item["agrees"], false, "{item}");
        assert!(item["note"].as_str().unwrap().contains(words), "{item}");
    }
    // A shift that lasts, or that others share, is no misread digit.
    for place in ["Table 3, t=50.1, measured", "Section 4.1.4, 300 uN at 0 V, measured"] {
        assert!(!item(&report, place)["note"].as_str().unwrap().contains("misread"), "{place}");
    }
    let measured: Vec<&str> = items(&report)
        .iter()
        .filter(|item| item["measured"] == true && item["agrees"] == false)
        .map(|item| item["where"].as_str().unwrap())
        .collect();
    assert_eq!(measured.len(), 5, "{measured:?}");
}

#[test]
fn the_page_is_the_one_in_the_documentation() {
    let folder = tempdir().unwrap();
    let output = run(folder.path(), &["reproduce", "--out", "page"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("wrote page/README.md"));
    let made = fs::read_to_string(folder.path().join("page/README.md")).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let committed = fs::read_to_string(root.join("docs/reproduce/README.md")).unwrap();
    assert!(committed == made, "the page is old: cargo run --release -- reproduce --out docs/reproduce");
    // Claims come before side remarks.
    assert!(made.find("### Claims").unwrap() < made.find("### Side remarks").unwrap());

    let summary = text(&output.stdout).lines().find(|line| line.contains("printed numbers agree")).unwrap().to_owned();
    let first = summary.split(". ").next().unwrap();
    for page in ["README.md", "docs/report.md"] {
        assert!(fs::read_to_string(root.join(page)).unwrap().contains(first), "{page} lacks: {first}");
    }
}

#[test]
fn bad_arguments() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (arguments, expected) in
        [(&["reproduce", "--out", "file/sub"][..], "file/sub: cannot be created"), (&["reproduce", "--no"], "'--no'")]
    {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2));
        let stderr = text(&output.stderr);
        assert!(stderr.contains(expected) && stderr.trim_end().lines().count() == 1, "{stderr}");
    }
    assert!(text(&run(folder.path(), &["reproduce", "--help"]).stdout).contains("Examples:"));
}
