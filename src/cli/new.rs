//! Command `palpate new`.

use super::choices::{self, Asker, Choice, label, name};
use super::find::{find_input, is_experiment};
use super::output::{Overwrite, make_folder, sealed};
use super::picture::picture;
use super::prepare::prepare_environment;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::experiment::is_name_character;
use crate::experiment::store::write_whole;
use crate::sim::Scene;
use crate::sim::placement::{self, ObjectAxes, ObjectSide, UpAxis, ZoneProposal};
use crate::sim::scene::Unit;
use anyhow::{Context, bail, ensure};
use clap::{Args as _, FromArgMatches};
use palpate_explore::robot::finger::shape::BIOTAC_RADIUS_M;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::holes::Hole;
use palpate_geometry::import::{import_with, statements};
use palpate_geometry::mesh::Mesh;
use palpate_gp::math::pose::pose;
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
comment, then a flat base, then y for OBJ and z for others. If the evidence is ambiguous, palpate asks; without a terminal, or with --yes, \
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

    fn is_here(&self) -> bool {
        self.out.as_os_str() == "."
    }
}

/// Kinds of finger that can touch the object.
#[derive(Clone, Copy, Default, PartialEq, clap::ValueEnum)]
enum FingerKind {
    /// A rigid fingertip, swept to first contact: simulator = "swept".
    #[default]
    Rigid,
    /// A soft BioTac on a stage: simulator = "kinematic".
    Soft,
    /// A soft BioTac on a Mitsubishi PA-10, stepped by MuJoCo: simulator = "dynamic".
    Arm,
}

/// Parts of the files that depend on the finger.
struct FingerTemplate {
    body: &'static str,
    /// Tables of the scene other than object and zone.
    scene: String,
    /// Settings of the belief about the contacts' noise and normals.
    gp: &'static str,
    /// Approximate run time of the experiment.
    takes: &'static str,
}

impl FingerKind {
    fn template(self, is_around: bool) -> FingerTemplate {
        // The pad of a soft finger is at half of its tip, a rigid finger touches with its apex.
        let turned = |pitch_deg: u32| match is_around {
            true => format!(
                "\n[finger]\npitch_deg = {pitch_deg}              # of the finger to its motion\n"
            ),
            false => String::new(),
        };
        let minutes = |zone, around| if is_around { around } else { zone };
        match self {
            Self::Rigid => FingerTemplate {
                body: "swept",
                scene: turned(0),
                gp: NORMALS_SETTING,
                takes: minutes("half a minute", "about a minute"),
            },
            Self::Soft => FingerTemplate {
                body: "kinematic",
                scene: turned(45) + &biotac(""),
                gp: NOISE_SETTING,
                takes: minutes("about ten seconds", "about a minute"),
            },
            Self::Arm => FingerTemplate {
                body: "dynamic",
                scene: format!(
                    "{ARM_TABLE}{}{}",
                    if is_around { ARM_AROUND } else { "" },
                    biotac(ARM_APPROACH)
                ),
                gp: NOISE_SETTING,
                takes: minutes("about a minute", "some minutes"),
            },
        }
    }
}

/// Tables of a soft finger; `motion` has further settings of `[touch]`.
fn biotac(motion: &str) -> String {
    format!(
        "\n# A BioTac: its skin, the fluid under it and 19 electrodes, which locate the contact.\n\
         [touch]\n{motion}press_m = 0.0004\n\n\
         [effects.skin]\n[effects.fluid]\n[effects.electrodes]\n"
    )
}

const ARM_TABLE: &str =
    "\n[arm]                       # a Mitsubishi PA-10; its base is the origin\n";

/// Home of the arm in front of and above an object on a stand, as in scenes/bird_around_pa10.toml.
const ARM_AROUND: &str = "base_rotation_deg = [0, 0, -90]\nhome_deg = [0, -19, 0, 102, 0, 22, 0]\n";

const ARM_APPROACH: &str = "approach_m_s = 0.015        # slower than a stage: the servos need 0.04 s to stop the finger\n";

/// Enables normals: a rigid finger's contacts give the surface's slope. Normals from electrodes
/// have a common tilt too often (docs/belief.md).
const NORMALS_SETTING: &str =
    "normals = true              # each contact also gives the surface's slope\n";

/// RMS distance of contacts located by electrodes from the surface (docs/finger.md).
const NOISE_SETTING: &str = "noise_sd_min_m = 0.0003     # noise of contacts located by electrodes; extra noise is fitted\n";

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

