//! Keys in, orders out. Space disarms in every mode; Ctrl-C and `q` disarm and end.

use link::Desired;
use link_host::desired;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::message::Order;
use super::view::{View, WINDOWS_S};

/// Small and large step of the target, in V.
const STEPS_V: [f64; 2] = [10.0, 100.0];
/// Longest text of a target.
const LONGEST: usize = 24;

/// The keys with what they do, for the help.
pub(super) const KEYS: [(&str, &str); 12] = [
    ("space", "STOP: disarm immediately, in every mode"),
    ("a", "arm; the target starts at 0 V"),
    ("s, digits", "set the target: V, or with a unit as 1.5e9Pa, 0.25N/m"),
    ("up, down", "step the target by 10 V"),
    ("page up, down", "step the target by 100 V"),
    ("p", "play the schedule, or stop it; the target stays"),
    ("r", "begin a recording, or close it"),
    ("k", "acknowledge the fault that is shown"),
    ("+, -", "plot a longer or a shorter time"),
    ("?", "this help"),
    ("Esc", "close help or input"),
    ("q, Ctrl-C", "disarm, close the recording, end"),
];

impl View {
    /// Takes a key; returns what is to be done on the MCU.
    pub fn on_key(&mut self, key: KeyEvent) -> Option<Order> {
        let is_ctrl_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
        if is_ctrl_c {
            return self.quit();
        }
        if key.code == KeyCode::Char(' ') {
            (self.prompt, self.ordered_v) = (None, None);
            return Some(Order::Disarm);
        }
        if self.shows_help {
            self.shows_help = false;
            return None;
        }
        match self.prompt.take() {
            Some(text) => self.on_prompt(text, key.code),
            None => self.on_command(key.code),
        }
    }

    /// Ends the program, the MCU disarmed.
    pub fn quit(&mut self) -> Option<Order> {
        self.is_ending = true;
        Some(Order::Quit)
    }

    fn on_command(&mut self, code: KeyCode) -> Option<Order> {
        match code {
            KeyCode::Char('q') => return self.quit(),
            KeyCode::Char('a') => return Some(Order::Arm),
            KeyCode::Char('p') => return Some(Order::Play),
            KeyCode::Char('r') => return Some(Order::Record),
            KeyCode::Char('k') if self.fault().is_some() => return Some(Order::Acknowledge),
            KeyCode::Char('k') => self.note("no fault stands", false),
            KeyCode::Up => return self.step(STEPS_V[0]),
            KeyCode::Down => return self.step(-STEPS_V[0]),
            KeyCode::PageUp => return self.step(STEPS_V[1]),
            KeyCode::PageDown => return self.step(-STEPS_V[1]),
            KeyCode::Char('s') => self.prompt = Some(String::new()),
            KeyCode::Char(digit @ ('0'..='9' | '.')) => self.prompt = Some(digit.to_string()),
            KeyCode::Char('+' | '=') => self.window = (self.window + 1).min(WINDOWS_S.len() - 1),
            KeyCode::Char('-') => self.window = self.window.saturating_sub(1),
            KeyCode::Char('?' | 'h') | KeyCode::F(1) => self.shows_help = true,
            _ => {}
        }
        None
    }

    fn on_prompt(&mut self, mut text: String, code: KeyCode) -> Option<Order> {
        match code {
            KeyCode::Esc => return None,
            KeyCode::Enter => match desired(&text) {
                Ok(desired) => {
                    self.ordered_v = if let Desired::ScaledVolts(volts) = desired { Some(volts) } else { None };
                    return Some(Order::Set(desired));
                }
                Err(error) => self.note(&error.to_string(), true),
            },
            KeyCode::Backspace => {
                text.pop();
                self.prompt = Some(text);
            }
            KeyCode::Char(letter) if text.len() < LONGEST => self.prompt = Some(text + letter.encode_utf8(&mut [0; 4])),
            _ => self.prompt = Some(text),
        }
        None
    }

