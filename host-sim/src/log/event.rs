//! What the lines of the controller's firmware say, told by their format strings.

use defmt_parser::Fragment;
use serde::{Serialize, Serializer};

/// A line with a meaning. One whose words or values are others than expected is [`Event::Text`]; further values are fine.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum Event {
    /// `boot version=.. git=.. reset=.. last_fault=.. rate_hz=.. controller=..`: the firmware starts.
    Boot(Boot),
    /// `state .. -> ..`: the supervisor goes from one state to another.
    State {
        /// Old state.
        from: String,
        /// New state.
        to: String,
    },
    /// `fault code=.. name=.. tick=..`: the output goes off.
    Fault {
        /// Number of the fault.
        code: u8,
        /// Its name.
        name: String,
        /// When.
        tick: u32,
    },
    /// `limit bits=.. tick=..`: other limits act than in the tick before.
    Limit {
        /// As [`model::Limits::bits`].
        bits: u8,
        /// When.
        tick: u32,
    },
    /// `summary tick=.. ..`: once a second. Counts are since the start.
    Summary {
        /// Ticks so far.
        tick: u32,
        /// Ticks that came too late.
        overruns: u32,
        /// The latest of them.
        worst_lateness_us: u32,
        /// Root mean square over the last second, to 6 %; older firmware does not tell.
        #[serde(skip_serializing_if = "Option::is_none")]
        rms_lateness_us: Option<f32>,
        /// Ticks in which a limit acted.
        limited_ticks: u32,
        /// Of the supervisor.
        state: String,
        /// Asked for.
        target_mv: i32,
        /// Put across the spring.
        applied_mv: i32,
        /// Estimated.
        stiffness_mv: i32,
    },
    /// `done ticks=.. ..`: an emulated run is over.
    Done(Done),
    /// `dropped events=..`: so many lines since the last are missing, because they came too fast.
    Dropped {
        /// How many.
        events: u32,
    },
    /// `panic at ..:..`: the program stopped itself.
    Panic {
        /// Source file.
        file: String,
        /// Line in it.
        line: u32,
    },
    /// Anything else.
    Text,
}

/// A start of the firmware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Boot {
    /// Of the firmware.
    pub version: String,
    /// Revision it is built from.
    pub git: String,
    /// What the start comes from.
    pub reset: String,
    /// Code of the fault before it, 0 for none.
    pub last_fault: u8,
    /// Ticks per second.
    pub rate_hz: u32,
    /// Who leads the spring; older firmware does not tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controller: Option<String>,
}

/// End of an emulated run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Done {
    /// All ticks.
    pub ticks: u32,
    /// Ticks that never came.
    pub missed: u32,
    /// Of every DAC code and every estimate.
    #[serde(serialize_with = "hexadecimal")]
    pub digest: u64,
    /// Fewest instructions in a tick.
    pub min: u32,
    /// Instructions of a tick on average.
    pub mean: u32,
    /// Most instructions in a tick.
    pub max: u32,
}

/// JSON numbers do not hold 64 bits everywhere.
fn hexadecimal<S: Serializer>(digest: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{digest:016x}"))
}

impl Event {
    /// The event of a line, from the fragments of its format string and the text that each became.
    pub(super) fn of(fragments: &[Fragment<'_>], shown: impl Iterator<Item = String>) -> Self {
        Values::new(fragments, shown).and_then(|values| values.event()).unwrap_or(Self::Text)
    }

    /// The word that JSON and CSV call it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Boot(_) => "boot",
            Self::State { .. } => "state",
            Self::Fault { .. } => "fault",
            Self::Limit { .. } => "limit",
            Self::Summary { .. } => "summary",
            Self::Done(_) => "done",
            Self::Dropped { .. } => "dropped",
            Self::Panic { .. } => "panic",
            Self::Text => "text",
        }
    }
}

/// The values of a line, under the words before them.
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
    fn older_firmware_does_not_tell_its_controller() {
        let format = "boot version={=str} git={=str} reset={=str} last_fault={=u8} rate_hz={=u32}";
        let values = ["0.1.0", "36094dc", "power-on", "0", "1000", "fast"];
        let controller = |event| if let Event::Boot(boot) = event { boot.controller } else { panic!("{event:?}") };
        assert_eq!(controller(event(format, &values[..5])), None);
        let newer = format!("{format} controller={{=str}}");
        assert_eq!(controller(event(&newer, &values)).as_deref(), Some("fast"));
    }

    #[test]
    fn a_panic_has_a_place() {
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
