//! What lies between the host's task and the control tick: at most one order, a sign of life, and the view of the last tick.
//!
//! Pure; [`crate::RATE_HZ`] times a second the tick empties it, whatever the host's task does meanwhile.

use link::{Order, View};
use model::supervisor::State;

use crate::control::Orders;

/// An order, and the state in which it was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Letter {
    /// What is to be done.
    pub order: Order,
    /// What its author knew.
    pub made_in: State,
}

impl Letter {
    /// What a tick that begins in `now` is to do about it: nothing if a fault came or went since it was written. To the
    /// supervisor a disarm also acknowledges a fault, and nobody may acknowledge what he does not know of.
    pub fn open(&self, now: State) -> Order {
        let fault = link::Fault::of;
        if fault(self.made_in) == fault(now) { self.order } else { Order::default() }
    }
}

/// The mailbox.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Post {
    heard: bool,
    letter: Option<Letter>,
    view: Option<View>,
}

impl Post {
    /// Empty, and no tick has run.
    pub const EMPTY: Self = Self { heard: false, letter: None, view: None };

    /// The host was heard.
    pub fn hear(&mut self, heard: bool) {
        self.heard |= heard;
    }

    /// Puts an order in.
    pub fn put(&mut self, letter: Letter) {
        self.letter = Some(letter);
    }

    /// Takes all out, for a tick that begins in `now`. True if there was an order, followed or not.
    pub fn take(&mut self, now: State) -> (Orders, bool) {
        let letter = self.letter.take();
        let order = letter.map_or(Order::default(), |letter| letter.open(now));
        let heard = core::mem::take(&mut self.heard);
        (Orders { heard, command: order.command, target: order.target }, letter.is_some())
    }

    /// What the last tick showed; `None` before the first one.
    pub fn view(&self) -> Option<View> {
        self.view
    }

    /// Shows a tick.
    pub fn show(&mut self, view: View) {
        self.view = Some(view);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Control, Senses, Untimed};
    use crate::settings::{SETTINGS, SUPERVISION};
    use model::supervisor::{Command, Fault};

    const DISARM: Order = Order { command: Some(Command::Disarm), target: None };
    const ARM: Order = Order { command: Some(Command::Arm), target: Some(model::Volts::ZERO) };

    #[test]
    fn an_order_from_before_a_fault_is_dropped() {
        let (one, other) = (State::Faulted(Fault::Interlock), State::Faulted(Fault::Monitor));
        for (made_in, now, followed) in [
            (State::Armed, State::Armed, true),
            (State::Armed, State::Disarmed, true),
            (State::Armed, one, false),
            (State::Disarmed, one, false),
            (one, one, true),
            (one, other, false),
            (one, State::Disarmed, false),
        ] {
            let order = Letter { order: DISARM, made_in }.open(now);
            assert_eq!(order, if followed { DISARM } else { Order::default() }, "{made_in:?} {now:?}");
        }
    }

    #[test]
    fn a_late_disarm_does_not_acknowledge() {
        let mut control = Control::new(&SETTINGS, &SUPERVISION, None).unwrap();
        let mut post = Post::EMPTY;
        let mut tick = |order: Option<(Order, State)>, interlock_closed: bool| {
            post.hear(true);
            if let Some((order, made_in)) = order {
                post.put(Letter { order, made_in });
            }
            let (orders, _) = post.take(control.supervisor().state());
            control.tick(&orders, &Senses { interlock_closed, ..Senses::default() }, &mut Untimed);
            control.supervisor().state()
        };
        let faulted = State::Faulted(Fault::Interlock);
        assert_eq!(tick(Some((ARM, State::Disarmed)), true), State::Armed);
        assert_eq!(tick(None, false), faulted);
        assert_eq!(tick(Some((DISARM, State::Armed)), true), faulted, "made before the fault");
        assert_eq!(tick(Some((DISARM, faulted)), true), State::Disarmed, "the acknowledgement");
    }

    #[test]
    fn everything_is_taken_once() {
        let mut post = Post::EMPTY;
        post.hear(true);
        post.hear(false);
        post.put(Letter { order: ARM, made_in: State::Disarmed });
        let (orders, ordered) = post.take(State::Disarmed);
        assert!(orders.heard && ordered && orders.command == Some(Command::Arm));
        assert_eq!(post.take(State::Disarmed), (Orders::default(), false));
    }
}
