//! Folders as URIs, by which FMI 2.0 names the resources of a unit.

use std::path::PathBuf;

use anyhow::{Context, Result};

/// The path of a URI with the scheme `file`.
pub(crate) fn path(uri: &str) -> Result<PathBuf> {
    let rest = uri.strip_prefix("file:").with_context(|| format!("{uri}: expected a URI that begins with file:"))?;
    let rest = rest.strip_prefix("//").map_or(rest, |rest| rest.strip_prefix("localhost").unwrap_or(rest));
    let (mut bytes, mut letters) = (Vec::new(), rest.bytes());
    while let Some(byte) = letters.next() {
        let digits = [letters.clone().next(), letters.clone().nth(1)];
        let code = match digits {
            [Some(high), Some(low)] if byte == b'%' => {
                std::str::from_utf8(&[high, low]).ok().and_then(|digits| u8::from_str_radix(digits, 16).ok())
            }
            _ => None,
        };
        bytes.push(code.unwrap_or(byte));
        if code.is_some() {
            letters.nth(1);
        }
    }
    let path = String::from_utf8(bytes)?;
    // The letter of a drive stands behind a slash.
    let drive = path.strip_prefix('/').filter(|rest| rest.as_bytes().get(1) == Some(&b':'));
    Ok(PathBuf::from(drive.unwrap_or(&path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uri_becomes_a_path() {
        for (uri, expected) in [
            ("file:///tmp/a%20b/%c3%bc/resources", "/tmp/a b/\u{fc}/resources"),
            ("file:/tmp/x", "/tmp/x"),
            ("file://localhost/tmp/100%", "/tmp/100%"),
            ("file:///C:/Users/x", "C:/Users/x"),
        ] {
            assert_eq!(path(uri).unwrap(), PathBuf::from(expected), "{uri}");
        }
        assert!(path("/tmp/x").is_err());
    }
}
