//! Hand-over between the host's task and the control tick: at most one command in one direction, the view of the last tick in
//! the other.
//!
//! Each tick empties the mailbox, independently of the host's task.

use link::{Command, Fault, View};
use model::supervisor::State;

/// The mailbox.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mailbox {
    heard: bool,
    /// The command, and the fault that was present when it was created.
    command: Option<(Command, Fault)>,
    view: Option<View>,
}

impl Mailbox {
    /// A mailbox without a command, before the first tick.
    pub const EMPTY: Self = Self { heard: false, command: None, view: None };

    /// Reports that the host was heard.
    pub fn hear(&mut self) {
        self.heard = true;
    }

    /// Stores `command`, which was created in `state`, for the next tick.
    pub fn put(&mut self, command: Command, state: State) {
        self.heard |= command.heard;
        self.command = Some((command, Fault::of(state)));
    }

    /// Empties the mailbox for a tick that begins in `state`. The second value is true if it contained a command.
    ///
    /// A command is dropped if a fault has occurred or was acknowledged since it was created: to the supervisor a disarm is
    /// also the acknowledgement of a fault, and no fault may be acknowledged that the host did not know of.
    pub fn take(&mut self, state: State) -> (Command, bool) {
        let stored = self.command.take();
        let valid = stored.filter(|(_, fault)| *fault == Fault::of(state));
        let command = valid.map_or(Command::default(), |(command, _)| command);
        (Command { heard: core::mem::take(&mut self.heard), ..command }, stored.is_some())
    }

    /// View of the last tick; `None` before the first one.
    pub fn view(&self) -> Option<View> {
        self.view
    }

    /// Stores the view of a tick.
    pub fn show(&mut self, view: View) {
        self.view = Some(view);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Control, Sensors, Untimed};
    use crate::settings::{SETTINGS, SUPERVISION};
    use link::Telemetry;
    use model::supervisor::{self, Faults};

    const DISARM: Command = Command { heard: true, arming: Some(supervisor::Command::Disarm), target: None };
    const ARM: Command =
        Command { heard: true, arming: Some(supervisor::Command::Arm), target: Some(model::Volts::ZERO) };
    const INTERLOCK: State = State::Faulted(supervisor::Fault::Interlock);

    #[test]
    fn a_command_is_dropped_if_a_fault_occurred_or_was_acknowledged_since() {
        let monitor = State::Faulted(supervisor::Fault::Monitor);
        for (created_in, taken_in, kept) in [
            (State::Armed, State::Armed, true),
            (State::Armed, State::Disarmed, true),
            (State::Armed, INTERLOCK, false),
            (State::Disarmed, INTERLOCK, false),
            (INTERLOCK, INTERLOCK, true),
            (INTERLOCK, monitor, false),
            (INTERLOCK, State::Disarmed, false),
        ] {
            let mut mailbox = Mailbox::EMPTY;
            mailbox.put(DISARM, created_in);
            let expected = if kept { DISARM } else { Command { heard: true, ..Command::default() } };
            assert_eq!(mailbox.take(taken_in), (expected, true), "{created_in:?} {taken_in:?}");
        }
    }

    #[test]
    fn a_disarm_from_before_a_fault_does_not_acknowledge_it() {
        let mut control = Control::new(&SETTINGS, &SUPERVISION, None).unwrap();
        let mut mailbox = Mailbox::EMPTY;
        let mut tick = |command: Option<(Command, State)>, interlock_closed: bool| {
            mailbox.hear();
            if let Some((command, created_in)) = command {
                mailbox.put(command, created_in);
            }
            let (command, _) = mailbox.take(control.supervisor().state());
            control.tick(&command, &Sensors { interlock_closed, ..Sensors::default() }, &mut Untimed);
            control.supervisor().state()
        };
        assert_eq!(tick(Some((ARM, State::Disarmed)), true), State::Armed);
        assert_eq!(tick(None, false), INTERLOCK);
        assert_eq!(tick(Some((DISARM, State::Armed)), true), INTERLOCK, "created before the fault");
        assert_eq!(tick(Some((DISARM, INTERLOCK)), true), State::Disarmed, "the acknowledgement");
    }

    #[test]
    fn a_command_is_taken_once() {
        let mut mailbox = Mailbox::EMPTY;
        mailbox.hear();
        mailbox.put(Command { heard: false, ..ARM }, State::Disarmed);
        assert_eq!(mailbox.take(State::Disarmed), (ARM, true));
        assert_eq!(mailbox.take(State::Disarmed), (Command::default(), false));
    }

    #[test]
    fn the_view_is_that_of_the_last_tick_and_absent_before_the_first() {
        let mut mailbox = Mailbox::EMPTY;
        assert_eq!(mailbox.view(), None);
        for overruns in [3, 4] {
            let view = View {
                sample: Telemetry::default(),
                state: State::Disarmed,
                standing: Faults::default(),
                refusal: None,
                overruns,
            };
            mailbox.show(view);
            assert_eq!(mailbox.view(), Some(view));
            assert_eq!(mailbox.take(State::Disarmed), (Command::default(), false), "a view is no command");
        }
    }
}
