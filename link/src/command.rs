//! Conversion of a request into a command for the control tick.
//!
//! | request | disarmed | armed | faulted |
//! | --- | --- | --- | --- |
//! | `Set` | rejected: not armed | new target, or rejected: out of range | rejected: faulted |
//! | `Arm` | arm, target 0 V | no change, the target stays | rejected: faulted |
//! | `Disarm` | disarm | disarm | no change: only `Acknowledge` acknowledges a fault |
//! | `Acknowledge` | no change | no change | disarm if it names the shown fault, else rejected: other fault |
//! | any other | no change | no change | no change |
//!
//! Of several standing faults the state shows one, and the next one once that is acknowledged. The supervisor can still
//! refuse to arm or to acknowledge within its own tick; [`Reason::of_refusal`] translates that.

use model::supervisor::{self, Refusal, State};
use model::{Spring, Volts};

use crate::fault::Fault;
use crate::reason::Reason;
use crate::request::Request;

/// Input of one control tick from the host; the default value means that nothing was received.
///
/// The same type is used from the [`Server`](crate::Server) through the firmware's mailbox to the control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// True if a request that ends the host's silence has been accepted since the last tick; a repeated one does not end it.
    pub heard: bool,
    /// Transition that the supervisor is to make. In the faulted state, `Disarm` acknowledges the fault.
    pub arming: Option<supervisor::Command>,
    /// New target, as equivalent static voltage; `None` keeps the previous one.
    pub target: Option<Volts>,
}

impl Command {
    /// The command that corresponds to `request` in `state`, with `heard` false.
    ///
    /// # Errors
    /// The [`Reason`] for rejecting the request.
    pub fn new(request: Request, state: State, spring: &Spring) -> Result<Self, Reason> {
        let no_change = Self::default();
        let disarm = Self { arming: Some(supervisor::Command::Disarm), ..no_change };
        match (request, state) {
            (Request::Set(_) | Request::Arm, State::Faulted(fault)) => Err(Reason::Faulted(fault.into())),
            (Request::Set(_), State::Disarmed) => Err(Reason::NotArmed),
            (Request::Set(desired), State::Armed) => {
                Ok(Self { target: Some(spring.target(desired.into())?), ..no_change })
            }
            (Request::Arm, State::Disarmed) => {
                Ok(Self { arming: Some(supervisor::Command::Arm), target: Some(Volts::ZERO), ..no_change })
            }
            // The supervisor also takes a disarm as the acknowledgement of a fault. The host's Disarm must not be one: it may
            // have been sent before the fault.
            (Request::Disarm, State::Disarmed | State::Armed) => Ok(disarm),
            (Request::Acknowledge(fault), State::Faulted(present)) => match Fault::from(present) {
                present if present == fault => Ok(disarm),
                present => Err(Reason::OtherFault(present)),
            },
            _ => Ok(no_change),
        }
    }
}

impl Reason {
    /// The reason to report for a `refusal` of the supervisor; `fault` is the present fault or [`Fault::NONE`].
    pub fn of_refusal(refusal: Refusal, fault: Fault) -> Self {
        match refusal {
            Refusal::Faulted => Self::Faulted(fault),
            Refusal::InterlockOpen => Self::InterlockOpen,
            Refusal::HostSilent => Self::HostSilent,
            Refusal::Live => Self::Live,
            Refusal::CausePresent => Self::CausePresent(fault),
            Refusal::Reference => Self::Reference,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::Desired;
    use model::stiffness::{Cantilever, YoungsModulus};
    use model::supervisor::Fault as Cause;

    fn command(request: Request, state: State) -> Result<Command, Reason> {
        Command::new(request, state, &Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap())
    }

    const FAULTED: State = State::Faulted(Cause::Interlock);

    #[test]
    fn set_is_accepted_only_while_armed_and_within_range() {
        let set = |volts| Request::Set(Desired::ScaledVolts(volts));
        let expected = Command { target: Some(Volts::new(300.0).unwrap()), ..Command::default() };
        assert_eq!(command(set(300.0), State::Armed), Ok(expected));
        assert_eq!(command(set(300.0), State::Disarmed), Err(Reason::NotArmed));
        assert_eq!(command(set(300.0), FAULTED), Err(Reason::Faulted(Cause::Interlock.into())));
        for outside in [-0.1, 700.1, f64::NAN, f64::INFINITY] {
            let reason = Reason::OutOfRange { lowest: 0.0, highest: 700.0 };
            assert_eq!(command(set(outside), State::Armed), Err(reason), "{outside}");
        }
    }

    #[test]
    fn arm_starts_at_zero_volts_and_changes_nothing_while_armed() {
        let arm = Command { arming: Some(supervisor::Command::Arm), target: Some(Volts::ZERO), ..Command::default() };
        assert_eq!(command(Request::Arm, State::Disarmed), Ok(arm));
        assert_eq!(command(Request::Arm, State::Armed), Ok(Command::default()));
        assert_eq!(command(Request::Arm, FAULTED), Err(Reason::Faulted(Cause::Interlock.into())));
    }

    #[test]
    fn only_acknowledge_with_the_present_fault_acknowledges_it() {
        let disarm = Command { arming: Some(supervisor::Command::Disarm), ..Command::default() };
        assert_eq!(command(Request::Acknowledge(Cause::Interlock.into()), FAULTED), Ok(disarm));
        let other = Err(Reason::OtherFault(Cause::Interlock.into()));
        assert_eq!(command(Request::Acknowledge(Cause::Panic.into()), FAULTED), other);
        assert_eq!(command(Request::Acknowledge(Cause::Panic.into()), State::Armed), Ok(Command::default()));
        assert_eq!(command(Request::Disarm, FAULTED), Ok(Command::default()));
        assert_eq!(command(Request::Disarm, State::Armed), Ok(disarm));
    }
}
