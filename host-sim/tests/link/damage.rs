//! Damage on a real byte stream.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use host_sim::link::{Client, Patience, Port};
use link::{Desired, Frame, Request, Sequence};
use proptest::test_runner::{RngAlgorithm, TestRng};

use crate::mcu::{Mcu, Setup};

fn greet(mcu: &Mcu) -> Client {
    let port = Port::open(&mcu.port, 115_200).unwrap();
    Client::greet(port, Patience { each: Duration::from_millis(20), tries: 100 }).unwrap().0
}

/// One byte in 60 is wrong in both directions: most answers and many requests are lost, and asked for again.
fn every_order_is_applied_once_and_in_order(mcu: &Mcu) {
    let mut client = greet(mcu);
    client.order(Request::Arm).unwrap();
    let orders: Vec<Request> = (0..150).map(|volts| Request::Set(Desired::ScaledVolts(f64::from(volts)))).collect();
    for order in &orders {
        let (_, target) = client.order(*order).unwrap();
        assert_eq!(Request::Set(Desired::ScaledVolts(target.to_f64())), *order, "an answer to something else");
    }
    let applied = mcu.with(|shared| shared.applied.clone());
    let sets: Vec<Request> = applied.into_iter().filter(|request| matches!(request, Request::Set(_))).collect();
    assert_eq!(sets, orders);
    let counters = mcu.with(|shared| shared.counters);
    assert!(counters.damaged > 10 && counters.repeated > 10, "{counters:?}");
}

#[test]
fn on_a_bad_socket_every_order_is_applied_once() {
    every_order_is_applied_once_and_in_order(&Mcu::on_socket(Setup { damage_one_in: Some(60), ..Setup::default() }));
}

#[test]
fn on_a_bad_terminal_every_order_is_applied_once() {
    every_order_is_applied_once_and_in_order(&Mcu::on_terminal(Setup { damage_one_in: Some(60), ..Setup::default() }));
}

/// 10 000 frames, each flipped, cut short, spliced or followed by garbage, as fast as the socket takes them.
#[test]
fn ten_thousand_damaged_frames_over_a_socket_apply_nothing_that_was_not_sent() {
    let mcu = Mcu::on_socket(Setup::default());
    let mut stream = UnixStream::connect(mcu.port.strip_prefix("unix:").unwrap()).unwrap();
    let mut drain = stream.try_clone().unwrap();
    let drained = std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while drain.read(&mut buffer).is_ok_and(|count| count > 0) {}
    });
    let mut rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[3; 32]);
    let mut random = move |below: usize| -> usize {
        use proptest::prelude::Rng;
        (rng.next_u64() % below as u64) as usize
    };
    stream.write_all(Frame::new(Sequence(0), &Request::Hello).as_bytes()).unwrap();
    let sent = |number: u16| Request::Set(Desired::Pascal(1.4e9 + f64::from(number)));
    for number in 1..=10_000 {
        let mut bytes = Frame::new(Sequence(number), &sent(number)).as_bytes().to_vec();
        let at = random(bytes.len());
        match random(4) {
            0 => bytes[at] ^= 1 << random(8),
            1 => bytes.truncate(at),
            2 => {
                let other = Frame::new(Sequence(number + 1), &sent(number + 1));
                bytes.truncate(at);
                bytes.extend_from_slice(&other.as_bytes()[random(other.as_bytes().len())..]);
            }
            _ => (0..random(60)).for_each(|_| bytes.insert(at, random(256) as u8)),
        }
        stream.write_all(&bytes).unwrap();
    }
    // The first whole frame is understood. The socket closes only after it has been read.
    stream.write_all(Frame::new(Sequence(20_000), &Request::Disarm).as_bytes()).unwrap();
    while mcu.with(|shared| shared.applied.last() != Some(&Request::Disarm)) {
        std::thread::sleep(Duration::from_millis(1));
    }
    stream.shutdown(std::net::Shutdown::Both).unwrap();
    drained.join().unwrap();

    let applied = mcu.with(|shared| shared.applied.clone());
    for request in &applied {
        let known = (1..=10_001).any(|number| sent(number) == *request);
        assert!(known || matches!(request, Request::Hello | Request::Disarm), "{request:?}");
    }
    let counters = mcu.with(|shared| shared.counters);
    assert!(counters.damaged > 8000, "{counters:?}");
    greet(&mcu);
}
