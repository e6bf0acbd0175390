//! A diagnosis as text: a few sentences, then tables.

use std::fmt::Write;

use identify::answer::{self, Extended, Finding, LinearError, Margins, Nominal, Quality, SearchReport, Verdict};
use identify::dimension::{Dimension, significant};
use identify::effects::effect::Location;
use identify::effects::{EFFECTS, index_of};
use identify::record::scales::Scales;
use identify::verdict::export::SMALL_ERROR_V;
use simulation::units::quotient;

use crate::output::diagnosis::equation;
use crate::output::diagnosis::number::{interval, linear_name, number, probability, shown_name};
use crate::output::diagnosis::records;
use crate::output::diagnosis::suspects;

/// Smallest held-out improvement that is reported as one.
const SMALLEST_IMPROVEMENT: f64 = 0.005;
/// Ratio of the held-out errors of the extended simulation and of the best linear model from which on the nominal spring is another
/// one than that of the record.
const ANOTHER_SPRING: f64 = 2.0;
/// Ratio of the errors of the simulation and of its extension up to which the simulation may be right.
const HARDLY_LARGER: f64 = 1.1;

/// The text for the terminal.
pub fn text(name: &str, report: &answer::Report, scales: &Scales) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{}", nominal(&report.nominal, scales));
    for sentence in sentences(name, report, scales) {
        let _ = writeln!(text, "{sentence}");
    }
    if !report.findings.is_empty() {
        let _ = writeln!(text, "\n{:34} {:>11}   parameters with 95 % intervals", "cause", "probability");
        for finding in &report.findings {
            row(&mut text, finding, scales);
        }
    }
    text += &suspects::text(&report.suspects, scales);
    text += &equation::text(report.equation_details.as_ref(), scales);
    text += &records::text(&report.records, scales);
    let (before, after) = (&report.baseline, &report.extended.quality);
    let extends = !report.findings.is_empty() || !report.take_out.is_empty();
    let linear_column = report.linear.map_or_else(String::new, |linear| format!(" {:>16}", linear_name(&linear)));
    let extended_column = if extends { "     extended" } else { "" };
    let _ = writeln!(text, "\n{:22} {:>12}{extended_column}{linear_column}", "", "simulation");
    let error = |of: &str| format!("{of} RMSE [{}]", scales.unit(Dimension::ReadingSize));
    let of_linear = |of: fn(&LinearError) -> f64| report.linear.as_ref().map(of);
    for (what, before, after, linear) in [
        (error("free-run"), before.rmse, after.rmse, of_linear(|linear| linear.rmse)),
        (error("held-out"), before.held_out_rmse, after.held_out_rmse, of_linear(|linear| linear.held_out_rmse)),
        (error("one-step"), before.one_step_rmse, after.one_step_rmse, None),
        ("fit [%]".to_owned(), before.fit_percent, after.fit_percent, None),
    ] {
        let number = |value: f64| match value.is_finite() {
            true if what == "fit [%]" => format!("{value:.3}"),
            true => number(value),
            false => "-".into(),
        };
        let after = if extends { format!(" {:>12}", number(after)) } else { String::new() };
        let linear = linear.map_or_else(String::new, |linear| format!(" {:>16}", number(linear)));
        let _ = writeln!(text, "{what:22} {:>12}{after}{linear}", number(before));
    }
    for sentence in limits_of_curves(report, scales) {
        let _ = writeln!(text, "{sentence}");
    }
    if extends && let Some(sentence) = in_fixed_point(&report.extended, scales) {
        let _ = writeln!(text, "{sentence}");
    }
    text
}

/// States where the record shows the curves of the extended spring: its static law, and parameters that are values of a curve.
pub fn limits_of_curves(report: &answer::Report, scales: &Scales) -> Vec<String> {
    let law = law_range(&report.extended, scales).into_iter();
    law.chain(report.findings.iter().filter_map(|finding| extrapolated(finding, scales))).collect()
}

/// States where the static law is known, and how the plant file continues it; `None` if no nonlinear law was found.
fn law_range(extended: &Extended, scales: &Scales) -> Option<String> {
    let [low, high] = extended.law_range_v?;
    let volts = |voltage| scales.with_unit(Dimension::Voltage, voltage, 0);
    let below = if low > 0.0 { format!(", and below it as a straight line to {}", volts(0.0)) } else { String::new() };
    Some(format!(
        "The record shows the static law from {} to {}; the plant file continues it above with its end slope{below}.",
        scales.number(Dimension::Voltage, low, 0),
        volts(high)
    ))
}

