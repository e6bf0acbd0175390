//! Missed ticks.

use super::*;

#[test]
fn five_missed_ticks_are_tolerated_and_forgotten_six_are_a_fault() {
    let miss = |missed_ticks| Inputs { missed_ticks, ..good() };
    let mut supervisor = armed();
    tick(&mut supervisor, miss(5));
    assert_eq!(supervisor.state(), State::Armed);
    tick(&mut supervisor, miss(1));
    assert_eq!(supervisor.state(), State::Faulted(Fault::Overrun));

    let mut supervisor = armed();
    for _ in 0..50 {
        tick(&mut supervisor, miss(1));
        for _ in 0..999 {
            tick(&mut supervisor, good());
        }
    }
    assert_eq!(supervisor.state(), State::Armed, "one per second is tolerated for ever");

    // Each counts for 1000 ticks: 4 294 968 of them for 704 more than 32 bits hold.
    for missed in [u32::MAX, 4_294_968] {
        let mut supervisor = armed();
        tick(&mut supervisor, miss(missed));
        assert_eq!(supervisor.state(), State::Faulted(Fault::Overrun), "{missed}");
        tick(&mut supervisor, disarm());
        tick(&mut supervisor, arm());
        tick(&mut supervisor, good());
        assert_eq!(supervisor.state(), State::Armed, "missed ticks before the acknowledgement do not count");
    }
}

#[test]
fn an_overrun_is_acknowledged_after_a_second_without_a_missed_tick() {
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { missed_ticks: 6, ..good() });
    tick(&mut supervisor, Inputs { missed_ticks: 1000, ..good() });
    for _ in 0..998 {
        tick(&mut supervisor, good());
    }
    tick(&mut supervisor, disarm());
    assert_eq!(supervisor.refusal(), Some(Refusal::CausePresent), "999 ticks after the last missed one");
    tick(&mut supervisor, disarm());
    assert_eq!((supervisor.state(), supervisor.refusal()), (State::Disarmed, None));
}

#[test]
fn ticks_missed_before_arming_do_not_count() {
    let mut supervisor = Supervisor::new(config(), None);
    tick(&mut supervisor, Inputs { missed_ticks: 100, ..good() });
    tick(&mut supervisor, arm());
    tick(&mut supervisor, Inputs { missed_ticks: 5, ..good() });
    assert_eq!(supervisor.state(), State::Armed);
}
