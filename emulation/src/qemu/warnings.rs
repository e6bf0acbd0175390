//! The warnings that QEMU prints into the log of a board in real time.
//!
//! With `align=on` QEMU writes a line to the stdout of the board when the host is too slow for it. It comes between two frames of
//! the log, or within one, and is not a part of it.

/// How a warning begins; it ends with its line.
const WARNING: &[u8] = b"Warning: The guest is now late by ";

/// Takes the warnings out of a log that arrives in pieces.
#[derive(Default)]
pub(super) struct Warnings {
    /// The end of what has arrived, if it is the beginning of a warning.
    begun: Vec<u8>,
}

impl Warnings {
    /// The bytes of the log in a further piece.
    pub(super) fn remove(&mut self, piece: &[u8]) -> Vec<u8> {
        let mut rest = std::mem::take(&mut self.begun);
        rest.extend_from_slice(piece);
        let mut log = Vec::new();
        while let Some(start) = rest.windows(WARNING.len()).position(|bytes| bytes == WARNING) {
            log.extend(rest.drain(..start));
            let Some(end) = rest.iter().position(|&byte| byte == b'\n') else {
                self.begun = rest;
                return log;
            };
            rest.drain(..=end);
        }
        let lengths = (1..WARNING.len()).rev();
        let begun = lengths.into_iter().find(|&length| rest.ends_with(&WARNING[..length])).unwrap_or(0);
        self.begun = rest.split_off(rest.len() - begun);
        log.extend(rest);
        log
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_has_no_warnings_whatever_the_pieces_in_which_it_arrives() {
        let (warning, log) = ("Warning: The guest is now late by 0.0 to 1.0 seconds\n", b"\x00ab\ncWarn\x00d\n\x00");
        for at in 0..=log.len() {
            let twice = warning.repeat(2);
            let bytes = [&log[..at], warning.as_bytes(), &log[at..], twice.as_bytes(), b"\x00"].concat();
            for piece in 1..=bytes.len() {
                let mut warnings = Warnings::default();
                let found: Vec<u8> = bytes.chunks(piece).flat_map(|piece| warnings.remove(piece)).collect();
                assert_eq!(found, [&log[..], b"\x00"].concat(), "at {at}, in pieces of {piece}");
            }
        }
    }
}
