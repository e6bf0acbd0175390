//! `vsj completions` and `vsj man`: what shells and `man` want to know, from the definition of the command line itself.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;
use host_sim::output::files::Files;
use host_sim::output::terminal::{print, wrote};

/// Print the completions of a shell: commands, options and their values
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj completions bash > ~/.local/share/bash-completion/completions/vsj
  vsj completions zsh > ~/.zfunc/_vsj                  a folder in $fpath
  vsj completions fish > ~/.config/fish/completions/vsj.fish

Exit codes: 0 success, 1 stdout cannot be written, 2 an unknown shell.")]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

/// Write the manual pages, one for each command
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj man --out ~/.local/share/man/man1   then: man vsj, man vsj-diagnose

Exit codes: 0 success, 1 a page cannot be written, 2 a folder that cannot be created.")]
pub(crate) struct Manual {
    /// Folder for the pages
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Prints the completions of `command`.
pub(crate) fn completions(arguments: &Completions, mut command: Command) -> Result<()> {
    let (name, mut script) = (command.get_name().to_owned(), Vec::new());
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    print(&String::from_utf8(script)?)
}

/// Writes the pages of `command` and of all commands below it.
pub(crate) fn manual(arguments: &Manual, mut command: Command) -> Result<()> {
    command.build();
    let mut files = Files::new(&arguments.out)?;
    add(&mut files, command)?;
    print(&wrote(&files.finish()?))
}

fn add(files: &mut Files, command: Command) -> Result<()> {
    for below in command.get_subcommands().filter(|below| below.get_name() != "help" && !below.is_hide_set()) {
        add(files, below.clone())?;
    }
    let page = Man::new(command);
    files.add(&page.get_filename(), |mut out| page.render(&mut out))
}