/// States which parameters of a finding are extrapolated, and from which voltages; `None` if none are.
fn extrapolated(finding: &Finding, scales: &Scales) -> Option<String> {
    let all = finding.parameters.iter().filter_map(|(name, it)| Some((name.as_str(), it.extrapolated_from_v?)));
    let (names, ranges): (Vec<&str>, Vec<[f64; 2]>) = all.unzip();
    let [low, high] = *ranges.first()?;
    Some(format!(
        "{}: {} {} extrapolated from a record of {} to {}.",
        finding.cause,
        names.join(" and "),
        if names.len() == 1 { "is" } else { "are" },
        scales.number(Dimension::Voltage, low, 0),
        scales.with_unit(Dimension::Voltage, high, 0)
    ))
}

/// States whether the fixed-point tick simulates the extended spring; `None` if that was not tested.
pub fn in_fixed_point(extended: &Extended, scales: &Scales) -> Option<String> {
    if let Some(why) = &extended.tick_refuses {
        return Some(format!("The fixed-point tick can NOT simulate the extended spring: {why}."));
    }
    let error_v = extended.fixed_point_error_v?;
    let error = scales.with_unit(Dimension::Voltage, error_v, 3);
    let small_v = scales.restored(Dimension::Voltage, SMALL_ERROR_V);
    Some(if error_v <= small_v {
        format!("The fixed-point tick simulates the extended spring within {error} of the fit.")
    } else {
        format!(
            "The written extended spring is NOT the fitted one: in the fixed-point tick it differs by up to \
             {error}, more than {}.",
            scales.with_unit(Dimension::Voltage, small_v, 0)
        )
    })
}

/// States that the search was ended before it had tried all causes; `None` if it was not.
fn unfinished(report: &answer::Report) -> Option<String> {
    let SearchReport { effort, work, allowed, finished } = report.search;
    if !report.complete {
        let percent = 100.0 * work as f64 / allowed.max(1) as f64;
        return Some(format!(
            "The search was stopped after {percent:.0} % of the work of `--effort {effort}`: this is the best answer so far."
        ));
    }
    (!finished).then(|| {
        let more = if effort == "thorough" { "" } else { "; `--effort thorough` searches longer" };
        format!("The search ended with the work of `--effort {effort}`, before it had tried everything{more}.")
    })
}

/// States which parts of the plant file this spring does not have; `None` if it has all of them.
fn parts_to_take_out(report: &answer::Report, scales: &Scales) -> Option<String> {
    let parts = &report.take_out;
    let (are, them) = if parts.len() == 1 { ("is", "it") } else { ("are", "them") };
    let (before, after) = (&report.baseline, &report.extended.quality);
    (!parts.is_empty()).then(|| {
        format!(
            "The plant file's {} {are} not in this spring: take {them} out. The held-out error decreases \
             from {} to {} without {them}{}.",
            parts.join(" and "),
            number(before.held_out_rmse),
            scales.four_digits(Dimension::ReadingSize, after.held_out_rmse),
            if report.findings.is_empty() { "" } else { " and with the causes below" }
        )
    })
}

/// States that the record shows another spring than the nominal one; `None` unless a linear model predicts it far better.
fn another_spring(report: &answer::Report) -> Option<String> {
    let ratio = report.extended.quality.held_out_rmse / report.linear?.held_out_rmse;
    let another = report.verdict == Verdict::Unexplained
        && report.nominal.plant != "identify"
        && ratio > ANOTHER_SPRING
        && ratio.is_finite();
    another.then(|| {
        format!(
            "A linear model predicts held-out readings {} times better: the record is of another spring than the nominal one. \
             `--plant identify` judges the spring that it shows.",
            significant(ratio, 2)
        )
    })
}

