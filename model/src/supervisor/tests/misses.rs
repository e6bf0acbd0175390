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

    let mut supervisor = armed();
    tick(&mut supervisor, miss(u32::MAX));
    assert_eq!(supervisor.state(), State::Faulted(Fault::Overrun));
    tick(&mut supervisor, disarm());
    tick(&mut supervisor, arm());
    tick(&mut supervisor, good());
    assert_eq!(supervisor.state(), State::Armed, "missed ticks before the acknowledgement do not count");
}
