//! Reliability of the stated probabilities: how often a finding of a stated probability is true, and how often a 95 % interval
//! contains the true value, over all sets of the campaign.

use std::fmt::Write;

use super::answer::{Answer, CERTAIN, Named};
use super::case::Case;
use super::tables::percent;
use super::{out_of_model, part, plants, shared, steps, unforeseen};
use crate::ground_truth;
use crate::markdown::table;
use crate::statistics::wilson;

/// Lower ends of the bins of the stated probability; the last bin ends at 1.
const BINS: [f64; 7] = [0.0, 0.5, 0.7, 0.9, 0.95, 0.99, 0.999];
/// Sets of laws that the diagnosis does not model; all others are of its own causes.
const LAWS: [&str; 2] = ["out-of-model", "unforeseen"];

/// A set's name with its graded diagnoses.
pub type Graded = (&'static str, Vec<Answer>);

/// The sets with their records: `count` of each case, 3 times as many of each single cause, twice as many in other plants, 30 times
/// as many nulls; every second pair, and pairs that share a stage at full size.
pub fn sets(first: u64, count: usize) -> Vec<(&'static str, Vec<Case>)> {
    let jobs = |jobs: Vec<part::Job>| jobs.into_iter().map(Case::from).collect();
    // Seeds of their own, so that these are not the records of the other pages.
    let first = first + 1_000;
    vec![
        ("singles", jobs(part::singles(first, 3 * count))),
        ("nulls", jobs(part::nulls(first, 30 * count))),
        ("pairs", jobs(part::pairs(first, count).into_iter().step_by(2).collect())),
        ("shared", shared::cases(first, count).into_iter().filter(|case| case.kinds == ["full size"]).collect()),
        ("steps", steps::cases(first, count)),
        ("plants", plants::cases(first, 2 * count)),
        (
            LAWS[0],
            out_of_model::jobs(&ground_truth::out_of_model::all(), first, count).into_iter().map(Case::from).collect(),
        ),
        (LAWS[1], unforeseen::Edition::First.cases(first, count)),
    ]
}

/// Findings of the sets that `which` selects.
fn findings(sets: &[Graded], which: impl Fn(&str) -> bool) -> Vec<&Named> {
    sets.iter()
        .filter(|(name, _)| which(name))
        .flat_map(|(_, answers)| answers)
        .flat_map(|answer| &answer.found)
        .collect()
}

/// Findings of one bin: their number, the number of true ones, and the mean of the stated probabilities.
fn bin(findings: &[&Named], index: usize) -> (usize, usize, f64) {
    let top = BINS.get(index + 1).copied().unwrap_or(f64::INFINITY);
    let inside: Vec<_> = findings.iter().filter(|named| (BINS[index]..top).contains(&named.probability)).collect();
    let stated = inside.iter().map(|named| named.probability).sum::<f64>() / inside.len().max(1) as f64;
    (inside.len(), inside.iter().filter(|named| named.is_true).count(), stated)
}

fn bin_name(index: usize) -> String {
    match BINS.get(index + 1) {
        Some(top) => format!("{} to {top}", BINS[index]),
        None => format!("{} to 1", BINS[index]),
    }
}

/// Percentage of `part` in `count` with its 95 % interval.
fn with_interval(part: usize, count: usize) -> String {
    if count == 0 {
        return "-".to_owned();
    }
    let [low, high] = wilson(part, count).map(|end| format!("{:.1}", 100.0 * end));
    format!("{} ({low} to {high})", percent(part as f64 / count as f64))
}

fn is_law(set: &str) -> bool {
    LAWS.contains(&set)
}

/// Tables of the probabilities and of the intervals.
pub fn page(sets: &[Graded]) -> String {
    let [all, own, laws] = [findings(sets, |_| true), findings(sets, |set| !is_law(set)), findings(sets, is_law)];
    let cells = |index: usize| {
        let (count, right, stated) = bin(&all, index);
        let part = |findings: &[&Named]| {
            let (count, right, _) = bin(findings, index);
            vec![count.to_string(), with_interval(right, count)]
        };
        let stated = if count == 0 { "-".to_owned() } else { format!("{:.2} %", 100.0 * stated) };
        let first = vec![bin_name(index), count.to_string(), stated, with_interval(right, count)];
        [first, part(&own), part(&laws)].concat()
    };
    let records: usize = sets.iter().map(|(_, answers)| answers.len()).sum();
    let mut text = format!(
        "\
Findings of {records} records by their stated probability, and how many of them are true; in brackets the 95 % interval by Wilson.
Own causes: {}. Other laws: {}.

![Frequency of true findings over the stated probability](reliability.svg)

{}
",
        sets.iter().map(|(set, _)| *set).filter(|set| !is_law(set)).collect::<Vec<_>>().join(", "),
        LAWS.join(", "),
        table(
            &["probability", "findings", "mean stated", "true", "of own causes", "true", "of other laws", "true"],
            (0..BINS.len()).map(cells)
        )
    );
    let row = |(set, answers): &Graded| {
        let findings: Vec<&Named> = answers.iter().flat_map(|answer| &answer.found).collect();
        let sure: Vec<_> = findings.iter().filter(|named| named.probability >= CERTAIN).collect();
        let intervals: Vec<bool> =
            answers.iter().flat_map(|a| &a.parameters).map(|estimate| estimate.covered).collect();
        let count = |is: &dyn Fn(&Answer) -> bool| answers.iter().filter(|answer| is(answer)).count();
        vec![
            (*set).to_owned(),
            answers.len().to_string(),
            with_interval(count(&|answer| answer.is_right() || answer.is_honest()), answers.len()),
            with_interval(count(&Answer::explains_wrongly), answers.len()),
            sure.len().to_string(),
            with_interval(sure.iter().filter(|named| named.is_true).count(), sure.len()),
            intervals.len().to_string(),
            with_interval(intervals.iter().filter(|covered| **covered).count(), intervals.len()),
        ]
    };
    let header = [
        "set",
        "records",
        "right or honest",
        "explained, wrong",
        "findings at 0.99 or more",
        "true",
        "95 % intervals",
        "contain the true value",
    ];
    write!(text, "{}", table(&header, sets.iter().map(row))).expect("a string");
    text
}

/// Reliability curve as SVG: for each bin the stated probability as a line and the frequency of truth as a dot with its interval.
pub fn figure(sets: &[Graded]) -> String {
    const WIDTH: f64 = 560.0;
    const HEIGHT: f64 = 280.0;
    const LEFT: f64 = 60.0;
    const TOP: f64 = 30.0;
    let step = WIDTH / BINS.len() as f64;
    let y = |part: f64| TOP + HEIGHT * (1.0 - part);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        LEFT + WIDTH + 20.0,
        TOP + HEIGHT + 60.0
    );
    let mut add = |line: String| writeln!(svg, "{line}").expect("a string");
    for tenth in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let (at, right) = (y(tenth), LEFT + WIDTH);
        add(format!("<path d=\"M{LEFT} {at:.1}H{right}\" stroke=\"#ddd\"/>"));
        add(format!(
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{:.0} %</text>",
            LEFT - 6.0,
            at + 4.0,
            100.0 * tenth
        ));
    }
    let series: [(&str, &str, Vec<&Named>); 2] = [
        ("own causes", "#1f77b4", findings(sets, |set| !is_law(set))),
        ("other laws", "#d62728", findings(sets, is_law)),
    ];
    for index in 0..BINS.len() {
        let left = LEFT + step * index as f64;
        let (middle, bottom) = (left + 0.5 * step, TOP + HEIGHT + 18.0);
        add(format!("<text x=\"{middle:.1}\" y=\"{bottom}\" text-anchor=\"middle\">{}</text>", bin_name(index)));
        for (which, (_, colour, findings)) in series.iter().enumerate() {
            let (count, right, stated) = bin(findings, index);
            if count == 0 {
                continue;
            }
            let x = middle + step * (which as f64 - 0.5) / 3.0;
            let [low, high] = wilson(right, count).map(y);
            let (at, from, to) = (y(stated), x - step / 8.0, x + step / 8.0);
            add(format!("<path d=\"M{from:.1} {at:.1}H{to:.1}\" stroke=\"black\" stroke-width=\"2\"/>"));
            add(format!("<path d=\"M{x:.1} {low:.1}V{high:.1}\" stroke=\"{colour}\" stroke-width=\"2\"/>"));
            let dot = y(right as f64 / count as f64);
            add(format!("<circle cx=\"{x:.1}\" cy=\"{dot:.1}\" r=\"4\" fill=\"{colour}\"/>"));
        }
    }
    let bottom = TOP + HEIGHT + 40.0;
    add(format!("<text x=\"{LEFT}\" y=\"{bottom}\">stated probability of a finding (black line: its mean)</text>"));
    add(format!("<text x=\"{LEFT}\" y=\"18\">findings that are true, with 95 % intervals:</text>"));
    for (which, (name, colour, _)) in series.iter().enumerate() {
        let x = LEFT + 280.0 + 110.0 * which as f64;
        add(format!(
            "<circle cx=\"{x}\" cy=\"14\" r=\"4\" fill=\"{colour}\"/><text x=\"{}\" y=\"18\">{name}</text>",
            x + 8.0
        ));
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::campaign::answer::tests::case;
    use crate::campaign::case::Expected;
    use crate::ground_truth::Cause;

    fn answers(probability: f64, right: usize, wrong: usize) -> Vec<Answer> {
        let case = case(Expected::exactly(&[Cause::Drift]));
        let subject = (case.draw)(1);
        let names = std::iter::repeat_n("drift", right).chain(std::iter::repeat_n("hum", wrong));
        let report = |name| json!({"verdict": "explained", "findings": [{"cause": name, "probability": probability}]});
        names.map(|name| Answer::of(&case, &subject, Ok(report(name)))).collect()
    }

    #[test]
    fn a_finding_counts_in_the_bin_of_its_probability() {
        let sets = vec![("singles", answers(0.96, 8, 2)), ("unforeseen", answers(1.0, 3, 1))];
        let page = page(&sets);
        assert!(
            page.contains("| 0.95 to 0.99 | 10 | 96.00 % | 80 % (49.0 to 94.3) | 10 | 80 % (49.0 to 94.3) | 0 | - |"),
            "{page}"
        );
        assert!(page.contains("| 0.999 to 1 | 4 | 100.00 % | 75 %"), "{page}");
        assert!(page.contains("| unforeseen | 4 | 75 %") && page.contains("| 25 % (4.6 to 69.9) | 4 | 75 %"), "{page}");
        let figure = figure(&sets);
        assert_eq!(figure.matches("<circle").count(), 2 + 2, "a dot for each bin with findings, and the legend");
    }

    #[test]
    fn every_set_has_records_and_no_two_the_same_seed() {
        let sets = sets(1, 1);
        let mut seeds: Vec<u64> = sets.iter().flat_map(|(_, cases)| cases).map(|case| case.seed).collect();
        let count = seeds.len();
        seeds.sort_unstable();
        seeds.dedup();
        assert!(seeds.len() == count && sets.iter().all(|(_, cases)| !cases.is_empty()));
    }
}
