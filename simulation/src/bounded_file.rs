//! Files read whole into memory, with a bound on their size: a device or a pipe may never end.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::Result;

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::plant_file::place::line_and_column;

/// Reads a file of at most `most_mib` MiB; `expected` says what the file should be.
///
/// # Errors
/// [`BadInput`] if the file cannot be read or is larger.
pub fn read(path: &Path, most_mib: usize, expected: &str) -> Result<Vec<u8>> {
    let name = path.display();
    let most = most_mib << 20;
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(most as u64 + 1).read_to_end(&mut bytes));
    if let Err(error) = read {
        bad_input!("{name}: cannot be read: {error}; expected {expected}");
    }
    if bytes.len() > most {
        bad_input!("{name}: larger than {most_mib} MiB; expected {expected} of at most that size");
    }
    Ok(bytes)
}

/// Reads a text in UTF-8 of at most `most_mib` MiB.
///
/// # Errors
/// The errors of [`read`], and [`BadInput`] with line and column of the first byte that is not UTF-8.
pub fn read_text(path: &Path, most_mib: usize, expected: &str) -> Result<String> {
    let not_utf_8 = |error: std::string::FromUtf8Error| {
        let end = error.utf8_error().valid_up_to();
        let before = String::from_utf8_lossy(&error.as_bytes()[..end]);
        let place = line_and_column(&path.display().to_string(), &before, end);
        BadInput(format!("{place}: not UTF-8; expected a text in UTF-8"))
    };
    Ok(String::from_utf8(read(path, most_mib, expected)?).map_err(not_utf_8)?)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_bound_and_refused_beyond() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for (size, accepted) in [(0, true), (1 << 20, true), ((1 << 20) + 1, false)] {
            file.as_file().set_len(size).unwrap();
            let read = read(file.path(), 1, "a small file");
            assert_eq!(read.is_ok(), accepted, "{size} bytes");
        }
        let error = read(Path::new("/dev/zero"), 1, "a small file").unwrap_err().to_string();
        assert_eq!(error, "/dev/zero: larger than 1 MiB; expected a small file of at most that size");
    }

    #[test]
    fn a_byte_that_is_not_utf_8_is_reported_with_its_place() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), b"a\nbc\xffd").unwrap();
        let error = read_text(file.path(), 1, "a text").unwrap_err().to_string();
        assert!(error.ends_with("line 2, column 3: not UTF-8; expected a text in UTF-8"), "{error}");
    }
}
