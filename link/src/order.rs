//! From a request to what the supervisor is told.
//!
//! | request | not armed | armed | faulted |
//! | --- | --- | --- | --- |
//! | `Set` | refused: not armed | new target, or refused: out of range | refused: faulted |
//! | `Arm` | arm, target 0 V | nothing, the target stays | refused: faulted |
//! | `Disarm` | disarm | disarm | nothing: a fault is acknowledged by name only |
//! | `Acknowledge` | nothing | nothing | disarm if it is this fault, else refused: other fault |
//! | any other | nothing | nothing | nothing |
//!
//! The supervisor may still refuse to arm or to acknowledge, in its own tick; [`Reason::of_refusal`] says it to the host.

use model::supervisor::{Command, Refusal, State};
use model::{Spring, Volts};

use crate::fault::Fault;
use crate::reason::Reason;
use crate::request::Request;

/// What the control tick is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Order {
    /// For the supervisor.
    pub command: Option<Command>,
    /// A new target; `None` keeps the last one.
    pub target: Option<Volts>,
}

impl Order {
    /// What `request` orders in `state`.
    ///
    /// # Errors
    /// The [`Reason`] to refuse it with; then nothing is ordered.
    pub fn new(request: Request, state: State, spring: &Spring) -> Result<Self, Reason> {
        let nothing = Self::default();
        match (request, state) {
            (Request::Set(_) | Request::Arm, State::Faulted(fault)) => Err(Reason::Faulted(fault.into())),
            (Request::Set(_), State::Disarmed) => Err(Reason::NotArmed),
            (Request::Set(desired), State::Armed) => {
                Ok(Self { target: Some(spring.target(desired.into())?), ..nothing })
            }
            (Request::Arm, State::Disarmed) => Ok(Self { command: Some(Command::Arm), target: Some(Volts::ZERO) }),
            // To the supervisor, a disarm is also the acknowledgement of a fault; to the host, it must not be: it may be late.
            (Request::Disarm, State::Disarmed | State::Armed) => Ok(Self { command: Some(Command::Disarm), ..nothing }),
            (Request::Acknowledge(fault), State::Faulted(present)) => match Fault::from(present) {
                present if present == fault => Ok(Self { command: Some(Command::Disarm), ..nothing }),
                present => Err(Reason::OtherFault(present)),
            },
            _ => Ok(nothing),
        }
    }
}

impl Reason {
    /// Why the supervisor did not follow; `fault` is the one that is present, if any.
    pub fn of_refusal(refusal: Refusal, fault: Fault) -> Self {
        match refusal {
            Refusal::Faulted => Self::Faulted(fault),
            Refusal::InterlockOpen => Self::InterlockOpen,
            Refusal::HostSilent => Self::HostSilent,
            Refusal::Live => Self::Live,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::Desired;
    use model::stiffness::{Cantilever, YoungsModulus};
    use model::supervisor::Fault as Cause;

    fn order(request: Request, state: State) -> Result<Order, Reason> {
        Order::new(request, state, &Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap())
    }

    const FAULTED: State = State::Faulted(Cause::Interlock);

    #[test]
    fn a_stiffness_is_set_only_while_armed_and_in_reach() {
        let set = |volts| Request::Set(Desired::ScaledVolts(volts));
        let ordered = Order { command: None, target: Some(Volts::new(300.0).unwrap()) };
        assert_eq!(order(set(300.0), State::Armed), Ok(ordered));
        assert_eq!(order(set(300.0), State::Disarmed), Err(Reason::NotArmed));
        assert_eq!(order(set(300.0), FAULTED), Err(Reason::Faulted(Cause::Interlock.into())));
        for beyond in [-0.1, 700.1, f64::NAN, f64::INFINITY] {
            let reason = Reason::OutOfRange { lowest: 0.0, highest: 700.0 };
            assert_eq!(order(set(beyond), State::Armed), Err(reason), "{beyond}");
        }
    }

    #[test]
    fn arming_starts_at_zero_and_arming_twice_changes_nothing() {
        let ordered = Order { command: Some(Command::Arm), target: Some(Volts::ZERO) };
        assert_eq!(order(Request::Arm, State::Disarmed), Ok(ordered));
        assert_eq!(order(Request::Arm, State::Armed), Ok(Order::default()));
        assert_eq!(order(Request::Arm, FAULTED), Err(Reason::Faulted(Cause::Interlock.into())));
    }

    #[test]
    fn only_the_present_fault_can_be_acknowledged_and_disarm_does_not() {
        let disarm = Order { command: Some(Command::Disarm), target: None };
        assert_eq!(order(Request::Acknowledge(Cause::Interlock.into()), FAULTED), Ok(disarm));
        let other = Err(Reason::OtherFault(Cause::Interlock.into()));
        assert_eq!(order(Request::Acknowledge(Cause::Panic.into()), FAULTED), other);
        assert_eq!(order(Request::Acknowledge(Cause::Panic.into()), State::Armed), Ok(Order::default()));
        assert_eq!(order(Request::Disarm, FAULTED), Ok(Order::default()));
        assert_eq!(order(Request::Disarm, State::Armed), Ok(disarm));
    }
}
