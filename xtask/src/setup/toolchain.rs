//! The pinned toolchain, its components and its targets, installed by rustup.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result};

use crate::shell;

/// The file that pins the toolchain.
const FILE: &str = "rust-toolchain.toml";

/// Installs what the toolchain file lists and rustup does not have.
pub(super) fn install() -> Result<()> {
    let path = shell::root().join(FILE);
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let wanted = Wanted::parse(&text).with_context(|| format!("cannot use {FILE}"))?;

    let toolchains = shell::output(rustup().args(["toolchain", "list"]))
        .context("rustup does not start: install it from https://rustup.rs, then repeat this command")?;
    let Some(host) = host(&toolchains, &wanted.channel) else {
        eprintln!("setup: Rust {} is missing", wanted.channel);
        // Without a name rustup reads the file, and installs components and targets as well.
        return shell::run(rustup().args(["toolchain", "install", "--no-self-update"]));
    };
    let list = ["component", "list", "--installed", "--toolchain", &wanted.channel];
    let missing = wanted.missing(&shell::output(rustup().args(list))?, host);
    if missing.is_empty() {
        let Wanted { channel, components, targets } = wanted;
        eprintln!("setup: Rust {channel} with {} is installed", [components, targets].concat().join(", "));
    }
    missing.iter().try_for_each(|args| shell::run(rustup().args(args)))
}

/// Adds a target that the toolchain file does not list, because only one command needs it.
pub(super) fn add_target(name: &str) -> Result<()> {
    let installed = shell::output(rustup().args(["target", "list", "--installed"]))
        .context("rustup does not start: install it from https://rustup.rs, then repeat this command")?;
    if installed.lines().any(|line| line.trim() == name) {
        return Ok(());
    }
    shell::run(rustup().args(["target", "add", name]))
}

/// Content of a toolchain file.
#[derive(Debug)]
struct Wanted {
    channel: String,
    components: Vec<String>,
    targets: Vec<String>,
}

impl Wanted {
    fn parse(text: &str) -> Result<Self> {
        let file: toml::Table = text.parse()?;
        let toolchain = file.get("toolchain").context("no [toolchain]")?;
        let channel = toolchain.get("channel").and_then(|c| c.as_str()).context("no channel")?;
        let names = |key| {
            let list = toolchain.get(key).and_then(|l| l.as_array()).into_iter().flatten();
            list.filter_map(|name| name.as_str()).map(str::to_owned).collect()
        };
        Ok(Self { channel: channel.to_owned(), components: names("components"), targets: names("targets") })
    }

    /// The rustup commands that add what is not `installed`, one for the components and one for the targets.
    /// `installed` is the output of `rustup component list --installed`, in which a component's name ends with the
    /// `host` triple.
    fn missing(&self, installed: &str, host: &str) -> Vec<Vec<String>> {
        let is_there = |name: &str| installed.lines().any(|line| line.trim() == name);
        let add = |what: &str, names: &[String], is_there: &dyn Fn(&str) -> bool| {
            let missing: Vec<String> = names.iter().filter(|name| !is_there(name)).cloned().collect();
            let args = [what, "add", "--toolchain", &self.channel].map(str::to_owned);
            (!missing.is_empty()).then(|| args.into_iter().chain(missing).collect())
        };
        let component = |name: &str| is_there(name) || is_there(&format!("{name}-{host}"));
        let target = |name: &str| is_there(&format!("rust-std-{name}"));
        [add("component", &self.components, &component), add("target", &self.targets, &target)]
            .into_iter()
            .flatten()
            .collect()
    }
}

/// The host triple of the installed toolchain `channel`, from the output of `rustup toolchain list`; `None` if it is
/// not installed.
fn host<'a>(toolchains: &'a str, channel: &str) -> Option<&'a str> {
    toolchains.lines().find_map(|line| line.split_whitespace().next()?.strip_prefix(channel)?.strip_prefix('-'))
}

/// rustup without `RUSTUP_TOOLCHAIN`, which cargo sets for its children and which would take precedence over the file.
fn rustup() -> Command {
    let mut command = shell::command("rustup");
    command.env_remove("RUSTUP_TOOLCHAIN");
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: &str = "x86_64-unknown-linux-gnu";

    fn wanted() -> Wanted {
        let list = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Wanted {
            channel: "1.95.0".to_owned(),
            components: list(&["rustfmt", "clippy"]),
            targets: list(&["thumbv7em-none-eabihf"]),
        }
    }

    #[test]
    fn the_workspace_file_pins_a_release_and_the_target_of_the_mcu() {
        let Wanted { channel, targets, .. } = Wanted::parse(include_str!("../../../rust-toolchain.toml")).unwrap();
        assert!(channel.contains('.'), "{channel} is not one release");
        assert!(targets.iter().any(|target| target == shell::MCU), "{targets:?}");
    }

    #[test]
    fn an_installed_toolchain_is_found_with_its_host() {
        let list = "stable-x86_64-unknown-linux-gnu\n1.95.0-x86_64-unknown-linux-gnu (active, default)\n";
        assert_eq!(host(list, "1.95.0"), Some(HOST));
        assert_eq!(host(list, "1.95"), None);
        assert_eq!(host("no installed toolchains\n", "1.95.0"), None);
    }

    #[test]
    fn only_what_is_missing_is_added() {
        let missing =
            |installed: &str| wanted().missing(installed, HOST).iter().map(|args| args.join(" ")).collect::<Vec<_>>();
        let all =
            format!("cargo-{HOST}\nclippy-{HOST}\nrust-std-thumbv7em-none-eabihf\nrust-std-{HOST}\nrustfmt-{HOST}\n");
        assert!(missing(&all).is_empty());
        // A target whose name begins like the wanted one's is another target.
        assert_eq!(missing(&all.replace("eabihf", "eabi")), ["target add --toolchain 1.95.0 thumbv7em-none-eabihf"]);
        assert_eq!(
            missing(&format!("rustfmt-{HOST}\n")),
            ["component add --toolchain 1.95.0 clippy", "target add --toolchain 1.95.0 thumbv7em-none-eabihf"]
        );
    }
}