/// A relative error in words, with two digits.
fn off_by(part: f64) -> String {
    let percent = 100.0 * part;
    match part {
        ..0.1 => format!("{percent:.*} %", (1.0 - percent.log10().floor()).clamp(1.0, 6.0) as usize),
        0.1..1.0 => format!("{percent:.0} %"),
        1.0..100.0 => format!("a factor of {:.0}", 1.0 + part),
        _ => "any factor".into(),
    }
}

/// States which nominal spring is judged.
pub fn nominal(nominal: &Nominal, scales: &Scales) -> String {
    let taus: Vec<String> = nominal.tau_s.iter().map(|&tau_s| scales.four_digits(Dimension::Time, tau_s)).collect();
    let reading = match (nominal.gain, nominal.zero) {
        (1.0, 0.0) => String::new(),
        (gain, zero) => {
            let per = scales.units.voltage.si;
            let unit = quotient(&scales.unit(Dimension::Reading), &scales.unit(Dimension::Voltage));
            format!(
                ", gain {} {unit}, zero {}",
                significant(gain * per, 4),
                scales.four_digits(Dimension::Reading, zero)
            )
        }
    };
    // A spring that follows the voltage without delay has a time constant in its plant file, which acts on nothing.
    let dynamics = match (nominal.share, taus.as_slice()) {
        (1.0, [_]) => "no dynamics".to_owned(),
        (share, taus) => format!("time constant {}, instantaneous share {}", taus.join(" and "), significant(share, 3)),
    };
    let delay = match nominal.delay_s {
        0.0 => String::new(),
        delay_s => format!(", delay {}", scales.four_digits(Dimension::Time, delay_s)),
    };
    let oscillation = |&freq_hz: &f64| format!(", oscillation {}", scales.four_digits(Dimension::Frequency, freq_hz));
    let oscillations: String = nominal.freq_hz.iter().map(oscillation).collect();
    format!("Nominal spring: {}, {dynamics}{delay}{oscillations}{reading}.", nominal.plant)
}

/// The findings, the held-out improvement, and the next experiment, one sentence each.
pub fn sentences(name: &str, report: &answer::Report, scales: &Scales) -> Vec<String> {
    let mut sentences: Vec<String> = unfinished(report).into_iter().collect();
    sentences.extend(parts_to_take_out(report, scales));
    sentences.push(verdict(name, report));
    sentences.extend(improvement(report, scales));
    sentences.extend(best_suspect(report, scales));
    sentences.extend(open_alternatives(report));
    sentences.extend(doubtful_findings(report));
    sentences.extend(autocorrelated_noise(report, scales));
    sentences.extend(leftover(report));
    let next = || report.next_experiment.as_ref().map(|next| format!("To decide, {next}."));
    sentences.extend(another_spring(report).or_else(next));
    sentences
}

/// True if what is left of the readings, not what they lack, is why the record cannot decide.
fn is_undecided(report: &answer::Report) -> bool {
    report.verdict == Verdict::Insufficient && report.leftover.is_some() && report.would_show.is_none()
}

