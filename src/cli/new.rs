//! Command `palpate new`.

use super::find::{find_input, is_experiment};
use super::output::{Overwrite, make_folder, sealed};
use super::prepare::prepare_environment;
use super::terminal::{Completion, Verbosity, print, print_stderr};
use crate::experiment::experiment::is_name_character;
use crate::experiment::store::write_whole;
use crate::report::scene::picture;
use crate::sim::Scene;
use crate::sim::placement::{ObjectSide, UpAxis};
use crate::sim::scene::Unit;
use crate::study::setup::{self, Asker, FingerKind, MeshOptions, MeshPlacement};
use anyhow::{bail, ensure};
use clap::{Args as _, FromArgMatches};
use std::io::{self, BufRead, IsTerminal};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate new my-part.stl
  palpate new my-part.obj --side top --finger soft
  palpate new mug.glb --around
  palpate new scan.ply --unit inch --up z --out my-experiments

Reads the mesh and writes an experiment, NAME.toml, its scene, NAME-scene.toml, and a picture of both, NAME.svg. \
The experiment runs unchanged. Each choice is printed with its evidence and is a setting of the scene that you can change. A second \
call replaces the files unless you edited them.

Unit: glTF is in metres by its standard. Other files may state a unit in a comment. Otherwise it is mm for STL, and else the one of mm, \
cm and m that gives a size that a finger can explore, 30 to 400 mm; if none does, the mesh is scaled to 150 mm. A stated unit is never \
scaled. Up: y for glTF by its standard, then a \
comment, then the only plane of the file that the object stands on, then a flat base, then the most stable pose. If the evidence is ambiguous, palpate asks; without a terminal, or with --yes, \
it takes the most plausible value and says so.")]
pub(super) struct Args {
    /// Mesh file; a shipped one, such as models/suite/mug.glb, is found in every folder.
    #[arg(value_parser = find_input)]
    mesh: PathBuf,
    /// Explore the whole object from all sides, instead of a zone on one side.
    #[arg(long)]
    around: bool,
    /// Side that faces the finger.
    #[arg(long, value_enum, default_value_t)]
    side: ObjectSide,
    /// Up axis of the file [default: by its evidence].
    #[arg(long, value_enum, allow_hyphen_values = true)]
    up: Option<UpAxis>,
    /// Unit of the file's numbers [default: by its evidence].
    #[arg(long, value_enum)]
    unit: Option<Unit>,
    /// Take the default for all that is ambiguous, without a question.
    #[arg(long, short)]
    yes: bool,
    /// Finger that touches the object.
    #[arg(long, value_enum, default_value_t)]
    finger: FingerKind,
    /// Let a glTF mesh read buffers outside its own folder.
    #[arg(long)]
    allow_external_buffers: bool,
    /// Folder for the files.
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    out: PathBuf,
    #[command(flatten)]
    force: Overwrite,
}

impl Args {
    /// Path of a file in the output folder.
    fn beside(&self, file: String) -> PathBuf {
        if self.is_here() { file.into() } else { self.out.join(file) }
    }

    fn options(&self) -> MeshOptions {
        MeshOptions {
            mesh: self.mesh.clone(),
            folder: Some(self.out.clone()),
            is_around: self.around,
            side: self.side,
            up: self.up,
            unit: self.unit,
            finger: self.finger,
            allow_external_buffers: self.allow_external_buffers,
        }
    }

    fn is_here(&self) -> bool {
        self.out.as_os_str() == "."
    }
}

impl Args {
    /// Returns the arguments for a mesh whose ambiguities are decided by their evidence.
    ///
    /// # Errors
    /// If an option's value is not allowed.
    pub(super) fn of_words(words: &[String]) -> anyhow::Result<Self> {
        let command = Self::augment_args(clap::Command::new("new").no_binary_name(true));
        let found = command.try_get_matches_from(words);
        let parsed = found.and_then(|mut found| Self::from_arg_matches_mut(&mut found));
        parsed.map_err(|error| {
            let words = error.render().to_string();
            let first = words.lines().take_while(|line| !line.is_empty()).collect::<Vec<_>>();
            anyhow::anyhow!("{}", first.join(" ").trim_start_matches("error: "))
        })
    }
}

