//! The pages in `docs/causes` agree with the effects' descriptions, experiments and parameters.

use std::fs;
use std::path::PathBuf;

use identify::effects::EFFECTS;
use identify::effects::effect::Effect;
use identify::effects::model::Model;
use identify::fit::simulator::Simulator;
use identify::record::data::Data;
use identify::{Input, Options, diagnose};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};
use simulation::units::Units;

/// Marks around the part of a page that is generated from the code.
const MARKS: [&str; 2] = ["<!-- facts -->\n\n", "\n<!-- /facts -->\n"];

/// Returns a record of a stair of 100 V every 10 s up to 500 V and down again, with readings that `read` makes of row
/// and simulated reading.
fn record(read: impl Fn(usize, f64) -> f64) -> Record {
    let row = |index: usize| {
        let level = (index / 100).min(10);
        let voltage_v = 100.0 * level.min(10 - level) as f64;
        Row { line: index + 2, time_s: 0.1 * index as f64, voltage_v, measured: Some(0.0) }
    };
    let mut record = Record { name: "stair".into(), rows: (0..1100).map(row).collect() };
    let data = Data::new(&record, Input::Hold);
    let (mut simulated, mut numbers) = (Vec::new(), Lcg32::new(1));
    Simulator::new(&data, &Options::default().base).run(&Model::default(), &mut simulated);
    for (index, (row, simulated)) in record.rows.iter_mut().zip(simulated).enumerate() {
        // Reproducible uniform noise of 0.3 V RMS.
        row.measured = Some(read(index, simulated + (numbers.uniform() - 0.5)));
    }
    record
}

/// Returns names and units of a cause's parameters, from the effect, or from a finding if a property of the readings
/// shows it.
fn parameters(effect: &dyn Effect) -> Vec<(String, String)> {
    let shown = match effect.cause() {
        "quantisation" => record(|_, reading| (reading / 12.0).round() * 12.0),
        // The noise does not give the reading before the row again.
        "stuck-sensor" => record(|index, reading| if (520..710).contains(&index) { 123.0 } else { reading }),
        "outliers" => record(|index, reading| if index % 97 == 41 { reading + 80.0 } else { reading }),
        _ => {
            let data = Data::new(&record(|_, reading| reading), Input::Hold);
            let middle =
                effect.coordinates(0, &data).iter().map(|it| (it.lowest + it.highest) / 2.0).collect::<Vec<_>>();
            let quantities = effect.quantities(0, &middle, &data);
            let units = Units::default();
            return quantities.into_iter().map(|quantity| (quantity.name, quantity.dimension.unit(&units))).collect();
        }
    };
    let report = diagnose(&shown, &Options::default()).expect("a report");
    let found = report.findings.iter().find(|finding| finding.cause == effect.cause());
    let parameters = &found.unwrap_or_else(|| panic!("{} is not found", effect.cause())).parameters;
    parameters.iter().map(|(name, parameter)| (name.clone(), parameter.unit.clone())).collect()
}

fn list(parameters: &[(String, String)]) -> String {
    let with_unit = |(name, unit): &(String, String)| {
        format!("`{name}` {}", if unit.is_empty() { "[-]".into() } else { format!("[{unit}]") })
    };
    parameters.iter().map(with_unit).collect::<Vec<_>>().join(", ")
}

/// Returns the page with the generated part replaced.
fn renewed(page: &str, facts: &str) -> String {
    let (before, rest) = page.split_once(MARKS[0]).expect("a mark where the facts begin");
    let (_, after) = rest.split_once(MARKS[1]).expect("a mark where they end");
    format!("{before}{}{facts}{}{after}", MARKS[0], MARKS[1])
}

fn compare(name: &str, facts: &str) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/causes").join(name);
    let page = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let renewed = renewed(&page, facts);
    if std::env::var_os("GOLDEN").is_some_and(|what| what == "write") {
        fs::write(&path, renewed).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    } else {
        assert!(
            page == renewed,
            "{name} says otherwise than the code; GOLDEN=write renews it. The code says:\n{facts}"
        );
    }
}

#[test]
fn every_page_agrees_with_the_code() {
    let mut index = String::from("| cause | what it does | where | parameters |\n| --- | --- | --- | --- |\n");
    for effect in EFFECTS {
        let (cause, parameters) = (effect.cause(), list(&parameters(*effect)));
        let stage = format!("{:?}", effect.location()).to_lowercase();
        let facts = format!(
            "| | |\n| --- | --- |\n| what it does | {} |\n| where it acts | {stage} |\n| parameters | {parameters} |\n\
             | experiment that decides | {} |\n",
            effect.description(),
            effect.isolating_experiment(),
        );
        compare(&format!("{cause}.md"), &facts);
        index += &format!("| [{cause}]({cause}.md) | {} | {stage} | {parameters} |\n", effect.description());
    }
    compare("README.md", &index);
}

#[test]
fn every_cause_has_a_complete_page_and_no_other_page_exists() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/causes");
    let mut names: Vec<String> = fs::read_dir(&folder)
        .expect("docs/causes")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let mut expected: Vec<String> =
        EFFECTS.iter().flat_map(|it| [format!("{}.md", it.cause()), format!("{}.svg", it.cause())]).collect();
    expected.push("README.md".into());
    expected.sort();
    assert_eq!(names, expected);
    for effect in EFFECTS {
        let cause = effect.cause();
        let page = fs::read_to_string(folder.join(format!("{cause}.md"))).expect("a page");
        assert!(page.starts_with(&format!("# {cause}\n")), "{cause}");
        for part in [
            &format!("]({cause}.svg)"),
            "```text\n",
            "## In a record\n",
            "## Commonly confused with\n",
            "## Parameters\n",
            "## Source\n",
        ] {
            assert!(page.contains(part), "{cause} has no {part:?}");
        }
        // Every parameter is explained, and every link leads to a page.
        let (_, explanations) = page.split_once("## Parameters\n").expect("parameters");
        for (name, _) in parameters(*effect) {
            let family = if name.starts_with("at_") { "at_..._v" } else { &name };
            assert!(explanations.contains(&format!("`{family}`")), "{cause} does not explain {name}");
        }
        for link in page.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link) {
            assert!(folder.join(link).is_file(), "{cause}: {link} leads nowhere");
        }
    }
}
