//! Scene and experiment of a mesh: its placement, and the files as commented TOML.

use super::choices::{self, Asker, Choice, label, name};
use crate::sim::placement::{self, ObjectAxes, ObjectSide, UpAxis, ZoneProposal};
use crate::sim::scene::Unit;
use anyhow::{Context, ensure};
use palpate_explore::robot::finger::shape::BIOTAC_RADIUS_M;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::holes::Hole;
use palpate_geometry::import::{import_with, statements};
use palpate_geometry::mesh::Mesh;
use palpate_gp::math::pose::pose;
use palpate_input::paths::relative;
use palpate_input::shipped;
use std::path::{Path, PathBuf};

/// Mesh, and the choices that the user makes about it.
pub struct MeshOptions {
    /// Mesh file.
    pub mesh: PathBuf,
    /// Folder of the files, to which a path of the mesh is relative that is given relative to the
    /// working folder; `None` for the whole path.
    pub folder: Option<PathBuf>,
    /// Whether the whole object is explored, instead of a zone on one side.
    pub is_around: bool,
    /// Side that faces the finger.
    pub side: ObjectSide,
    /// Up axis of the file; `None` decides by its evidence.
    pub up: Option<UpAxis>,
    /// Unit of the file's numbers; `None` decides by its evidence.
    pub unit: Option<Unit>,
    /// Finger that touches the object.
    pub finger: FingerKind,
    /// Whether a glTF mesh may read buffers outside its own folder.
    pub allow_external_buffers: bool,
}

/// Kinds of finger that can touch the object.
#[derive(Clone, Copy, Default, PartialEq, clap::ValueEnum)]
pub enum FingerKind {
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
    /// Approximate run time of the experiment.
    pub fn run_time(self, is_around: bool) -> &'static str {
        self.template(is_around).takes
    }

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

/// Smallest size of an object; a heuristic, a seventh of the finger's radius.
const SMALLEST_M: f64 = 1e-3;

/// Placement of a mesh in a scene, with the choices that led to it.
pub struct MeshPlacement {
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
    /// Places the mesh; `asker` settles what is ambiguous.
    ///
    /// # Errors
    /// If the mesh cannot be read, is too small, or has no surface on the side.
    pub fn new(options: &MeshOptions, asker: Asker) -> anyhow::Result<Self> {
        let extension =
            options.mesh.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let is_gltf = ["gltf", "glb"].contains(&extension.as_str());
        // Millimetres are the middle of all units, so that meshes in the largest and the smallest
        // unit can be read.
        let read_m = Unit::Mm.metres_per_unit();
        let (mesh, report) = import_with(&options.mesh, read_m, options.allow_external_buffers)?;
        let stated = statements(&options.mesh);
        let extent = |mesh: &Mesh| {
            let (low, high) = mesh.bounds();
            high - low
        };
        let unit = choices::unit(
            extent(&mesh).max() / read_m,
            extension == "stl",
            options.unit,
            &stated,
            asker,
        );
        let up = choices::up(&mesh, options.up, &stated, asker);
        let (metres_per_unit, scale) = (unit.value.0.metres_per_unit(), unit.value.1);
        let size_m = extent(&mesh).max() / read_m * metres_per_unit * scale;
        ensure!(
            size_m >= SMALLEST_M,
            "{}: in {} the object measures {:.1e} m; allowed is at least {SMALLEST_M} m: use another --unit",
            options.mesh.display(),
            label(unit.value.0),
            size_m
        );
        let mesh = mesh.with_patches(&report.holes).scaled(metres_per_unit * scale / read_m);
        let size_mm = (extent(&mesh) * 1e3).into();
        let axes = if is_gltf { ObjectAxes::of_gltf(up.value) } else { ObjectAxes::of(up.value) };
        let rotation_deg = placement::rotation_deg(axes, options.side);
        let turned = mesh.transformed(&pose([0.0; 3], rotation_deg));
        let position_m = match (options.is_around, options.finger) {
            (false, _) => placement::position_m(&turned),
            (true, FingerKind::Arm) => placement::centred_m(&turned, placement::ARM_CENTRE_M),
            (true, _) => placement::centred_m(&turned, placement::STAGE_CENTRE_M),
        };
        let placed = turned.transformed(&pose(position_m, [0.0; 3]));
        let lowest_m = placed.bounds().0.z;
        let found = match options.is_around {
            true => None,
            false => Some(placement::propose_zone(&MeshBvh::new(placed)).with_context(|| {
                format!(
                    "{}: no surface visible from that side; try another --side or --up",
                    options.mesh.display()
                )
            })?),
        };
        let holes = report.holes;
        Ok(Self { up, unit, size_mm, position_m, rotation_deg, lowest_m, found, holes })
    }

    /// Returns the scene as commented TOML.
    ///
    /// # Errors
    /// If the working folder is unknown.
    pub fn scene(&self, options: &MeshOptions) -> anyhow::Result<String> {
        let FingerTemplate { body, scene, .. } = options.finger.template(options.is_around);
        let Self { unit, position_m, rotation_deg, .. } = self;
        let (unit, scale) = unit.value;
        let mesh = match options.folder.as_deref().filter(|_| options.mesh.is_relative()) {
            Some(folder) if folder == Path::new(".") => options.mesh.clone(),
            folder => {
                let whole = options.mesh.canonicalize()?;
                let beside = folder.map(|folder| Ok(relative(&whole, &folder.canonicalize()?)));
                let beside = beside.unwrap_or_else(|| std::path::absolute(&options.mesh));
                shipped::portable(&whole).map_or(beside, Ok)?
            }
        };
        let mesh = toml::Value::from(mesh.to_string_lossy().into_owned());
        let mut others = String::new();
        if options.allow_external_buffers {
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
            options.mesh.file_name().unwrap_or_default().to_string_lossy(),
            self.region(options),
        ))
    }

    /// Returns the table of the zone or of the whole object.
    fn region(&self, options: &MeshOptions) -> String {
        let Some(ZoneProposal { zone, fill_fraction }) = &self.found else {
            let lowest = match options.finger {
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
    pub fn narrow_zone(&self, options: &MeshOptions) -> Option<String> {
        let zone = &self.found.as_ref()?.zone;
        let sides_m = zone.extents_m();
        let narrowest_m = sides_m.iter().copied().fold(f64::INFINITY, f64::min);
        (narrowest_m < 2.0 * BIOTAC_RADIUS_M).then(|| {
            let sides = sides_m.iter().map(|side_m| format!("{:.0}", 1e3 * side_m));
            format!(
                "the zone on the object's {} ({} mm) is narrower than the finger ({:.0} mm): try another \
                 --side (top, left, …), or --around",
                name(&options.side),
                sides.collect::<Vec<_>>().join(" x "),
                2e3 * BIOTAC_RADIUS_M
            )
        })
    }

    /// Describes the choices for the terminal.
    pub fn words(&self, options: &MeshOptions) -> String {
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
            options.mesh.display(),
            name(&options.side),
            label(*unit),
            name(&up.value),
            up.evidence,
        )
    }
}

/// Returns the experiment `name` on the scene as commented TOML.
pub fn experiment(options: &MeshOptions, name: &str, scene: &str) -> String {
    match options.is_around {
        true => whole_object_text(name, scene),
        false => zone_text(name, scene, options.finger.template(false).gp),
    }
}

fn zone_text(name: &str, scene: &str, gp: &str) -> String {
    format!(
        "name = \"{name}\"\n\
         question = \"Which planner explores {name} best?\"\n\
         scene = \"{scene}\"\n\
         planners = [\"expected_contact\", \"active\", \"sobol\", \"random\"]\n\
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
