//! Command `palpate new`.

use super::output::{Overwrite, make_folder};
use super::terminal::{Outcome, print};
use crate::experiment::experiment::is_name_character;
use crate::experiment::store::write_whole;
use crate::sim::placement::{self, ObjectAxes, ObjectSide, UpAxis, ZoneProposal};
use crate::sim::scene::Unit;
use anyhow::{Context, ensure};
use clap::ValueEnum;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::import::import_with;
use palpate_geometry::mesh::Mesh;
use palpate_gp::math::pose::pose;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate new my-part.stl
  palpate new my-part.obj --side top --finger soft
  palpate new scan.ply --unit in --up z --out my-experiments

Reads the mesh and writes an experiment, NAME.toml, and its scene, NAME-scene.toml. Both run unchanged. \
Every guess is printed and is a setting of the scene that you can change. Units: glTF files are in metres with y up by \
specification. Other formats have no unit: the first of mm, m and cm that gives a size that a finger can explore is used; if none \
does, the mesh is scaled to 0.15 m. Up: y for OBJ, z for STL and PLY.")]
pub(super) struct Args {
    /// Mesh file.
    mesh: PathBuf,
    /// Side that faces the finger.
    #[arg(long, value_enum, default_value_t)]
    side: ObjectSide,
    /// Up axis of the file [default: y for glTF and OBJ, z for others].
    #[arg(long, value_enum)]
    up: Option<UpAxis>,
    /// Unit of the file's numbers [default: guessed].
    #[arg(long, value_enum)]
    unit: Option<Unit>,
    /// Finger that touches the object.
    #[arg(long, value_enum, default_value_t)]
    finger: FingerKind,
    /// Let a glTF mesh read buffers outside its own folder.
    #[arg(long, alias = "outside-buffers")]
    allow_external_buffers: bool,
    /// Folder for both files.
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