/// States the verdict with the causes.
fn verdict(name: &str, report: &answer::Report) -> String {
    let effects = report.findings.iter().filter_map(|finding| index_of(finding.cause)).map(|index| EFFECTS[index]);
    let causes: Vec<String> =
        effects.clone().map(|effect| format!("{} ({})", effect.cause(), effect.description())).collect();
    let margins = report.would_show.map(|Margins { gain, time_constant }| {
        format!("a gain off by {} or a time constant off by {}", off_by(gain), off_by(time_constant))
    });
    let rows = report.rows;
    match report.verdict {
        Verdict::Explained if causes.is_empty() => {
            let with = if report.take_out.is_empty() { "With what single records show" } else { "Without that" };
            format!("{with}, the simulation agrees with {name} within the noise of {rows} readings.")
        }
        Verdict::Consistent => {
            let what = if report.leftover.is_none() {
                "no difference beyond noise"
            } else {
                "no difference that needs a cause"
            };
            format!(
                "The simulation agrees with {name}: {what} in {rows} readings{}.",
                margins.map_or_else(String::new, |off| format!(", in which {off} would have been detected"))
            )
        }
        Verdict::Insufficient if is_undecided(report) => {
            format!("{name} cannot decide whether the simulation is wrong.")
        }
        Verdict::Insufficient => format!(
            "{name} cannot decide whether the simulation is wrong: its {rows} readings have too little excitation{}.",
            margins.map_or_else(String::new, |off| format!("; {off} could remain undetected"))
        ),
        Verdict::Ambiguous if causes.is_empty() => {
            format!(
                "The simulation agrees with {name} together, but more than one answer fits what single records show."
            )
        }
        Verdict::Unexplained if causes.is_empty() && !report.search.finished => {
            format!("The simulation is wrong on {name}, and no cause that was tried explains it.")
        }
        Verdict::Unexplained if causes.is_empty() => {
            format!("The simulation is wrong on {name}, and no known cause explains it.")
        }
        Verdict::Unexplained => {
            let explain = if causes.len() == 1 { "explains" } else { "explain" };
            format!("The simulation is wrong on {name}; {} {explain} only a part of the error.", causes.join(", "))
        }
        Verdict::Ambiguous | Verdict::Explained => {
            let in_readings = effects.clone().all(|effect| effect.location() == Location::Reading);
            let is_coarse = report.findings.iter().all(|finding| finding.cause == "quantisation");
            let what = match (in_readings, report.alternatives.iter().any(Vec::is_empty)) {
                (false, false) => format!("The simulation is wrong on {name}"),
                (false, true) => format!("The simulation may be wrong on {name}"),
                (true, false) if is_coarse => format!("The readings of {name} are coarse"),
                (true, false) => format!("The readings of {name} are at fault"),
                (true, true) => format!("The readings of {name} may be at fault"),
            };
            format!("{what}: {}.", causes.join("; "))
        }
    }
}

/// States by how much the findings reduce the error; `None` without any, or if parts of the plant file were taken out as well.
fn improvement(report: &answer::Report, scales: &Scales) -> Option<String> {
    if report.findings.is_empty() || !report.take_out.is_empty() {
        return None;
    }
    let unit = scales.unit(Dimension::ReadingSize);
    let it = if report.findings.len() == 1 { "it" } else { "them" };
    let (before, after) = (&report.baseline, &report.extended.quality);
    Some(if report.extended.gain > SMALLEST_IMPROVEMENT {
        format!(
            "With {it} in the model, the held-out error decreases from {} to {} {unit}, by {:.1} %.",
            number(before.held_out_rmse),
            number(after.held_out_rmse),
            100.0 * report.extended.gain
        )
    } else if after.rmse > (1.0 - SMALLEST_IMPROVEMENT) * before.rmse {
        let whose =
            if report.verdict == Verdict::Unexplained { "" } else { ": nearly all of it is noise of the readings" };
        format!("With {it} in the model, the error stays at {} {unit}{whose}.", number(after.rmse))
    } else {
        format!(
            "With {it} in the model, the error decreases from {} to {} {unit}, but the held-out error does not: the \
             other parts of the record do not predict it.",
            number(before.rmse),
            number(after.rmse)
        )
    })
}

/// States which suspect comes closest to a finding; `None` if the record is explained, or there is none.
fn best_suspect(report: &answer::Report, scales: &Scales) -> Option<String> {
    let suspect = report.suspects.first().filter(|_| report.verdict == Verdict::Unexplained)?;
    let unit = scales.unit(Dimension::ReadingSize);
    let distance = match suspect.probability {
        Some(value) => format!("with {}", probability(value)),
        None => format!("{:.1} nats short of a finding", suspect.nats_short),
    };
    let (before, after) = (number(suspect.rmse_before), number(suspect.rmse_after));
    let error = match suspect.rmse_after < suspect.rmse_before {
        true => format!("it changes the error from {before} to {after} {unit}"),
        false => format!("it does not lower the error, {before} {unit} without it and {after} {unit} with it"),
    };
    Some(format!("The best suspect is {}, {distance}: {error}.", suspect.cause))
}

/// States which other sets of causes the readings do not reject; `None` if they reject all.
fn open_alternatives(report: &answer::Report) -> Option<String> {
    let is_right = report.baseline.rmse <= HARDLY_LARGER * report.extended.quality.rmse;
    let nothing = if is_right { "no error at all" } else { "a law that no cause describes" };
    let name = |set: &Vec<&str>| if set.is_empty() { nothing.to_owned() } else { set.join(" with ") };
    let open: Vec<String> = report.alternatives.iter().filter(|set| !report.rejects(set)).map(name).collect();
    (!open.is_empty()).then(|| format!("Alternatives that the data cannot reject: {}.", open.join("; ")))
}

