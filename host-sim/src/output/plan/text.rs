//! A plan as text for the terminal.

use std::path::Path;

use identify::plan::Plan;
use identify::plan::answer::{Part, Separation, Sharper, Suspected};
use model::Amplifier;
use simulation::bad_input::number as exact;
use simulation::plant_file;
use simulation::units::Unit;

use crate::output::cells::line;
use crate::output::diagnosis::number::number;
use crate::output::files::PLANT_FILE;
use crate::output::terminal::quoted;

/// Largest number of parts that are listed.
const MOST_PARTS: usize = 45;
/// Largest number of pairs of which each is listed.
const MOST_SEPARATIONS: usize = 20;

/// The whole answer, but for the files that were written.
pub fn text(plan: &Plan) -> String {
    let mut text = String::new();
    line(&mut text, &sentence(plan));
    for (index, set) in (1..).zip(&plan.decides) {
        line(&mut text, &format!("  [{index}] {}", causes(set)));
    }
    if !plan.suspects.is_empty() {
        let (odds, confirmed) = ("odds today", "confirmed if true");
        line(&mut text, &format!("\n{:<34} {odds:>12} {confirmed:>18}  hardest to reject", "suspect"));
        plan.suspects.iter().for_each(|suspect| line(&mut text, &of_suspect(suspect)));
    }
    for remark in &plan.remarks {
        line(&mut text, &format!("{}.", capitalised(remark)));
    }
    line(&mut text, "");
    line(
        &mut text,
        &format!("{:>10} {:>10} {:>10}        separates", "from s", "to s", format!("to {}", plan.command_unit.name)),
    );
    for part in plan.parts.iter().take(MOST_PARTS) {
        line(&mut text, &of_part(part, &plan.command_unit));
    }
    if !plan.separations.is_empty() {
        let all = plan.separations.len() <= MOST_SEPARATIONS;
        line(&mut text, if all { "" } else { "\nThe set that is hardest to reject if another is true:" });
        line(&mut text, &format!("{:>10} {:>12}  if true, against", "nats", "probability"));
        for it in plan.separations.iter().filter(|it| all || is_hardest(plan, it)) {
            let pair = format!("{}, against {}", causes(&it.truth), causes(&it.rival));
            line(&mut text, &format!("{:>10} {:>12.3}  {pair}", number(it.nats), it.probability));
        }
    }
    if !plan.intervals.is_empty() {
        line(&mut text, "");
        line(&mut text, "95 % interval of the likeliest set, +-  now           planned");
        for it in &plan.intervals {
            line(&mut text, &of_interval(it, plan));
        }
    }
    text
}

/// The command lines that play the schedule, as far as they can, then diagnose both records.
///
/// `spring` is the plant file of the spring that the diagnosis compared its record with.
pub fn how_to_play(plan: &Plan, spring: &str) -> String {
    let Some(schedule) = &plan.schedule else {
        return "With --out DIR the schedule is written for `vsj stair --input` and `vsj link PORT record --input`.\n"
            .into();
    };
    let plant = quoted(&Path::new(schedule).with_file_name(PLANT_FILE).display().to_string());
    let schedule = quoted(schedule);
    let [low_v, high_v] = plan.range_v;
    let mut text = String::new();
    if low_v < 0.0 || high_v > Amplifier::MOST_V {
        let most_v = exact(Amplifier::MOST_V);
        line(
            &mut text,
            &format!(
                "Measured:  {schedule} with your own voltage source: `vsj stair` and `vsj link` reach 0 to {most_v} V"
            ),
        );
    } else {
        // The tick refuses springs that a simulation in double precision accepts.
        if plant_file::parse(PLANT_FILE, spring).is_ok() {
            let is_beyond = high_v > Amplifier::PAPER.max_v;
            let most = if is_beyond { format!(" --limit-v {}", exact(high_v)) } else { String::new() };
            line(
                &mut text,
                &format!("Simulated: vsj stair --plant {plant} --input {schedule} --controller none{most}"),
            );
        }
        line(&mut text, &format!("Measured:  vsj link PORT record next.csv --input {schedule} --arm"));
    }
    let columns = if plan.reading_unit == "V" { "" } else { ", with the first record's options for its columns" };
    line(&mut text, &format!("Then:      vsj diagnose next.csv --plant {plant}{columns}"));
    text
}

fn sentence(plan: &Plan) -> String {
    let Unit { name, si } = &plan.command_unit;
    let [low, high] = plan.range_v.map(|volts| number(volts / si));
    let schedule = format!("{} minutes between {low} and {high} {name}", number(plan.minutes));
    match plan.probability {
        Some(probability) => format!(
            "{schedule} decide between {} sets of causes with a predicted probability of {probability:.3}:",
            plan.decides.len()
        ),
        None => format!("Nothing is undecided; {schedule} for the tightest intervals:"),
    }
}

