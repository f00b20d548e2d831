//! `palpate reference`.

use crate::report::compare;
use crate::report::reference::{columns, measures, rows, settings};
use crate::report::tables::comparison::{comparison_file, equal_error_file};
use crate::study::compare::Compared;
use clap::Command;

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  palpate reference > reference.md")]
pub(super) struct Args {}

/// Commands, settings and columns as Markdown, from the code that has them.
pub(super) fn text(program: &Command) -> String {
    format!(
        "# Reference\n\nWritten by `palpate reference`; `make reference` writes it again.\n\n\
         ## Commands\n{}\n\
         ## Settings\n\nKeys of an experiment's file, and of `--set`. A scene's file has the keys under \
         `scene` without that word. A table under `scene.effects`, `scene.arm` or `scene.object` is there or \
         not; its defaults hold once it is named.\n{}\n\
         ## Measures\n\nAfter every touch from the last initial one on. `summary.csv` has a record for each \
         planner and number of touches: `planner`, `touches`, `trials`, then the columns below; of an error \
         also how it differs from each baseline's in the same trials.\n\n{}\n\
         ## `comparison.csv`\n\n{}\n\
         ## `equal_error.csv`\n\n{}\n\
         ## `suite.csv`\n\n{}\n\
         ## `trials.jsonl`\n\nOne line for each trial.\n\n{}",
        commands(program),
        settings(),
        measures(),
        columns(&comparison_file(&[])),
        columns(&equal_error_file(&[])),
        columns(&compare::file(&Compared::default())),
        rows(),
    )
}

/// The help of every command.
fn commands(program: &Command) -> String {
    let mut text = String::new();
    for command in program.get_subcommands() {
        let name = command.get_name();
        let mut command = command.clone().bin_name(format!("palpate {name}")).term_width(100);
        let help = command.render_long_help().to_string();
        let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
        text +=
            &format!("\n### `palpate {name}`\n\n```text\n{}\n```\n", lines.join("\n").trim_end());
    }
    text
}
