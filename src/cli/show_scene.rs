//! Description of a scene: `palpate show SCENE`.

use super::camera;
use super::prepare::{prepare_environment, prepare_simulator};
use super::slow_steps::report_slow_steps;
use super::terminal::Verbosity;
use crate::experiment::metrics::shape::TrueShape;
use crate::experiment::metrics::truth::Truth;
use crate::experiment::notice;
use crate::experiment::store;
use crate::report::files::write_as;
use crate::report::scene::picture;
use crate::sim::environment::ObjectShape;
use crate::sim::{Environment, Scene, mjcf};
use anyhow::{Context, bail, ensure};
use palpate_explore::task::Ball;
use palpate_input::tables;
use std::path::Path;

/// Test points along each side of the zone, for the summary of a scene's heights.
const GRID: usize = 41;

/// Files to write of a scene.
pub(super) struct SceneFiles<'a> {
    /// MJCF, the format of MuJoCo.
    pub mjcf: Option<&'a Path>,
    /// Object with its zone, or the reachable surface of a whole object.
    pub picture: Option<&'a Path>,
    /// View of the depth camera.
    pub camera: Option<&'a Path>,
    /// The scene and its robot, rendered by MuJoCo.
    pub render: Option<&'a Path>,
}

/// Describes a scene, and writes the files that the command asks for.
pub(super) fn describe(scene: Scene, files: SceneFiles, talk: Verbosity) -> anyhow::Result<String> {
    let mut text = tables::text(&scene).context("cannot write the scene")?;
    let environment = prepare_environment(scene, talk)?;
    prepare_simulator(&environment, talk)?;
    let whole_object = environment.task().ball().map(|ball| (ball, shape(&environment, talk)));
    text += &match &whole_object {
        Some((ball, shape)) => whole_object_summary(ball, shape.as_ref(), talk),
        None => zone_summary(&environment, talk),
    };
    if let ObjectShape::Mesh { report, .. } = environment.shape() {
        text += &format!("{report}\n");
    }
    if let Some(path) = files.picture {
        let shape = whole_object.as_ref().and_then(|(_, shape)| shape.as_ref());
        let spots = shape.map(TrueShape::reachable_samples).unwrap_or_default();
        let height_m = |place: &[f64]| environment.true_height_m(place);
        let svg = picture(environment.task(), environment.mesh(), &height_m, &spots);
        let svg = svg.context("--picture: this scene has no object to draw")?;
        write_as(path, &svg)?;
        text += &format!("picture: {}\n", path.display());
    }
    if let Some(path) = files.camera {
        text += &camera::draw(&environment, path)?;
    }
    if let Some(model) = mjcf::scene(&environment, mjcf::ModelPurpose::Picture) {
        text += &report_slow_steps(talk, |tell| {
            tell("compiling the scene");
            compiled(&model)
        });
        if let Some(path) = files.mjcf {
            store::write_whole(path, &model)?;
            text += &format!("\nMJCF: {}", path.display());
        }
        if let Some(path) = files.render {
            draw(&model, path)?;
            text += &format!("\npicture: {}", path.display());
        }
    } else if files.mjcf.is_some() || files.render.is_some() {
        ensure!(
            environment.task().ball().is_none(),
            "a stage that turns the finger around an object has no MuJoCo model; allowed is a scene \
             with [arm]"
        );
        if let Some(error) = environment.missing_masses() {
            return Err(error.into());
        }
        bail!("this scene has no mesh to write as MJCF or to draw");
    }
    Ok(text)
}

/// Describes the reachable surface of one side of the object.
fn zone_summary(environment: &Environment, talk: Verbosity) -> String {
    let truth = report_slow_steps(talk, |tell| {
        tell("finding the reachable surface");
        Truth::sample(environment, GRID, &|_| ())
    });
    notice::truth_notices(environment.task().zone(), &truth)
        .iter()
        .for_each(|notice| talk.note(notice));
    let (count, places) = (truth.surface_count(), truth.places.len());
    let mut text = format!("\nsurface in the zone: {count} of {places} test points");
    if let Some([low, high]) = truth.span_m() {
        text += &format!(", heights {:.2} to {:.2} mm above the datum", low * 1e3, high * 1e3);
    }
    text + &format!("; the finger can touch {} of them\n", truth.reachable_count())
}

/// True surface of a whole object, with its reachable part.
fn shape(environment: &Environment, talk: Verbosity) -> Option<TrueShape> {
    report_slow_steps(talk, |tell| {
        tell("finding the reachable surface");
        TrueShape::from_environment(environment)
    })
}

/// Describes the reachable surface of a whole object.
fn whole_object_summary(ball: &Ball, shape: Option<&TrueShape>, talk: Verbosity) -> String {
    let [x, y, z]: [f64; 3] = ball.centre_w.into();
    let radius_mm = 1e3 * ball.radius_m;
    let mut text = format!("\nball: {radius_mm:.2} mm about [{x:.4}, {y:.4}, {z:.4}] m");
    if let Some(share) = shape.and_then(TrueShape::reachable_share) {
        text += &format!("; the finger can touch {:.1} % of the surface", 100.0 * share);
    }
    shape.and_then(notice::shape_notice).iter().for_each(|notice| talk.note(notice));
    text + "\n"
}

#[cfg(feature = "mujoco")]
fn compiled(mjcf: &str) -> String {
    use crate::sim::mujoco;
    match mujoco::compile(mjcf) {
        Ok(model) => format!(
            "MuJoCo {} compiles the scene: {} geoms, {} mesh vertices, {} mesh triangles",
            mujoco::version(),
            model.ngeom(),
            model.nmeshvert(),
            model.nmeshface()
        ),
        Err(error) => error.to_string(),
    }
}

#[cfg(not(feature = "mujoco"))]
fn compiled(_: &str) -> String {
    "this build has no MuJoCo (feature `mujoco`)".into()
}

#[cfg(feature = "render")]
fn draw(mjcf: &str, path: &Path) -> anyhow::Result<()> {
    use crate::sim::mujoco;
    let model = mujoco::compile(mjcf)?;
    Ok(mujoco::picture::picture(&model, "whole", path)?)
}

#[cfg(not(feature = "render"))]
fn draw(_: &str, _: &Path) -> anyhow::Result<()> {
    bail!("this build cannot render; build with --features render")
}
