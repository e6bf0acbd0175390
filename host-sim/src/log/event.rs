//! The meaning of log lines, recognised by their format strings.

use defmt_parser::Fragment;
use serde::{Serialize, Serializer};

/// The meaning of a line; a line with other words or values than expected is [`Event::Text`], additional values are
/// allowed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum Event {
    /// `boot version=.. git=.. reset=.. last_fault=.. rate_hz=.. controller=..`: the firmware has started.
    Boot(Boot),
    /// `state .. -> ..`: the supervisor has changed its state.
    State {
        /// State before.
        from: String,
        /// State after.
        to: String,
    },
    /// `fault code=.. name=.. tick=..`: a fault has switched the output off.
    Fault {
        /// Number of the fault.
        code: u8,
        /// Name of the fault.
        name: String,
        /// Tick of the fault.
        tick: u32,
    },
    /// `limit bits=.. tick=..`: the set of acting limits has changed.
    Limit {
        /// The limits, encoded as [`model::Limits::bits`].
        bits: u8,
        /// Tick of the change.
        tick: u32,
    },
    /// `isolation .. tick=..`: the verdict of the isolation bank has changed.
    Isolation {
        /// `alarm`, `named`, `ambiguous`, `unknown` or `quiet`; `withdrawn` if a name has gone.
        verdict: String,
        /// Code of the cause that explains most, or whose name has gone; `None` if there is none.
        #[serde(skip_serializing_if = "Option::is_none")]
        cause: Option<String>,
        /// Tick of the change.
        tick: u32,
    },
    /// `summary tick=.. ..`: sent once a second; counts are since the start.
    Summary {
        /// Number of ticks.
        tick: u32,
        /// Number of late ticks.
        overruns: u32,
        /// Largest lateness of a tick, in us.
        worst_lateness_us: u32,
        /// Root mean square of the lateness over the last second, in us, within 6 %; `None` for older firmware.
        #[serde(skip_serializing_if = "Option::is_none")]
        rms_lateness_us: Option<f32>,
        /// Number of ticks in which a limit acted.
        limited_ticks: u32,
        /// State of the supervisor.
        state: String,
        /// Target stiffness, in mV.
        target_mv: i32,
        /// Voltage across the spring, in mV.
        applied_mv: i32,
        /// Estimated stiffness, in mV.
        stiffness_mv: i32,
    },
    /// `done ticks=.. ..`: an emulated run has ended.
    Done(Done),
    /// `dropped events=..`: lines are missing because they came too fast.
    Dropped {
        /// Number of missing lines since the last such event.
        events: u32,
    },
    /// `panic at ..:..`: the program has stopped itself.
    Panic {
        /// Source file.
        file: String,
        /// Line in the source file.
        line: u32,
    },
    /// Any other line.
    Text,
}

/// A start of the firmware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Boot {
    /// Version of the firmware.
    pub version: String,
    /// Git revision of the firmware.
    pub git: String,
    /// Cause of the reset.
    pub reset: String,
    /// Code of the fault before the reset, 0 for none.
    pub last_fault: u8,
    /// Ticks per second, in Hz.
    pub rate_hz: u32,
    /// Name of the controller; `None` for older firmware.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controller: Option<String>,
}

/// The end of an emulated run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Done {
    /// Number of ticks.
    pub ticks: u32,
    /// Number of missed ticks.
    pub missed: u32,
    /// Digest over all DAC codes and estimates.
    #[serde(serialize_with = "hexadecimal")]
    pub digest: u64,
    /// Smallest number of instructions in a tick.
    pub min: u32,
    /// Mean number of instructions in a tick.
    pub mean: u32,
    /// Largest number of instructions in a tick.
    pub max: u32,
}

/// Serializes a digest as hexadecimal text, because JSON numbers do not hold 64 bits everywhere.
fn hexadecimal<S: Serializer>(digest: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{digest:016x}"))
}

