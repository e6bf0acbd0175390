//! A plan as text for the terminal.

use identify::plan::Plan;
use identify::plan::answer::{Part, Separation, Sharper, Suspected};
use model::Amplifier;
use simulation::bad_input::number as exact;

use crate::output::cells::line;
use crate::output::diagnosis::number::number;

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
    line(&mut text, &format!("{:>10} {:>10} {:>10}        separates", "from s", "to s", "to V"));
    for part in plan.parts.iter().take(MOST_PARTS) {
        line(&mut text, &of_part(part));
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
            line(&mut text, &of_interval(it));
        }
    }
    text
}

/// The command lines that play the schedule, as far as they can, then diagnose both records.
pub fn how_to_play(plan: &Plan) -> String {
    let Some(schedule) = &plan.schedule else {
        return "With --out DIR the schedule is written for `vsj stair --input` and `vsj link PORT record --input`.\n"
            .into();
    };
    let [low_v, high_v] = plan.range_v;
    if low_v < 0.0 || high_v > Amplifier::MOST_V {
        return format!(
            "Measured:  {schedule} with your own voltage source: `vsj stair` and `vsj link` reach 0 to {} V\n\
             Then:      vsj diagnose next.csv\n",
            exact(Amplifier::MOST_V)
        );
    }
    let most = if high_v > Amplifier::PAPER.max_v { format!(" --limit-v {}", exact(high_v)) } else { String::new() };
    format!(
        "Simulated: vsj stair --input {schedule} --controller none{most}\n\
         Measured:  vsj link PORT record next.csv --input {schedule} --arm\n\
         Then:      vsj diagnose next.csv\n"
    )
}

fn sentence(plan: &Plan) -> String {
    let [low, high] = plan.range_v.map(number);
    let schedule = format!("{} minutes between {low} and {high} V", number(plan.minutes));
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

fn of_part(part: &Part) -> String {
    let way = if part.ramp { "ramp" } else { "hold" };
    let separates = part.separates.map_or_else(String::new, |[one, other]| {
        format!("[{}] from [{}], {:.0} %", one + 1, other + 1, 100.0 * part.contribution)
    });
    let [from, to] = [part.from_s, part.to_s].map(number);
    format!("{from:>10} {to:>10} {:>10}  {way}  {separates}", number(part.voltage_v))
}

fn of_interval(it: &Sharper) -> String {
    let name = format!("{} {}", it.cause, it.parameter);
    let now = it.now.map_or_else(|| "-".to_owned(), number);
    format!("{name:<38}  {now:<12}  {} {}", number(it.planned), it.unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_commands_that_can_play_the_schedule_are_named() {
        let plan = |low_v, high_v| Plan {
            schedule: Some("schedule.csv".into()),
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
            remarks: Vec::new(),
        };
        assert!(how_to_play(&plan(0.0, 700.0)).contains("vsj stair --input schedule.csv --controller none\n"));
        assert!(how_to_play(&plan(0.0, 1000.0)).contains("--controller none --limit-v 1000\n"));
        for [low_v, high_v] in [[0.0, 2100.0], [-100.0, 700.0]] {
            let text = how_to_play(&plan(low_v, high_v));
            assert!(text.starts_with("Measured:  schedule.csv with your own voltage source"), "{text}");
        }
    }
}
