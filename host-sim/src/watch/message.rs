//! What the worker reports to the screen, and what the screen orders.

use link::{AdaptationReport, Desired, FaultReport, IsolationReport, Status, Telemetry};

/// What happened on the link.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// An MCU has answered; its status.
    Connected(Status),
    /// The connection is lost, or a new attempt has failed; the reason. Further attempts follow.
    Lost(String),
    /// The latest status.
    Status(Status),
    /// Samples in the order of their ticks, at `host_s` seconds of the host's clock since the start.
    Samples {
        /// Time on the host's clock, in s.
        host_s: f64,
        /// The samples.
        samples: Vec<Telemetry>,
    },
    /// What the isolation bank says.
    Isolation(IsolationReport),
    /// What the adaptation does.
    Adaptation(AdaptationReport),
    /// The MCU has reported faults.
    Faults(FaultReport),
    /// An order was carried out; what it did.
    Done(String),
    /// An order was refused, or something else went wrong; the reason.
    Failed(String),
    /// Progress of the schedule; `None` once it does not play any more.
    Playing(Option<Playing>),
    /// Progress of the recording; `None` once it is closed.
    Recording(Option<Progress>),
}

/// Progress of the schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playing {
    /// Time since the schedule's start, in s.
    pub elapsed_s: f64,
    /// Length of the schedule, in s.
    pub length_s: f64,
}

/// Progress of the recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Name of the file.
    pub file: String,
    /// Number of rows so far.
    pub rows: u64,
    /// Number of samples that are missing.
    pub lost: u64,
}

/// What the worker is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Enable the output.
    Arm,
    /// Disable the output. It goes ahead of all other orders, and is repeated after a reconnection if it could not be sent.
    Disarm,
    /// Set the desired stiffness; a schedule that plays ends.
    Set(Desired),
    /// Acknowledge the fault that the MCU shows.
    Acknowledge,
    /// Play the schedule from its beginning, or stop it if it plays.
    Play,
    /// Begin a recording, or close the one that runs.
    Record,
    /// Disarm, close the recording and end.
    Quit,
}

impl Order {
    /// Removes from waiting orders what a disarm among them makes void: a disarm comes first, and nothing that came before it
    /// can raise the voltage after it. Recordings and the end stay.
    pub(super) fn by_urgency(orders: Vec<Self>) -> Vec<Self> {
        let Some(last) = orders.iter().rposition(|order| *order == Self::Disarm) else { return orders };
        let kept = |(index, order): (usize, Self)| {
            let stays = index > last || matches!(order, Self::Record | Self::Quit);
            (stays && order != Self::Disarm).then_some(order)
        };
        [Self::Disarm].into_iter().chain(orders.into_iter().enumerate().filter_map(kept)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disarm_goes_ahead_and_cancels_what_waited_before_it() {
        use Order::{Arm, Disarm, Play, Quit, Record, Set};
        let set = Set(Desired::ScaledVolts(300.0));
        assert_eq!(Order::by_urgency(vec![Arm, set]), [Arm, set]);
        assert_eq!(Order::by_urgency(vec![Arm, Record, set, Disarm, Disarm, Arm]), [Disarm, Record, Arm]);
        assert_eq!(Order::by_urgency(vec![Play, Quit, Disarm]), [Disarm, Quit]);
    }
}
