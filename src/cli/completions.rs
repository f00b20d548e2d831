//! Command `palpate completions`.

use super::terminal::{Completion, print};
use clap_complete::{Shell, generate};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate completions bash > ~/.local/share/bash-completion/completions/palpate
  palpate completions zsh > ~/.zfunc/_palpate
  palpate completions fish > ~/.config/fish/completions/palpate.fish")]
pub(super) struct Args {
    /// Shell to complete commands in.
    shell: Shell,
}

pub(super) fn run(args: &Args, mut command: clap::Command) -> anyhow::Result<Completion> {
    let mut script = Vec::new();
    generate(args.shell, &mut command, "palpate", &mut script);
    print(String::from_utf8_lossy(&script).trim_end())?;
    Ok(Completion::Done)
}
