//! Damaged frames on a real byte stream.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use host_sim::link::{Client, Patience, Port};
use link::nonce::Nonces;
use link::{Command, Desired, Frame, Request, Sequence};
use model::{Volts, supervisor};
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};

use crate::mcu::{Mcu, Setup};

fn greet(mcu: &Mcu) -> Client {
    let port = Port::open(&mcu.port, 115_200, Duration::from_secs(5)).unwrap();
    Client::greet(port, Patience { each: Duration::from_millis(20), tries: 100 }).unwrap().0
}

fn volts(number: u16) -> f64 {
    f64::from(number) / 16.0
}

fn set(number: u16) -> Request {
    Request::Set(Desired::ScaledVolts(volts(number)))
}

fn order(number: u16) -> Command {
    Command { heard: true, arming: None, target: Some(Volts::new(volts(number)).unwrap()) }
}

/// One byte in 60 is damaged in both directions: most answers and many requests are lost and repeated.
fn every_command_is_applied_once_and_in_order(mcu: &Mcu) {
    let mut client = greet(mcu);
    client.order(Request::Arm).unwrap();
    for number in 0..150 {
        let (_, target) = client.order(set(number)).unwrap();
        assert_eq!(target.to_f64(), volts(number), "an answer to something else");
    }
    let ordered = mcu.with(|shared| shared.ordered.clone());
    let arm = Command { heard: true, arming: Some(supervisor::Command::Arm), target: Some(Volts::ZERO) };
    assert_eq!(ordered[0], arm);
    assert_eq!(ordered[1..], (0..150).map(order).collect::<Vec<_>>());
    let counters = mcu.with(|shared| shared.counters);
    assert!(counters.damaged > 10 && counters.repeated > 10, "{counters:?}");
}

#[test]
fn on_a_damaged_socket_every_command_is_applied_once() {
    every_command_is_applied_once_and_in_order(&Mcu::on_socket(Setup { damage_one_in: Some(60), ..Setup::default() }));
}

#[test]
fn on_a_damaged_terminal_every_command_is_applied_once() {
    every_command_is_applied_once_and_in_order(&Mcu::on_terminal(Setup {
        damage_one_in: Some(60),
        ..Setup::default()
    }));
}

/// Sends 10 000 frames to an armed MCU, each flipped, truncated, spliced or padded with garbage.
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
    let mut random = move |below: usize| (rng.next_u64() % below as u64) as usize;
    // The nonce of the first session after the first Hello of this MCU.
    let nonce = mcu.with(|shared| Nonces::new(shared.seed).draw());
    let frame = |number, request| Frame::new(nonce.stamp(Sequence(number)), &request);
    stream.write_all(frame(0, Request::Hello).as_bytes()).unwrap();
    stream.write_all(frame(1, Request::Arm).as_bytes()).unwrap();
    for number in 2..=10_001 {
        let mut bytes = frame(number, set(number)).as_bytes().to_vec();
        let at = random(bytes.len());
        match random(4) {
            0 => bytes[at] ^= 1 << random(8),
            1 => bytes.truncate(at),
            2 => {
                let other = frame(number + 1, set(number + 1));
                bytes.truncate(at);
                bytes.extend_from_slice(&other.as_bytes()[random(other.as_bytes().len())..]);
            }
            _ => (0..random(60)).for_each(|_| bytes.insert(at, random(256) as u8)),
        }
        stream.write_all(&bytes).unwrap();
    }
    // The first valid frame is accepted.
    stream.write_all(frame(20_000, Request::Disarm).as_bytes()).unwrap();
    let disarm = Command { heard: true, arming: Some(supervisor::Command::Disarm), target: None };
    let sent = Instant::now();
    while mcu.with(|shared| shared.ordered.last() != Some(&disarm)) {
        assert!(sent.elapsed() < Duration::from_secs(60), "the first valid frame is not accepted");
        std::thread::sleep(Duration::from_millis(1));
    }
    stream.shutdown(std::net::Shutdown::Both).unwrap();
    drained.join().unwrap();

    let ordered = mcu.with(|shared| shared.ordered.clone());
    let known: Vec<Command> = (2..=10_002).map(order).collect();
    let (targets, counters) = (&ordered[1..ordered.len() - 1], mcu.with(|shared| shared.counters));
    assert!(targets.iter().all(|order| known.contains(order)), "{ordered:?}");
    assert!(counters.damaged > 8000 && !targets.is_empty(), "{counters:?}");
    greet(&mcu);
}