/// Smallest size of an object; a heuristic, a seventh of the finger's radius.
const SMALLEST_M: f64 = 1e-3;

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
    let placed = MeshPlacement::new(args, Asker::new(args.yes, talk))?;
    make_folder(&args.out)?;
    let finger = args.finger.template(args.around);
    write_whole(&scene, sealed(&placed.scene(args, &finger)?))?;
    let scene_name = format!("{name}-scene.toml");
    let text = match args.around {
        true => whole_object_text(&name, &scene_name),
        false => experiment_text(&name, &scene_name, finger.gp),
    };
    write_whole(&experiment, sealed(&text))?;
    let mut written = vec![experiment.display().to_string(), scene.display().to_string()];
    let environment = prepare_environment(Scene::load(&scene, &[])?, talk)?;
    environment.notices().iter().for_each(|notice| talk.note(notice));
    placed.narrow_zone(args).iter().for_each(|notice| talk.note(notice));
    if let Some(svg) = picture(&environment, None) {
        write_whole(&drawn, &svg)?;
        written.push(drawn.display().to_string());
    }
    let (words, takes) = (placed.words(args), finger.takes);
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

/// Placement of a mesh in a scene, with the choices that led to it.
struct MeshPlacement {
    up: Choice<UpAxis>,
    unit: Choice<(Unit, f64)>,
    size_mm: [f64; 3],
    position_m: [f64; 3],
    rotation_deg: [f64; 3],
    /// Lowest point of the object in `W`.
    lowest_m: f64,
    /// Zone, unless the whole object is explored.
    found: Option<ZoneProposal>,
    holes: Vec<Hole>,
}

impl MeshPlacement {
    fn new(args: &Args, asker: Asker) -> anyhow::Result<Self> {
        let extension = args.mesh.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let is_gltf = ["gltf", "glb"].contains(&extension.as_str());
        // Millimetres are the middle of all units, so that meshes in the largest and the smallest
        // unit can be read.
        let read_m = Unit::Mm.metres_per_unit();
        let (mesh, report) = import_with(&args.mesh, read_m, args.allow_external_buffers)?;
        let stated = statements(&args.mesh);
        let extent = |mesh: &Mesh| {
            let (low, high) = mesh.bounds();
            high - low
        };
        let unit = choices::unit(
            extent(&mesh).max() / read_m,
            extension == "stl",
            args.unit,
            &stated,
            asker,
        );
        let up = choices::up(&mesh, args.up, &stated, extension == "obj", asker);
        let (metres_per_unit, scale) = (unit.value.0.metres_per_unit(), unit.value.1);
        let size_m = extent(&mesh).max() / read_m * metres_per_unit * scale;
        ensure!(
            size_m >= SMALLEST_M,
            "{}: in {} the object measures {:.1e} m; allowed is at least {SMALLEST_M} m: use another --unit",
            args.mesh.display(),
            label(unit.value.0),
            size_m
        );
        let mesh = mesh.with_patches(&report.holes).scaled(metres_per_unit * scale / read_m);
        let size_mm = (extent(&mesh) * 1e3).into();
        let axes = if is_gltf { ObjectAxes::of_gltf(up.value) } else { ObjectAxes::of(up.value) };
        let rotation_deg = placement::rotation_deg(axes, args.side);
        let turned = mesh.transformed(&pose([0.0; 3], rotation_deg));
        let position_m = match (args.around, args.finger) {
            (false, _) => placement::position_m(&turned),
            (true, FingerKind::Arm) => placement::centred_m(&turned, placement::ARM_CENTRE_M),
            (true, _) => placement::centred_m(&turned, placement::STAGE_CENTRE_M),
        };
        let placed = turned.transformed(&pose(position_m, [0.0; 3]));
        let lowest_m = placed.bounds().0.z;
        let found = match args.around {
            true => None,
            false => Some(placement::propose_zone(&MeshBvh::new(placed)).with_context(|| {
                format!(
                    "{}: no surface visible from that side; try another --side or --up",
                    args.mesh.display()
                )
            })?),
        };
        let holes = report.holes;
        Ok(Self { up, unit, size_mm, position_m, rotation_deg, lowest_m, found, holes })
    }

    /// Returns the scene as commented TOML.
    fn scene(
        &self,
        args: &Args,
        FingerTemplate { body, scene, .. }: &FingerTemplate,
    ) -> anyhow::Result<String> {
        let Self { unit, position_m, rotation_deg, .. } = self;
        let (unit, scale) = unit.value;
        let mesh = match args.mesh.is_relative() && args.is_here() {
            true => args.mesh.clone(),
            false => std::path::absolute(&args.mesh)?,
        };
        let mesh = toml::Value::from(mesh.to_string_lossy().into_owned());
        let mut others = String::new();
        if args.allow_external_buffers {
            others += "allow_external_buffers = true\n";
        }
        if !self.holes.is_empty() {
            others += "fill_holes = true           # a flat patch over each hole; false if the object has them\n";
        }
        Ok(format!(
            "# Scene of {}; change any number.\n\
             simulator = \"{body}\"\n\n\
             [object]\n\
             mesh = {mesh}\n\
             unit = \"{unit}\"                 # of the file's numbers: m, cm, mm, um, in\n\
             scale = {scale:?}                 # applied after the unit\n{others}\
             position_m = {position_m:?}    # of the mesh's origin, in the frame of the robot's base\n\
             rotation_deg = {rotation_deg:?}    # about the base's x, then y, then z\n\n{}{scene}",
            args.mesh.file_name().unwrap_or_default().to_string_lossy(),
            self.region(args),
        ))
    }

