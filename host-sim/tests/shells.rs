//! What shells, `man` and a bug report need: completions, manual pages, version.

use std::process::{Command, Output};

fn vsj(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vsj")).args(arguments).output().unwrap()
}

fn stdout(output: Output) -> String {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn each_completion_script_has_every_command() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = stdout(vsj(&["completions", shell]));
        for command in ["stair", "diagnose", "watch", "acknowledge"] {
            assert!(script.contains(command), "{shell} lacks {command}");
        }
    }
    assert_eq!(vsj(&["completions", "tcsh"]).status.code(), Some(2));
}

#[test]
fn bash_accepts_its_completions_and_completes_a_command() {
    let script = stdout(vsj(&["completions", "bash"]));
    let ask = "COMP_WORDS=(vsj wat); COMP_CWORD=1; _vsj vsj wat vsj; echo \"${COMPREPLY[*]}\"";
    let answer = Command::new("bash").arg("-c").arg(format!("{script}\n{ask}")).output().unwrap();
    assert_eq!(String::from_utf8(answer.stdout).unwrap(), "watch\n", "{}", String::from_utf8_lossy(&answer.stderr));
}

#[test]
fn every_command_has_a_manual_page_with_its_options_and_examples() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("man1");
    stdout(vsj(&["man", "--out", out.to_str().unwrap()]));
    for (page, parts) in [
        ("vsj.1", &["vsj\\-diagnose(1)", "SUBCOMMANDS"][..]),
        ("vsj-watch.1", &["\\-\\-emulated", "Space disarms", "vsj watch /dev/ttyACM0"]),
        ("vsj-link-record.1", &["\\-\\-rate\\-hz"]),
    ] {
        let text = std::fs::read_to_string(out.join(page)).unwrap();
        for part in parts {
            assert!(text.contains(part), "{page} lacks {part}:\n{text}");
        }
    }
}

#[test]
fn the_version_has_the_revision_of_the_sources() {
    let version = stdout(vsj(&["--version"]));
    let revision = version.trim().strip_prefix(&format!("vsj {} (", env!("CARGO_PKG_VERSION")));
    let revision = revision.and_then(|rest| rest.strip_suffix(')')).unwrap_or_else(|| panic!("{version}"));
    // As in the first line of the firmware's log: the same script of both builds sets it.
    assert!(
        revision == "unknown" || (revision.len() >= 12 && revision.chars().all(|c| c.is_ascii_hexdigit())),
        "{revision}"
    );
    assert_eq!(revision, env!("GIT_REVISION"));
}
