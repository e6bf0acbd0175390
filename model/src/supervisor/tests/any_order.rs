//! Random inputs in random order.

use super::*;
use proptest::prelude::*;

fn any_inputs() -> impl Strategy<Value = Inputs> {
    let command = prop_oneof![
        6 => Just(None), 3 => Just(Some(Command::Arm)), 1 => Just(Some(Command::Disarm))
    ];
    let supply = prop_oneof![3 => Just(None), 2 => Just(Some(3300)), 1 => any::<u16>().prop_map(Some)];
    let monitors = prop_oneof![3 => Just(None), 1 => (any::<i32>(), any::<i32>(), supply).prop_map(Some)];
    let faults = prop_oneof![30 => Just(0), 1 => (0..Fault::ALL.len()).prop_map(|i| 1 << i), 1 => any::<u16>()];
    let faults = faults.prop_map(Faults::from_bits);
    (command, any::<i32>(), prop_oneof![0..1000u32, any::<u32>()], 0..20u8, 0..40u32, monitors, faults).prop_map(
        |(command, target, ticks_since_host, interlock, missed, monitors, faults)| Inputs {
            command,
            target: Volts(Signal::from_bits(target)),
            ticks_since_host,
            interlock_closed: interlock > 0,
            missed_ticks: missed.saturating_sub(37),
            monitors: monitors.map(|(v, current, supply_mv)| Monitors {
                voltage: Volts(Signal::from_bits(v)),
                current_ua: current >> 12,
                supply_mv,
            }),
            faults,
        },
    )
}

proptest! {
    /// The output is enabled only in `Armed`, never with the interlock open or a fault reported; `Armed` is entered
    /// only from `Disarmed` by an arm command; while the amplifier holds a voltage nothing is armed or acknowledged;
    /// and a standing fault goes alone, by a disarm, while the state shows it and its cause is gone.
    #[test]
    fn no_order_of_events_enables_the_output_outside_armed(events in prop::collection::vec(any_inputs(), 1..400)) {
        let mut supervisor = Supervisor::new(config(), None);
        for inputs in events {
            let (before, stood) = (supervisor.state(), supervisor.standing());
            let (decision, drive) = tick(&mut supervisor, inputs);
            let armed = supervisor.state() == State::Armed;
            let live = inputs.monitors.is_some_and(|it| {
                let supply = it.supply_mv.is_none_or(|mv| (3135..=3465).contains(&mv));
                it.voltage > volts(35.0) || it.current_ua.abs() > 2000 || !supply
            });
            prop_assert_eq!(drive.enabled(), armed);
            prop_assert_eq!(decision == Decision::Rest, !armed);
            prop_assert!(armed || drive == Drive::SAFE);
            prop_assert!(!(armed && (!inputs.interlock_closed || inputs.faults != Faults::NONE)));
            if armed && before != State::Armed {
                prop_assert_eq!((before, inputs.command, live), (State::Disarmed, Some(Command::Arm), false));
            }
            let standing = supervisor.standing();
            match supervisor.state() {
                State::Faulted(shown) => prop_assert_ne!(standing, standing.without(shown)),
                _ => prop_assert_eq!(standing, Faults::NONE),
            }
            for gone in stood.except(standing).iter() {
                let cause = inputs.faults.contains(gone) || (gone == Fault::Interlock && !inputs.interlock_closed);
                prop_assert!(before == State::Faulted(gone) && !cause && !live);
                prop_assert_eq!(inputs.command, Some(Command::Disarm));
                prop_assert_eq!(stood.without(gone).except(standing), Faults::NONE, "no other goes with it");
            }
            prop_assert_eq!(inputs.faults.except(standing), Faults::NONE, "they stand");
        }
    }
}
