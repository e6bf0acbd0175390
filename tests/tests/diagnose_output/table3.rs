//! The report's own measurement: `docs/table3/` is the current diagnosis of it.

use std::fs;
use std::path::Path;

use end_to_end::vsj::json;
use serde_json::Value;

use super::folder;

const AGAIN: &str = "run `cargo run --release -- diagnose data/table3_stair.csv --column measured --input stair --out \
                     docs/table3`, and see its README";

/// A set of causes with its distance to the best in nats, its error and its held-out error.
type Candidate = (String, [String; 3]);

/// Candidates as the HTML page lists them.
fn of_page(page: &str) -> Vec<Candidate> {
    let cell = |text: &str| {
        let inside = text.split_once("<div>").map_or(text, |(_, inside)| inside);
        inside.split('<').next().unwrap_or_default().to_owned()
    };
    let row = |row: &str| {
        let mut numbers = row.split("<td role=\"cell\" class=\"number\"").skip(1).map(cell);
        (cell(row), [(); 3].map(|()| numbers.next().expect("a number")))
    };
    page.split("<td role=\"cell\" class=\"set\"").skip(1).map(row).collect()
}

/// Candidates as the README lists them, which adds remarks to some causes.
fn of_readme(readme: &str, known: &[Candidate]) -> Vec<Candidate> {
    let rows = readme.lines().skip_while(|line| !line.starts_with("| causes")).skip(2);
    let row = |row: &str| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let name = known.iter().map(|(name, _)| name).find(|name| cells[0].starts_with(*name));
        (name.map_or(cells[0], String::as_str).to_owned(), [1, 2, 3].map(|column| cells[column].to_owned()))
    };
    rows.take_while(|line| line.starts_with('|')).map(row).collect()
}

#[test]
fn the_page_on_table_3_is_up_to_date() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let committed = |name: &str| fs::read_to_string(format!("{root}/docs/table3/{name}")).expect("a file");
    let made = folder();
    let (data, out) = (format!("{root}/data/table3_stair.csv"), made.path().display().to_string());
    let arguments = ["diagnose", &data, "--column", "measured", "--input", "stair", "--json", "--out", &out];
    let mut today = json(Path::new(root), &arguments);
    let mut documented: Value = serde_json::from_str(&committed("diagnosis.json")).expect("JSON");
    for report in [&mut today, &mut documented] {
        report["extended"]["model"].take();
    }
    assert_eq!(today, documented, "{AGAIN}");
    assert_eq!(today["verdict"], "unexplained");
    // A shift of the readings from 31 s to 45 s is the best suspect, judged by single readings.
    let shift = &today["suspects"][0];
    assert_eq!((&shift["cause"], &shift["judge"]), (&"reading-offset".into(), &"leave-one-out".into()), "{shift}");
    assert_eq!(shift["parameters"]["from_s"]["value"], 31.0);
    let [before, after, short] = ["rmse_before", "rmse_after", "nats_short"].map(|name| shift[name].as_f64().unwrap());
    assert!(after < 0.5 * before && short > 0.0 && short < 10.0, "{shift}");

    let today = of_page(&fs::read_to_string(made.path().join("report.html")).expect("a page"));
    assert!(today.len() > 2, "{today:?}");
    assert_eq!(of_page(&committed("report.html")), today, "{AGAIN}");
    let readme = committed("README.md");
    assert_eq!(of_readme(&readme, &today), today, "{AGAIN}");
    // The first candidate is the unchanged simulation.
    let off = format!("off by {} V RMS", today[0].1[1]);
    assert!(readme.contains(&off), "not in the README: {off}");
}
