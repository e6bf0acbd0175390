//! Frames that the board must not follow: damaged, late, recorded, of another version, or noise.

use std::ops::Range;

use link::{Desired, Frame, Nonce, Reply, Request, Sequence, State, WireVolts};
use random_numbers::Xorshift32;

/// Number of frames in a run.
pub(super) const HOSTILE: u32 = 10_000;

/// Random choices, the same in every run.
pub(super) struct Dice(Xorshift32);

impl Dice {
    pub(super) const fn new(seed: u32) -> Self {
        Self(Xorshift32::new(seed))
    }

    fn draw(&mut self, range: Range<usize>) -> usize {
        range.start + (self.0.draw() >> 4) as usize % (range.end - range.start)
    }
}

/// A request that the board would follow in a valid frame: another target, or arming.
fn tempting(dice: &mut Dice) -> Request {
    match dice.draw(0..4) {
        0 => Request::Arm,
        _ => Request::Set(Desired::ScaledVolts(dice.draw(0..700) as f64)),
    }
}

/// The frame of this index, which the board must not follow. `next` is the sequence number that it would accept in its
/// `session`.
pub(super) fn hostile(dice: &mut Dice, index: u32, session: Nonce, next: Sequence) -> Vec<u8> {
    let request = tempting(dice);
    let sound = Frame::new(session.stamp(next), &request).as_bytes().to_vec();
    let inside = 1..sound.len() - 1;
    match index % 9 {
        // Noise, partly longer than any frame.
        0 | 1 => {
            let length = dice.draw(1..200);
            let noise = (0..length).map(|_| dice.draw(1..256) as u8);
            [0].into_iter().chain(noise).chain([0]).collect()
        }
        // One to five flipped bits.
        2 | 3 => {
            let mut frame = sound;
            let mut flipped = Vec::new();
            for _ in 0..dice.draw(1..6) {
                let place = (dice.draw(inside.clone()), dice.draw(0..8));
                if !flipped.contains(&place) {
                    frame[place.0] ^= 1 << place.1;
                    flipped.push(place);
                }
            }
            frame
        }
        // Bytes are missing.
        4 => {
            let mut frame = sound;
            let from = dice.draw(inside.clone());
            let to = dice.draw(from + 1..inside.end + 1);
            frame.drain(from..to);
            frame
        }
        // Another version. The board answers it, so its number must not be the next one, whose answer it would look
        // like.
        5 => {
            let version = link::VERSION.wrapping_add(dice.draw(1..255) as u8);
            Frame::with_version(version, session.stamp(Sequence(next.0.wrapping_add(100))), &request).as_bytes().into()
        }
        // An old sequence number.
        6 => {
            let old = Sequence(next.0.wrapping_sub(dice.draw(2..30_000) as u16));
            Frame::new(session.stamp(old), &request).as_bytes().into()
        }
        // A frame of another session, a sign of life among them. Its number is not the next one either.
        7 => {
            let other = Nonce(session.0 ^ 1 << dice.draw(0..32));
            let request = if dice.draw(0..2) == 0 { request } else { Request::Heartbeat };
            Frame::new(other.stamp(Sequence(next.0.wrapping_add(100))), &request).as_bytes().into()
        }
        // An echo of a reply.
        _ => {
            let target = WireVolts::from_f64(dice.draw(0..700) as f64);
            Frame::new(session.stamp(next), &Reply::Ack { state: State::Armed, target }).as_bytes().into()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::Receiver;

    #[test]
    fn no_hostile_frame_is_a_valid_request() {
        let mut dice = Dice::new(7);
        for index in 0..HOSTILE {
            let (session, next) = (Nonce(77), Sequence(index as u16));
            let mut receiver = Receiver::new();
            for byte in hostile(&mut dice, index, session, next) {
                let Some(packet) = receiver.on_byte(byte) else { continue };
                let newer = packet.sequence.0.wrapping_sub(next.0) < 1 << 15;
                let followed = packet.read::<Request>().is_ok() && packet.session() == session && newer;
                assert!(!followed, "{index}: {packet:?}");
            }
        }
    }
}