/// Files that were written for a mesh.
pub(super) struct Written {
    /// Choices with their evidence.
    pub words: String,
    /// Paths of the files.
    pub files: Vec<String>,
    /// Path of the experiment.
    pub experiment: PathBuf,
    /// Path of the picture, which may be missing.
    pub picture: PathBuf,
    takes: &'static str,
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let Written { words, files, experiment, picture, takes } = write(args, talk)?;
    print(&format!(
        "{words}\nwrote {}\n\nnext\n  look at {}: is the object upright, and has it the right size?\n  \
         palpate run {}    {takes}",
        files.join(", "),
        picture.display(),
        experiment.display(),
    ))?;
    Ok(Completion::Done)
}

/// Writes experiment, scene and picture of a mesh.
pub(super) fn write(args: &Args, talk: Verbosity) -> anyhow::Result<Written> {
    check_is_mesh(&args.mesh)?;
    let name = file_name(&args.mesh)?;
    let [experiment, scene] = ["", "-scene"].map(|what| args.beside(format!("{name}{what}.toml")));
    args.force.check_editable_file(&experiment)?;
    args.force.check_editable_file(&scene)?;
    let drawn = args.beside(format!("{name}.svg"));
    args.force.check_file(&drawn)?;
    let options = args.options();
    let can_ask = !args.yes && io::stdin().is_terminal() && io::stderr().is_terminal();
    let choose = |what: &str, choices: &[&str]| if can_ask { ask(what, choices) } else { None };
    let asker = Asker { choose: &choose, note: &|text| talk.note(text) };
    let placed = MeshPlacement::new(&options, asker)?;
    make_folder(&args.out)?;
    write_whole(&scene, sealed(&placed.scene(&options)?))?;
    let text = setup::experiment(&options, &name, &format!("{name}-scene.toml"));
    write_whole(&experiment, sealed(&text))?;
    let mut written = vec![experiment.display().to_string(), scene.display().to_string()];
    let environment = prepare_environment(Scene::load(&scene, &[])?, talk)?;
    environment.notices().iter().for_each(|notice| talk.note(notice));
    placed.narrow_zone(&options).iter().for_each(|notice| talk.note(notice));
    let height_m = |place: &[f64]| environment.true_height_m(place);
    if let Some(svg) = picture(environment.task(), environment.mesh(), &height_m, &[]) {
        write_whole(&drawn, &svg)?;
        written.push(drawn.display().to_string());
    }
    let words = placed.words(&options);
    let takes = args.finger.run_time(args.around);
    Ok(Written { words, files: written, experiment, picture: drawn, takes })
}

/// Refuses a scene or an experiment, with the command that takes it.
fn check_is_mesh(path: &Path) -> anyhow::Result<()> {
    let name = path.display();
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Ok(());
    }
    match is_experiment(path) {
        true => {
            bail!("{name} is an experiment, and new takes a mesh; to run it: palpate run {name}")
        }
        false => bail!("{name} is no mesh; if it is a scene: palpate show {name}"),
    }
}

/// Derives the experiment's name from the mesh's file name.
fn file_name(mesh: &Path) -> anyhow::Result<String> {
    let stem = mesh.file_stem().unwrap_or_default().to_string_lossy();
    let name: String =
        stem.chars().map(|c| if is_name_character(c) { c } else { '-' }).take(80).collect();
    let name = name.trim_matches(['-', '.']);
    ensure!(!name.is_empty(), "{}: the file name needs a letter or digit", mesh.display());
    Ok(name.into())
}

/// Number of times that an invalid answer is asked for again.
const TRIES: usize = 3;

/// Asks on the terminal for one of `choices`; returns its index, or `None` without an answer.
fn ask(what: &str, choices: &[&str]) -> Option<usize> {
    let lines = choices.iter().enumerate().map(|(i, words)| format!("  {} {words}", i + 1));
    print_stderr(&format!("{what}?\n{}", lines.collect::<Vec<_>>().join("\n")));
    for _ in 0..TRIES {
        print_stderr(&format!("number, 1 to {} [1]:", choices.len()));
        let mut answer = String::new();
        if !matches!(io::stdin().lock().read_line(&mut answer), Ok(1..)) {
            break;
        }
        let number: Option<usize> = match answer.trim() {
            "" => Some(1),
            text => text.parse().ok(),
        };
        let index = number.and_then(|number| number.checked_sub(1));
        if let Some(index) = index.filter(|index| *index < choices.len()) {
            return Some(index);
        }
    }
    None
}