impl Event {
    /// The event of a line, from the fragments of its format string and the text of each argument.
    pub(super) fn of(fragments: &[Fragment<'_>], shown: impl Iterator<Item = String>) -> Self {
        Values::new(fragments, shown).and_then(|values| values.event()).unwrap_or(Self::Text)
    }

    /// Name of the event in JSON and CSV.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Boot(_) => "boot",
            Self::State { .. } => "state",
            Self::Fault { .. } => "fault",
            Self::Limit { .. } => "limit",
            Self::Isolation { .. } => "isolation",
            Self::Summary { .. } => "summary",
            Self::Done(_) => "done",
            Self::Dropped { .. } => "dropped",
            Self::Panic { .. } => "panic",
            Self::Text => "text",
        }
    }
}

/// The values of a line, by the words before them.
struct Values {
    /// First word of the line.
    head: String,
    /// `("tick=", "17")` for ` tick={=u32}`.
    pairs: Vec<(String, String)>,
}

impl Values {
    fn new(fragments: &[Fragment<'_>], shown: impl Iterator<Item = String>) -> Option<Self> {
        let Fragment::Literal(first) = fragments.first()? else { return None };
        let head = first.split_whitespace().next()?.to_owned();
        let mut pairs = Vec::new();
        let mut word = String::new();
        for (fragment, text) in fragments.iter().zip(shown) {
            match fragment {
                Fragment::Literal(_) => word = text.split_whitespace().next_back().unwrap_or("").to_owned(),
                Fragment::Parameter(_) => pairs.push((std::mem::take(&mut word), text)),
            }
        }
        Some(Self { head, pairs })
    }

    fn event(&self) -> Option<Event> {
        Some(match self.head.as_str() {
            "boot" => Event::Boot(Boot {
                version: self.text("version=")?,
                git: self.text("git=")?,
                reset: self.text("reset=")?,
                last_fault: self.number("last_fault=")?,
                rate_hz: self.number("rate_hz=")?,
                controller: self.text("controller="),
            }),
            "state" => Event::State { from: self.text("state")?, to: self.text("->")? },
            "fault" => {
                Event::Fault { code: self.number("code=")?, name: self.text("name=")?, tick: self.number("tick=")? }
            }
            "limit" => Event::Limit { bits: self.number("bits=")?, tick: self.number("tick=")? },
            "isolation" => Event::Isolation {
                // The verdict is a value, but for the word of a name that has gone.
                verdict: self.text("isolation").unwrap_or_else(|| "withdrawn".into()),
                cause: self.text("cause="),
                tick: self.number("tick=")?,
            },
            "summary" => Event::Summary {
                tick: self.number("tick=")?,
                overruns: self.number("overruns=")?,
                worst_lateness_us: self.number("worst_lateness_us=")?,
                rms_lateness_us: self.number("rms_lateness_us="),
                limited_ticks: self.number("limited_ticks=")?,
                state: self.text("state=")?,
                target_mv: self.number("target_mv=")?,
                applied_mv: self.number("applied_mv=")?,
                stiffness_mv: self.number("stiffness_mv=")?,
            },
            "done" => Event::Done(Done {
                ticks: self.number("ticks=")?,
                missed: self.number("missed=")?,
                digest: u64::from_str_radix(self.get("digest=")?.trim_start_matches("0x"), 16).ok()?,
                min: self.number("min=")?,
                mean: self.number("mean=")?,
                max: self.number("max=")?,
            }),
            "dropped" => Event::Dropped { events: self.number("events=")? },
            "panic" => Event::Panic { file: self.text("at")?, line: self.number(":")? },
            _ => return None,
        })
    }

    fn get(&self, word: &str) -> Option<&str> {
        self.pairs.iter().find(|(key, _)| key == word).map(|(_, value)| value.as_str())
    }

    fn text(&self, word: &str) -> Option<String> {
        self.get(word).map(str::to_owned)
    }

    fn number<N: std::str::FromStr>(&self, word: &str) -> Option<N> {
        self.get(word)?.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(format: &str, values: &[&str]) -> Event {
        let fragments = defmt_parser::parse(format, defmt_parser::ParserMode::Strict).unwrap();
        let mut values = values.iter();
        let shown = fragments.iter().map(|fragment| match fragment {
            Fragment::Literal(text) => text.to_string(),
            Fragment::Parameter(_) => values.next().unwrap().to_string(),
        });
        Event::of(&fragments, shown)
    }

    #[test]
    fn words_and_values_make_the_event() {
        assert_eq!(event("limit bits={=u8} tick={=u32}", &["4", "17"]), Event::Limit { bits: 4, tick: 17 });
        let state = Event::State { from: "safe".into(), to: "armed".into() };
        assert_eq!(event("state {=str} -> {=str}", &["safe", "armed"]), state);
        let done = Done { ticks: 9, missed: 0, digest: 0xab, min: 1, mean: 2, max: 3 };
        assert_eq!(
            event(
                "done ticks={=u32} missed={=u32} digest={=u64:x} min={=u32} mean={=u32} max={=u32}",
                &["9", "0", "ab", "1", "2", "3"]
            ),
            Event::Done(done)
        );
    }

    #[test]
    fn a_boot_line_without_controller_is_recognised() {
        let format = "boot version={=str} git={=str} reset={=str} last_fault={=u8} rate_hz={=u32}";
        let values = ["0.1.0", "36094dc", "power-on", "0", "1000", "fast"];
        let controller = |event| if let Event::Boot(boot) = event { boot.controller } else { panic!("{event:?}") };
        assert_eq!(controller(event(format, &values[..5])), None);
        let newer = format!("{format} controller={{=str}}");
        assert_eq!(controller(event(&newer, &values)).as_deref(), Some("fast"));
    }

    #[test]
    fn a_verdict_of_the_isolation_bank_and_a_name_that_has_gone_are_recognised() {
        let isolation = |verdict: &str, cause: Option<&str>, tick| {
            let (verdict, cause) = (verdict.to_owned(), cause.map(str::to_owned));
            Event::Isolation { verdict, cause, tick }
        };
        let named = "isolation {=str} cause={=str} other={=str} size={=f64} since_tick={=u32} tick={=u32}";
        let values = ["named", "gain-error", "-", "0.1", "20096", "51000"];
        assert_eq!(event(named, &values), isolation("named", Some("gain-error"), 51_000));
        let withdrawn = "isolation withdrawn cause={=str} verdict={=str} since_tick={=u32} tick={=u32}";
        let values = ["gain-error", "alarm", "20096", "60000"];
        assert_eq!(event(withdrawn, &values), isolation("withdrawn", Some("gain-error"), 60_000));
        let alarm = event("isolation {=str} since_tick={=u32} tick={=u32}", &["alarm", "20096", "20600"]);
        assert_eq!(alarm, isolation("alarm", None, 20_600));
    }

    #[test]
    fn a_panic_line_gives_file_and_line() {
        let panic = Event::Panic { file: "src/a.rs".into(), line: 7 };
        assert_eq!(event("panic at {=str}:{=u32}", &["src/a.rs", "7"]), panic);
    }

    #[test]
    fn order_and_further_values_do_not_matter() {
        let fault = Event::Fault { code: 3, name: "overrun".into(), tick: 5 };
        assert_eq!(event("fault tick={=u32} pc={=u32:x} code={=u8} name={=str}", &["5", "f00", "3", "overrun"]), fault);
    }

    #[test]
    fn other_lines_are_text() {
        assert_eq!(event("limit reached", &[]), Event::Text);
        assert_eq!(event("limit bits={=u16} tick={=u32}", &["300", "1"]), Event::Text);
        assert_eq!(event("{=u32} ticks", &["1"]), Event::Text);
        assert_eq!(event("", &[]), Event::Text);
    }
}