/// True if no other set is harder to reject where the same one is true.
fn is_hardest(plan: &Plan, it: &Separation) -> bool {
    let ease = |it: &Separation| [it.probability, it.nats];
    plan.separations.iter().filter(|other| other.truth == it.truth).all(|other| ease(other) >= ease(it))
}

/// Names of a set.
fn causes(set: &[String]) -> String {
    if set.is_empty() { "no cause".to_owned() } else { set.join(" + ") }
}

fn capitalised(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn of_suspect(suspect: &Suspected) -> String {
    let odds = format!("1 to {}", number((-suspect.nats).exp()));
    let Suspected { cause, probability, rival, .. } = suspect;
    format!("{cause:<34} {odds:>12} {probability:>18.3}  {}", causes(rival))
}

fn of_part(part: &Part, command: &Unit) -> String {
    let way = if part.ramp { "ramp" } else { "hold" };
    let separates = part.separates.map_or_else(String::new, |[one, other]| {
        format!("[{}] from [{}], {:.0} %", one + 1, other + 1, 100.0 * part.contribution)
    });
    let [from, to] = [part.from_s, part.to_s].map(number);
    format!("{from:>10} {to:>10} {:>10}  {way}  {separates}", number(part.voltage_v / command.si))
}

fn of_interval(it: &Sharper, plan: &Plan) -> String {
    let name = format!("{} {}", it.cause, it.parameter);
    // A reading in V is not converted: the answer does not tell it from a voltage.
    let of_command = it.unit.strip_prefix('V').filter(|rest| plan.reading_unit != "V" && ["", "/s"].contains(rest));
    let Unit { name: command, si } = &plan.command_unit;
    let (unit, si) = of_command.map_or((it.unit.clone(), 1.0), |rest| (format!("{command}{rest}"), *si));
    let now = it.now.map_or_else(|| "-".to_owned(), |now| number(now / si));
    format!("{name:<38}  {now:<12}  {} {unit}", number(it.planned / si))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(low_v: f64, high_v: f64) -> Plan {
        Plan {
            schedule: Some("my plan/schedule.csv".into()),
            decides: Vec::new(),
            probability: None,
            minutes: 1.0,
            range_v: [low_v, high_v],
            suspects: Vec::new(),
            separations: Vec::new(),
            parts: Vec::new(),
            intervals: Vec::new(),
            commands: Vec::new(),
            responses: Vec::new(),
            reading_unit: "V".into(),
            command_unit: Unit::of_voltage("V"),
            remarks: Vec::new(),
        }
    }

    /// A voltage in kV as such, and a command that is no voltage in its own unit.
    #[test]
    fn commands_are_in_the_unit_of_the_record() {
        let part = Part { from_s: 0.0, to_s: 2.0, voltage_v: 4900.0, ramp: false, separates: None, contribution: 0.0 };
        let width = Sharper {
            cause: "hysteresis".into(),
            parameter: "width_v".into(),
            value: 200.0,
            now: Some(100.0),
            planned: 50.0,
            unit: "V".into(),
        };
        for (unit, [range, level, half]) in [
            ("V", ["between 0 and 4900 V", "4900  hold", "50.00 V"]),
            ("kV", ["between 0 and 4.900 kV", "4.900  hold", "0.05000 kV"]),
            ("bar", ["between 0 and 4900 bar", "4900  hold", "50.00 bar"]),
        ] {
            let plan = Plan {
                command_unit: Unit::of_voltage(unit),
                parts: vec![part.clone()],
                intervals: vec![width.clone()],
                reading_unit: "mm".into(),
                ..plan(0.0, 4900.0)
            };
            let said = text(&plan);
            assert!([range, level, half, &format!("to {unit} ")].iter().all(|it| said.contains(it)), "{said}");
        }
    }

    #[test]
    fn only_commands_that_can_play_the_schedule_are_named() {
        let spring = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 4.0\n";
        let text = how_to_play(&plan(0.0, 700.0), spring);
        let simulated = "vsj stair --plant 'my plan/plant.toml' --input 'my plan/schedule.csv' --controller none\n";
        assert!(text.contains(simulated), "{text}");
        assert!(text.ends_with("vsj diagnose next.csv --plant 'my plan/plant.toml'\n"), "{text}");
        assert!(how_to_play(&plan(0.0, 1000.0), spring).contains("--controller none --limit-v 1000\n"));
        for [low_v, high_v] in [[0.0, 2100.0], [-100.0, 700.0]] {
            let text = how_to_play(&plan(low_v, high_v), spring);
            assert!(text.starts_with("Measured:  'my plan/schedule.csv' with your own voltage source"), "{text}");
        }
        let beyond_the_tick = spring.replace("0.1", "0.999999999");
        assert!(!how_to_play(&plan(0.0, 700.0), &beyond_the_tick).contains("Simulated"), "the tick refuses it");
    }
}