    /// Returns the table of the zone or of the whole object.
    fn region(&self, args: &Args) -> String {
        let Some(ZoneProposal { zone, fill_fraction }) = &self.found else {
            let lowest = match args.finger {
                FingerKind::Arm => format!(
                    "lowest_m = {:?}             # top of the stand; nothing is touched from below\n",
                    (self.lowest_m * 1e4).round() / 1e4
                ),
                _ => String::new(),
            };
            return format!(
                "[whole_object]              # default: the ball around the object, plus 10 %\n{lowest}"
            );
        };
        let [x_m, z_m] = [zone.x_m, zone.z_m.unwrap_or_default()];
        let datum_y_m = zone.datum_y_m();
        let depth_m = zone.depth_m.unwrap_or_default();
        format!(
            "[zone]                      # touched along -y; {:.0} % of it has a surface\n\
             x_m = {x_m:?}\n\
             z_m = {z_m:?}\n\
             datum_y_m = {datum_y_m:?}          # zero of the heights: the middle of the surface\n\
             depth_m = {depth_m:?}    # nearest and farthest -y of possible contact\n",
            100.0 * fill_fraction,
        )
    }

    /// Notice of a zone that is narrower than the finger.
    fn narrow_zone(&self, args: &Args) -> Option<String> {
        let zone = &self.found.as_ref()?.zone;
        let sides_m = zone.extents_m();
        let narrowest_m = sides_m.iter().copied().fold(f64::INFINITY, f64::min);
        (narrowest_m < 2.0 * BIOTAC_RADIUS_M).then(|| {
            let sides = sides_m.iter().map(|side_m| format!("{:.0}", 1e3 * side_m));
            format!(
                "the zone on the object's {} ({} mm) is narrower than the finger ({:.0} mm): try another \
                 --side (top, left, …), or --around",
                name(&args.side),
                sides.collect::<Vec<_>>().join(" x "),
                2e3 * BIOTAC_RADIUS_M
            )
        })
    }

    /// Describes the choices for the terminal.
    fn words(&self, args: &Args) -> String {
        let Self {
            up, unit: Choice { value: (unit, scale), evidence }, size_mm: [x, y, z], ..
        } = self;
        let scaled = match *scale {
            1.0 => String::new(),
            scale => format!(", scaled by {scale}"),
        };
        let region = match &self.found {
            Some(ZoneProposal { zone, fill_fraction }) => {
                let [width, height] =
                    [zone.x_m, zone.z_m.unwrap_or_default()].map(|[low, high]| 1e3 * (high - low));
                let [near, far] = zone.depth_m.unwrap_or_default();
                let (deep, percent) = (1e3 * (far - near), 100.0 * fill_fraction);
                format!(
                    "zone {width:.0} x {height:.0} mm, {deep:.0} mm deep, {percent:.0} % of it has a surface"
                )
            }
            None => "the whole object is explored from all sides".into(),
        };
        format!(
            "{}: {x:.1} x {y:.1} x {z:.1} mm; its {} faces the finger\n\
             unit {}{scaled}: {evidence}\n\
             up {}: {}\n{region}",
            args.mesh.display(),
            name(&args.side),
            label(*unit),
            name(&up.value),
            up.evidence,
        )
    }
}

fn experiment_text(name: &str, scene: &str, gp: &str) -> String {
    format!(
        "name = \"{name}\"\n\
         question = \"Which planner explores {name} best?\"\n\
         scene = \"{scene}\"\n\
         planners = [\"silhouette\", \"active\", \"sobol\", \"random\"]\n\
         trials = 12                 # of each planner\n\
         seed = 1\n\
         initial_touches = 5         # random touches, the same for all planners\n\
         touches = 40                # touches per trial, initial ones included\n\
         grid = 41                   # test points along each side of the zone\n\n\
         # Gaussian process for unknown objects; without this table the paper's settings apply.\n\
         [gp]\n\
         kernel = \"matern_52\"\n\
         noise = [1e-4, 1e-1]\n\
         band = \"objects\"\n\
         free_space = true\n{gp}"
    )
}

/// Experiment on a whole object, with the settings of experiments/around.toml.
fn whole_object_text(name: &str, scene: &str) -> String {
    format!(
        "name = \"{name}\"\n\
         question = \"How many touches does {name} need from all sides?\"\n\
         scene = \"{scene}\"\n\
         planners = [\"active\", \"sobol\", \"random\"]\n\
         trials = 10                 # of each planner\n\
         seed = 1\n\
         initial_touches = 5         # the same for all planners\n\
         touches = 60                # touches per trial, initial ones included\n"
    )
}