/// States which findings a law that no cause describes may stand behind; `None` if there are none.
fn doubtful_findings(report: &answer::Report) -> Option<String> {
    if report.alternatives.is_empty() {
        return None;
    }
    let rejected: Vec<_> = report.alternatives.iter().filter(|set| report.rejects(set)).collect();
    let lacks = |finding: &&Finding| rejected.iter().any(|set| !set.contains(&finding.cause));
    let is_doubtful = |finding: &&Finding| !finding.is_likely() || lacks(finding);
    let doubtful: Vec<&str> = report.findings.iter().filter(is_doubtful).map(|finding| finding.cause).collect();
    (!doubtful.is_empty()).then(|| {
        format!(
            "Not certain enough: {}; a law that no cause describes may be in {} place.",
            doubtful.join(", "),
            if doubtful.len() == 1 { "its" } else { "their" }
        )
    })
}

/// States that the noise hides slow effects of the spring; `None` if there is a cause, or no experiment that would show more.
fn autocorrelated_noise(report: &answer::Report, scales: &Scales) -> Option<String> {
    let Quality { rmse, one_step_rmse, .. } = report.extended.quality;
    (report.verdict == Verdict::Consistent && report.next_experiment.is_some()).then(|| {
        let unit = scales.unit(Dimension::ReadingSize);
        format!(
            "The noise is autocorrelated: {} {unit} in free run, {} {unit} in one step. A slow effect of the spring \
             could be mistaken for it.",
            number(rmse),
            number(one_step_rmse)
        )
    })
}

/// States what no cause explains; `None` if nothing is left.
fn leftover(report: &answer::Report) -> Option<String> {
    let decides = !is_undecided(report) && report.verdict != Verdict::Unexplained;
    let small = if decides { "Too small to change this verdict: " } else { "" };
    report.leftover.as_ref().map(|leftover| format!("{small}{leftover}."))
}

fn row(text: &mut String, finding: &Finding, scales: &Scales) {
    let parameters: Vec<String> = finding
        .parameters
        .iter()
        .map(|(name, it)| format!("{} = {}", shown_name(name, it.dimension, scales), interval(it, scales)))
        .collect();
    let _ = writeln!(text, "{:34} {:>11.3}   {}", finding.cause, finding.probability, parameters.join(", "));
    let _ = writeln!(text, "  {}", finding.evidence);
}

#[cfg(test)]
mod tests {
    use super::*;
    use identify::answer::{NoiseReport, ResidualReport, SCHEMA};
    use identify::hypotheses::Rival;
    use simulation::units::Units;

    /// The first two sentences about causes that do not reduce the error.
    fn said(verdict: Verdict, causes: &[&'static str], alternatives: &[Vec<&'static str>]) -> String {
        sentences("r.csv", &report(verdict, causes, alternatives), &Scales::default())[..2].join(" ")
    }