    fn step(&mut self, by_v: f64) -> Option<Order> {
        if !self.is_armed() {
            self.note("not armed: the target can be stepped once the MCU is armed (a)", true);
            return None;
        }
        let from_v = self.ordered_v.unwrap_or(self.sample.target.to_f64());
        let (lowest_v, highest_v) = (self.status.lowest.to_f64(), self.status.highest.to_f64());
        let to_v = (from_v + by_v).max(lowest_v).min(highest_v);
        self.ordered_v = Some(to_v);
        Some(Order::Set(Desired::ScaledVolts(to_v)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::{Fault, State, Status, Telemetry, WireVolts};

    fn view(state: State, target_v: i32) -> View {
        let sample = Telemetry { state, target: WireVolts(target_v << 20), ..Telemetry::default() };
        let fault = if state == State::Faulted { Fault(4) } else { Fault::NONE };
        View::new("p", "stair", Status { sample, fault, highest: WireVolts(700 << 20), ..Status::default() })
    }

    fn press(view: &mut View, code: KeyCode) -> Option<Order> {
        view.on_key(KeyEvent::from(code))
    }

    fn type_in(view: &mut View, text: &str) {
        for letter in text.chars() {
            assert_eq!(press(view, KeyCode::Char(letter)), None, "{letter}");
        }
    }

    #[test]
    fn space_stops_in_every_mode() {
        let mut armed = view(State::Armed, 100);
        for keys in ["", "?", "s", "12"] {
            type_in(&mut armed, keys);
            assert_eq!(press(&mut armed, KeyCode::Char(' ')), Some(Order::Disarm), "{keys}");
            assert_eq!(armed.prompt, None, "{keys}");
            armed.shows_help = false;
        }
        for state in [State::Disarmed, State::Faulted] {
            assert_eq!(press(&mut view(state, 0), KeyCode::Char(' ')), Some(Order::Disarm));
        }
    }

    #[test]
    fn q_and_ctrl_c_end_and_q_in_an_input_does_not() {
        for key in [KeyEvent::from(KeyCode::Char('q')), KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL)] {
            let mut view = view(State::Armed, 0);
            assert_eq!(view.on_key(key), Some(Order::Quit));
            assert!(view.is_ending);
        }
        let mut typing = view(State::Armed, 0);
        type_in(&mut typing, "sq");
        assert_eq!((typing.prompt.as_deref(), typing.is_ending), (Some("q"), false));
        assert_eq!(typing.on_key(KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL)), Some(Order::Quit));
    }

    #[test]
    fn a_target_is_typed_with_or_without_a_unit() {
        for (text, expected) in [
            ("300", Some(Desired::ScaledVolts(300.0))),
            ("12.5V", Some(Desired::ScaledVolts(12.5))),
            ("1.5e9Pa", Some(Desired::Pascal(1.5e9))),
            ("0.25N/m", Some(Desired::NewtonPerMetre(0.25))),
            ("", None),
            ("3kV", None),
            ("1e999", None),
            ("e", None),
        ] {
            let mut view = view(State::Armed, 0);
            type_in(&mut view, "s");
            type_in(&mut view, text);
            assert_eq!(press(&mut view, KeyCode::Enter), expected.map(Order::Set), "{text}");
            assert_eq!((view.prompt.is_some(), view.note.is_some()), (false, expected.is_none()), "{text}");
        }
        let mut view = view(State::Armed, 0);
        type_in(&mut view, "45");
        press(&mut view, KeyCode::Backspace);
        assert_eq!(view.prompt.as_deref(), Some("4"));
        assert_eq!((press(&mut view, KeyCode::Esc), view.prompt), (None, None));
    }

    #[test]
    fn steps_add_up_before_a_sample_shows_them_and_stay_in_range() {
        let mut armed = view(State::Armed, 300);
        let set = |volts| Some(Order::Set(Desired::ScaledVolts(volts)));
        assert_eq!(press(&mut armed, KeyCode::Up), set(310.0));
        assert_eq!(press(&mut armed, KeyCode::PageUp), set(410.0));
        assert_eq!(press(&mut armed, KeyCode::Down), set(400.0));
        for expected in [500.0, 600.0, 700.0, 700.0] {
            assert_eq!(press(&mut armed, KeyCode::PageUp), set(expected));
        }
        let mut disarmed = view(State::Disarmed, 0);
        assert_eq!(press(&mut disarmed, KeyCode::Up), None);
        assert!(disarmed.note.unwrap().text.contains("not armed"));
    }

    #[test]
    fn a_fault_is_acknowledged_only_if_one_stands() {
        assert_eq!(press(&mut view(State::Faulted, 0), KeyCode::Char('k')), Some(Order::Acknowledge));
        assert_eq!(press(&mut view(State::Disarmed, 0), KeyCode::Char('k')), None);
    }

    #[test]
    fn the_plots_have_a_longest_and_a_shortest_time() {
        let mut view = view(State::Disarmed, 0);
        for (key, windows) in [('+', [60.0, 120.0, 300.0, 300.0, 300.0]), ('-', [120.0, 60.0, 30.0, 10.0, 10.0])] {
            for window_s in windows {
                press(&mut view, KeyCode::Char(key));
                assert_eq!(view.window_s(), window_s, "{key}");
            }
        }
    }
}