    fn read(&self, metres_per_unit: f64) -> anyhow::Result<Mesh> {
        Ok(import_with(&self.mesh, metres_per_unit, self.allow_external_buffers)?.0)
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
    fn kit(self) -> FingerTemplate {
        match self {
            Self::Rigid => FingerTemplate {
                body: "swept",
                scene: String::new(),
                gp: NORMALS_SETTING,
                takes: "half a minute",
            },
            Self::Soft => FingerTemplate {
                body: "kinematic",
                scene: biotac(""),
                gp: NOISE_SETTING,
                takes: "about ten seconds",
            },
            Self::Arm => FingerTemplate {
                body: "dynamic",
                scene: format!("{ARM_TABLE}{}", biotac(ARM_APPROACH)),
                gp: NOISE_SETTING,
                takes: "about a minute",
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

const ARM_APPROACH: &str = "approach_m_s = 0.015        # slower than a stage: the servos need 0.04 s to stop the finger\n";

/// Enables normals: a rigid finger's contacts give the surface's slope. Normals from electrodes
/// have a common tilt too often (docs/belief.md).
const NORMALS_SETTING: &str =
    "normals = true              # each contact also gives the surface's slope\n";

/// RMS distance of contacts located by electrodes from the surface (docs/finger.md).
const NOISE_SETTING: &str = "noise_sd_min_m = 0.0003     # noise of contacts located by electrodes; extra noise is fitted\n";

pub(super) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let name = name(&args.mesh)?;
    let [experiment, scene] = ["", "-scene"].map(|what| args.beside(format!("{name}{what}.toml")));
    args.force.check_new_file(&experiment)?;
    args.force.check_new_file(&scene)?;
    let guess = MeshPlacement::new(args)?;
    make_folder(&args.out)?;
    let kit = args.finger.kit();
    write_whole(&scene, &guess.scene(args, &kit)?)?;
    let scene_name = format!("{name}-scene.toml");
    write_whole(&experiment, experiment_text(&name, &scene_name, kit.gp))?;
    print(&format!(
        "{}\nwrote {} and {}\n\nnext\n  palpate show {} --png {name}.png    to see the zone on it\n  \
         palpate run {}    {}",
        guess.words(args),
        scene.display(),
        experiment.display(),
        scene.display(),
        experiment.display(),
        kit.takes
    ))?;
    Ok(Outcome::Done)
}

/// Derives the experiment's name from the mesh's file name.
fn name(mesh: &Path) -> anyhow::Result<String> {
    let stem = mesh.file_stem().unwrap_or_default().to_string_lossy();
    let name: String =
        stem.chars().map(|c| if is_name_character(c) { c } else { '-' }).take(80).collect();
    let name = name.trim_matches(['-', '.']);
    ensure!(!name.is_empty(), "{}: the file name needs a letter or digit", mesh.display());
    Ok(name.into())
}

/// Placement of a mesh in a scene, with the guesses that led to it.
struct MeshPlacement {
    up: UpAxis,
    unit: Unit,
    scale: f64,
    size_mm: [f64; 3],
    position_m: [f64; 3],
    rotation_deg: [f64; 3],
    found: ZoneProposal,
}

impl MeshPlacement {
    fn new(args: &Args) -> anyhow::Result<Self> {
        let extension = args.mesh.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let is_gltf = ["gltf", "glb"].contains(&extension.as_str());
        let up =
            args.up.unwrap_or(if is_gltf || extension == "obj" { UpAxis::Y } else { UpAxis::Z });
        // Millimetres are the middle of all units, so that meshes in the largest and the smallest
        // unit can be read.
        let mesh = args.read(Unit::Mm.metres_per_unit())?;
        let extent = |mesh: &Mesh| {
            let (low, high) = mesh.bounds();
            high - low
        };
        let unit = args.unit.or(is_gltf.then_some(Unit::M));
        let (unit, scale) =
            placement::propose_size(extent(&mesh).max() / Unit::Mm.metres_per_unit(), unit);
        let mesh = mesh.scaled(unit.metres_per_unit() * scale / Unit::Mm.metres_per_unit());
        let size_mm = (extent(&mesh) * 1e3).into();
        let facing = if is_gltf { ObjectAxes::of_gltf(up) } else { ObjectAxes::of(up) };
        let rotation_deg = placement::rotation_deg(facing, args.side);
        let turned = mesh.transformed(&pose([0.0; 3], rotation_deg));
        let position_m = placement::position_m(&turned);
        let bvh = MeshBvh::new(turned.transformed(&pose(position_m, [0.0; 3])));
        let found = placement::propose_zone(&bvh).with_context(|| {
            format!(
                "{}: no surface visible from that side; try another --side or --up",
                args.mesh.display()
            )
        })?;
        Ok(Self { up, unit, scale, size_mm, position_m, rotation_deg, found })
    }

    /// Returns the scene as commented TOML.
    fn scene(
        &self,
        args: &Args,
        FingerTemplate { body, scene, .. }: &FingerTemplate,
    ) -> anyhow::Result<String> {
        let Self { unit, scale, position_m, rotation_deg, found, .. } = self;
        let ZoneProposal { zone, fill_fraction: filled } = found;
        let mesh = match args.mesh.is_relative() && args.is_here() {
            true => args.mesh.clone(),
            false => std::path::absolute(&args.mesh)?,
        };
        let mesh = toml::Value::from(mesh.to_string_lossy().into_owned());
        let [x_m, z_m] = [zone.x_m, zone.z_m.unwrap_or_default()];
        let outside =
            if args.allow_external_buffers { "allow_external_buffers = true\n" } else { "" };
        let datum_y_m = zone.datum_y_m();
        let depth_m = zone.depth_m.unwrap_or_default();
        Ok(format!(
            "# Scene of {}, generated by `palpate new`; change any number.\n\
             simulator = \"{body}\"\n\n\
             [object]\n\
             mesh = {mesh}\n\
             unit = \"{unit}\"                 # of the file's numbers: m, cm, mm, um, in\n\
             scale = {scale:?}                 # applied after the unit\n{outside}\
             position_m = {position_m:?}    # of the mesh's origin, in the frame of the robot's base\n\
             rotation_deg = {rotation_deg:?}    # about the base's x, then y, then z: the finger touches the side facing +y\n\n\
             [zone]                      # touched along -y; {:.0} % of it has a surface\n\
             x_m = {x_m:?}\n\
             z_m = {z_m:?}\n\
             datum_y_m = {datum_y_m:?}          # zero of the heights: the middle of the surface\n\
             depth_m = {depth_m:?}    # nearest and farthest -y of possible contact\n{scene}",
            args.mesh.file_name().unwrap_or_default().to_string_lossy(),
            100.0 * filled,
        ))
    }

    /// Describes the guesses for the terminal.
    fn words(&self, args: &Args) -> String {
        let Self { up, unit, scale, size_mm: [x, y, z], found, .. } = self;
        let scaled = match *scale {
            1.0 => String::new(),
            scale => format!(", scaled by {scale} to fit a finger"),
        };
        let [width, height] = [found.zone.x_m, found.zone.z_m.unwrap_or_default()]
            .map(|[low, high]| 1e3 * (high - low));
        let [near, far] = found.zone.depth_m.unwrap_or_default();
        format!(
            "{}: unit {unit}{scaled}: {x:.1} x {y:.1} x {z:.1} mm, {} up; its {} faces the finger\n\
             zone {width:.0} x {height:.0} mm, {:.0} mm deep, {:.0} % of it has a surface",
            args.mesh.display(),
            value_name(up),
            value_name(&args.side),
            1e3 * (far - near),
            100.0 * found.fill_fraction
        )
    }
}

/// Returns the command-line name of a value.
fn value_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().into())
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
         kernel = [\"squared_exponential\", \"matern_52\"]\n\
         noise = [1e-4, 1e-1]\n\
         band = \"leave_one_out\"\n\
         free_space = true\n{gp}"
    )
}