    fn report(verdict: Verdict, causes: &[&'static str], alternatives: &[Vec<&'static str>]) -> answer::Report {
        let quality = Quality { rmse: 7.86, fit_percent: 90.0, held_out_rmse: 7.86, one_step_rmse: 7.86 };
        let finding = |&cause: &&'static str| Finding {
            cause,
            probability: 1.0,
            parameters: Vec::new(),
            rmse_before: 7.86,
            rmse_after: 7.86,
            evidence: String::new(),
            proved: false,
        };
        answer::Report {
            schema: SCHEMA,
            rows: 600,
            complete: true,
            search: SearchReport { effort: "normal", work: 3, allowed: 9, finished: true },
            verdict,
            nominal: Nominal::default(),
            baseline: quality,
            findings: causes.iter().map(finding).collect(),
            rivals: Vec::new(),
            experiment: None,
            suspects: Vec::new(),
            take_out: Vec::new(),
            would_show: None,
            alternatives: alternatives.to_vec(),
            next_experiment: None,
            extended: Extended {
                quality,
                gain: 0.0,
                law_range_v: None,
                model: None,
                fixed_point_error_v: None,
                tick_refuses: None,
            },
            linear: None,
            equation: None,
            equation_details: None,
            leftover: None,
            noise: NoiseReport { sigma: 1.0, tail: None, memory_rows: 0 },
            residual: ResidualReport { autocorrelation: Vec::new(), input_correlation: Vec::new(), band: 0.0 },
            records: Vec::new(),
        }
    }

    #[test]
    fn a_search_that_ended_early_is_said_first() {
        let mut report = report(Verdict::Unexplained, &[], &[]);
        report.search.finished = false;
        let first = |report: &answer::Report| sentences("r.csv", report, &Scales::default()).remove(0);
        assert!(first(&report).ends_with("everything; `--effort thorough` searches longer."));
        report.complete = false;
        assert!(first(&report).starts_with("The search was stopped after 33 % of the work"));
    }

    #[test]
    fn best_linear_model_has_a_column_with_its_order() {
        let mut report = report(Verdict::Explained, &["hum"], &[]);
        report.linear = Some(LinearError { order: 3, rmse: 5.1, held_out_rmse: 6.7, last_40_percent_rmse: 9.0 });
        let text = text("r.csv", &report, &Scales::default());
        let words = |start: &str| {
            let line = text.lines().find(|line| line.starts_with(start)).expect("a line");
            line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
        };
        assert!(text.contains("simulation     extended  linear, order 3\n"), "{text}");
        assert_eq!(words("free-run")[3..], ["7.860", "7.860", "5.100"]);
        assert_eq!(words("held-out")[3..], ["7.860", "7.860", "6.700"]);
    }

    #[test]
    fn best_suspect_of_an_unexplained_record_is_said() {
        let mut report = report(Verdict::Unexplained, &[], &[]);
        report.suspects.push(answer::Suspect {
            cause: "reading-offset",
            with: Vec::new(),
            parameters: Vec::new(),
            rmse_before: 42.675,
            rmse_after: 20.029,
            nats_short: 4.46,
            judge: answer::Judge::LeaveOneOut,
            probability: None,
        });
        let said = "The best suspect is reading-offset, 4.5 nats short of a finding: it changes the error from 42.67 to 20.03 V.";
        assert_eq!(sentences("r.csv", &report, &Scales::default())[1], said);
    }

    /// However small the normalised unit is, or the error beside the record's readings.
    #[test]
    fn errors_have_four_digits_in_any_unit() {
        let mut report = report(Verdict::Explained, &["hysteresis"], &[]);
        report.baseline.held_out_rmse = 698.997_17;
        report.extended.quality.held_out_rmse = 0.078_64;
        report.extended.gain = 0.9999;
        let units = Units { reading: "mm".into(), ..Units::default() };
        let scales = Scales { reading: 0.01, units, ..Scales::default() };
        let said = "With it in the model, the held-out error decreases from 699.0 to 0.07864 mm, by 100.0 %.";
        assert_eq!(sentences("r.csv", &report, &scales)[1], said);
        assert!(text("r.csv", &report, &scales).contains("held-out RMSE [mm]            699.0      0.07864\n"));
    }

    #[test]
    fn a_record_of_another_spring_is_sent_to_identify() {
        let mut report = report(Verdict::Unexplained, &[], &[]);
        report.next_experiment = Some("run the same schedule again".into());
        let last = |report: &answer::Report| sentences("r.csv", report, &Scales::default()).pop().expect("a sentence");
        report.linear = Some(LinearError { order: 4, rmse: 0.5, held_out_rmse: 0.6, last_40_percent_rmse: 0.7 });
        assert!(
            last(&report).starts_with("A linear model predicts held-out readings 13 times better"),
            "{}",
            last(&report)
        );
        report.nominal.plant = "identify".into();
        assert_eq!(last(&report), "To decide, run the same schedule again.");
    }

    #[test]
    fn a_set_that_the_readings_reject_is_no_alternative_that_they_cannot_reject() {
        let mut report = report(Verdict::Ambiguous, &["gain-error", "drift"], &[vec!["gain-error"], vec!["hum"]]);
        let rival = |cause: &str, nats| Rival {
            causes: vec![cause.into()],
            nats,
            parameters: Default::default(),
            blocks: Vec::new(),
            covariance: Vec::new(),
        };
        report.rivals = vec![rival("gain-error", -14_120.0), rival("hum", -2.0)];
        let said = sentences("r.csv", &report, &Scales::default());
        assert_eq!(said[said.len() - 2], "Alternatives that the data cannot reject: hum.");
        assert!(
            said[said.len() - 1].starts_with("Not certain enough: drift; a law that no cause describes"),
            "{said:?}"
        );
    }

    #[test]
    fn ranges_of_curves_are_said() {
        let mut report = report(Verdict::Explained, &["voltage-dependent-time-constant"], &[]);
        assert!(limits_of_curves(&report, &Scales::default()).is_empty());
        report.extended.law_range_v = Some([0.0, 330.2]);
        let tau = answer::Parameter {
            value: 8.0,
            low: 7.0,
            high: 9.0,
            unit: "s".into(),
            at_bound: false,
            extrapolated_from_v: Some([0.0, 300.0]),
            dimension: Dimension::Time,
        };
        report.findings[0].parameters.push(("tau_high_s".to_owned(), tau));
        let said = limits_of_curves(&report, &Scales::default());
        let law =
            "The record shows the static law from 0 to 330 V; the plant file continues it above with its end slope.";
        let tau = "voltage-dependent-time-constant: tau_high_s is extrapolated from a record of 0 to 300 V.";
        assert_eq!(said, [law, tau]);
        assert!(text("r.csv", &report, &Scales::default()).contains("tau_high_s = 8.0 [7.0, 9.0] s (extrapolated)\n"));
        report.extended.law_range_v = Some([200.0, 500.0]);
        let law = limits_of_curves(&report, &Scales::default()).remove(0);
        assert!(law.ends_with("above with its end slope, and below it as a straight line to 0 V."), "{law}");
    }

    #[test]
    fn a_spring_without_dynamics_has_no_time_constant() {
        let spring =
            |share| Nominal { plant: "identify".into(), gain: 1.0, share, tau_s: vec![4.0], ..Nominal::default() };
        assert_eq!(nominal(&spring(1.0), &Scales::default()), "Nominal spring: identify, no dynamics.");
        let lag = "Nominal spring: identify, time constant 4.000 s, instantaneous share 0.500.";
        assert_eq!(nominal(&spring(0.5), &Scales::default()), lag);
        let more = Nominal { delay_s: 6.0, freq_hz: vec![2.5], ..spring(0.5) };
        let said = format!("{}, delay 6.000 s, oscillation 2.500 Hz.", lag.trim_end_matches('.'));
        assert_eq!(nominal(&more, &Scales::default()), said);
    }

    #[test]
    fn a_margin_has_two_digits() {
        for (part, said) in [
            (0.000_43, "0.043 %"),
            (0.0058, "0.58 %"),
            (0.071, "7.1 %"),
            (0.4, "40 %"),
            (44.42, "a factor of 45"),
            (f64::INFINITY, "any factor"),
        ] {
            assert_eq!(off_by(part), said);
        }
    }

    #[test]
    fn readings_and_simulation_are_distinguished_as_the_source_of_the_error() {
        use Verdict::{Ambiguous, Explained, Unexplained};
        let nothing = [Vec::new()];
        for (verdict, causes, alternatives, expected) in [
            (Explained, &["outliers", "hum"][..], &[][..], "The readings of r.csv are at fault: outliers (single"),
            (Ambiguous, &["reading-offset"], &nothing, "The readings of r.csv may be at fault: reading-offset ("),
            (Explained, &["outliers", "drift"], &[], "The simulation is wrong on r.csv: outliers (single"),
            (Ambiguous, &["drift"], &nothing, "The simulation may be wrong on r.csv: drift ("),
            (Unexplained, &["hum"], &[], "The simulation is wrong on r.csv; hum ("),
        ] {
            let said = said(verdict, causes, alternatives);
            assert!(said.starts_with(expected), "{said}");
            let whose = "stays at 7.860 V: nearly all of it is noise of the readings.";
            assert_eq!(said.ends_with(whose), verdict != Unexplained, "{said}");
        }
        for (causes, part) in [
            (&["drift"][..], ") explains only a part of the error."),
            (&["drift", "hum"], ") explain only a part of the error."),
        ] {
            let said = said(Unexplained, causes, &[]);
            assert!(said.contains(part), "{said}");
        }
    }
}
