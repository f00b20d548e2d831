//! Beliefs of a run as meshes and films.

#[cfg(feature = "pictures")]
use super::animation;
use super::points::PointCloud;
use super::replay::{self, BeliefReplay};
use super::{figures, files, film, style, whole_object};
use crate::experiment::store::{Run, write_whole};
use anyhow::{Context, bail, ensure};
use nalgebra::Vector3;
use palpate_explore::task::zone::grid_triangles;
use palpate_gp::posterior::Scratch;
use palpate_input::format::counted;
use std::path::Path;

/// Allowed cells of a belief around an object, as for `gp.cells`.
const CELLS: std::ops::RangeInclusive<usize> = 8..=256;

/// File format of a belief.
pub enum Format {
    /// Mesh, with the function that formats it.
    Mesh(fn(&PointCloud) -> String),
    /// Film.
    Film(FilmFormat),
}

/// File format of a film.
#[derive(Clone, Copy, PartialEq)]
pub enum FilmFormat {
    /// GIF.
    Gif,
    /// MP4, which needs ffmpeg.
    Mp4,
}

/// Endings of the files.
pub const ENDINGS: &str = ".ply or .obj (mesh), .gif or .mp4 (film)";

impl Format {
    /// Returns the format of a file by its ending.
    ///
    /// # Errors
    /// If the ending is not allowed.
    pub fn of(out: &Path) -> anyhow::Result<Self> {
        Ok(match out.extension().and_then(|extension| extension.to_str()) {
            Some("ply") => Self::Mesh(PointCloud::ply),
            Some("obj") => Self::Mesh(PointCloud::obj),
            Some("gif") => Self::Film(FilmFormat::Gif),
            Some("mp4") => Self::Film(FilmFormat::Mp4),
            _ => bail!("--out {}: allowed is a file ending in {ENDINGS}", out.display()),
        })
    }
}

/// Returns the error that a film cannot be written.
///
/// # Errors
/// Always, in this build.
#[cfg(not(feature = "pictures"))]
pub fn film(
    _: &Run,
    _: &str,
    _: u32,
    _: FilmFormat,
    out: &Path,
    _: &dyn Fn(&str),
) -> anyhow::Result<String> {
    bail!("--out {}{}", out.display(), files::NEEDS_PICTURES)
}

/// Writes the film of the drawn trial of `planner` up to some touches, and describes it. `tell` is
/// called before a slow step.
///
/// # Errors
/// If there is no fit, or the file cannot be written.
#[cfg(feature = "pictures")]
pub fn film(
    run: &Run,
    planner: &str,
    touches: u32,
    format: FilmFormat,
    out: &Path,
    tell: &dyn Fn(&str),
) -> anyhow::Result<String> {
    let row = replay::row(run, planner).context("the trial is missing")?;
    let counts = film::counts(run, row, touches);
    let (Some(first), Some(last)) = (counts.first(), counts.last()) else {
        bail!("{planner} has no fit in trial {} up to {touches} touches", row.trial);
    };
    if format == FilmFormat::Mp4 {
        animation::check_ffmpeg()?;
    }
    tell(&format!("drawing {} frames", counts.len()));
    let drawings = film::drawings(run, planner, &counts)?;
    match format {
        FilmFormat::Mp4 => animation::mp4(&drawings, out)?,
        FilmFormat::Gif => write_whole(out, animation::gif(&drawings)?)?,
    }
    let megabytes = std::fs::metadata(out).map_or(0.0, |file| file.len() as f64 / 1e6);
    Ok(format!(
        "{}: {} frames, {first} to {last} touches of {planner}, {megabytes:.1} MB\n{}",
        out.display(),
        counts.len(),
        film::rank_words(run, planner, row.trial),
    ))
}

/// Writes the belief of `planner` in the drawn trial after some touches as a mesh, with a picture,
/// and describes it. `side` is the number of cells or vertices along each side, by default that of
/// the experiment.
///
/// # Errors
/// If there is no fit or no surface, the number of cells is not allowed, or a file cannot be
/// written.
pub fn mesh(
    mut run: Run,
    planner: &str,
    touches: u32,
    side: Option<usize>,
    write: fn(&PointCloud) -> String,
    out: &Path,
) -> anyhow::Result<String> {
    let is_around = run.experiment.scene.whole_object.is_some();
    let (mesh, score) = match is_around {
        true => closed_surface(&mut run, planner, touches, side)?,
        false => zone_surface(&run, planner, touches, side)?,
    };
    write_whole(out, write(&mesh))?;
    let figure = if is_around { figures::SOLIDS } else { figures::SURFACES };
    if let Some(svg) = (figure.draw)(&run)? {
        files::write(out, &svg)?;
    }
    let score = if score.is_empty() { score } else { format!("; {score}") };
    let largest_m = mesh.deviations.iter().map(|(sd_m, _)| *sd_m).fold(0.0, f64::max);
    Ok(format!(
        "{}: {} vertices, {} triangles, sigma up to {:.3} mm{score}\n{}\npicture: {}",
        out.display(),
        mesh.points.len(),
        mesh.triangles.len(),
        1e3 * largest_m,
        film::rank_words(&run, planner, run.experiment.report.trial),
        out.with_extension("svg").display()
    ))
}

/// Closed mean surface of an object, and its error.
fn closed_surface(
    run: &mut Run,
    planner: &str,
    touches: u32,
    side: Option<usize>,
) -> anyhow::Result<(PointCloud, String)> {
    if let Some(cells) = side {
        ensure!(
            CELLS.contains(&cells),
            "--grid {cells}: allowed are {} to {} cells around an object",
            CELLS.start(),
            CELLS.end()
        );
        run.experiment.space.cells = u32::try_from(cells)?;
    }
    let of = || format!("{planner} has no fit after {}", counted(touches, "touch"));
    let row = replay::row(run, planner).with_context(of)?;
    let truth = whole_object::truth(run);
    let frame = whole_object::frame(&run.experiment, row, touches, truth.as_ref(), usize::MAX)?;
    let frame = frame.with_context(of)?;
    ensure!(
        !frame.mesh.1.is_empty(),
        "the belief of {planner} contains no surface after {}",
        counted(touches, "touch")
    );
    let mut comments = vec![
        title(run, planner, touches),
        "sigma_m: standard deviation of the surface along its normal".into(),
    ];
    if !frame.error_m.is_empty() {
        comments.push("error_m: signed distance to the true surface, negative inside".into());
    }
    Ok((frame.points(comments), frame.score))
}

/// Belief over a zone as a mesh, and its error.
fn zone_surface(
    run: &Run,
    planner: &str,
    touches: u32,
    side: Option<usize>,
) -> anyhow::Result<(PointCloud, String)> {
    let replay = BeliefReplay::new(run, planner, touches)?
        .with_context(|| format!("{planner} has no fit after {}", counted(touches, "touch")))?;
    let grid = side.unwrap_or(run.experiment.grid as usize);
    Ok((surface(run, planner, &replay, grid), replay.score()))
}

/// First comment line of an exported file.
fn title(run: &Run, planner: &str, touches: u32) -> String {
    format!(
        "Palpate {}: belief of {} in trial {} of {} after {}",
        env!("CARGO_PKG_VERSION"),
        planner,
        run.experiment.report.trial,
        run.experiment.name,
        counted(touches, "touch"),
    )
}

/// Posterior mean as a surface in `W`, where a surface is more likely than none.
fn surface(run: &Run, planner: &str, replay: &BeliefReplay, grid: usize) -> PointCloud {
    let zone = replay.belief.zone();
    let places = zone.grid(grid);
    let known = replay.is_drawn(places.iter().map(Vec::as_slice));
    // Index of the vertex at each place that has one.
    let mut count = 0..;
    let vertices: Vec<Option<usize>> =
        known.iter().map(|known| known.then(|| count.next()).flatten()).collect();
    let places: Vec<Vec<f64>> =
        places.into_iter().zip(known).filter(|(_, known)| *known).map(|(place, _)| place).collect();
    let predictions = replay.surface.predict(places.iter().map(Vec::as_slice));
    let mut scratch = Scratch::default();
    let mut slope = [0.0; 2];
    let r_wz = zone.x_wz().rotation;
    let points = places.iter().zip(&predictions).map(|(place, prediction)| {
        replay.surface.mean_gradient(place, &mut slope, &mut scratch);
        let normal_z = Vector3::new(-slope[0], 1.0, -slope[1]).normalize();
        (zone.point(place, prediction.mean), r_wz * normal_z)
    });
    let points = points.collect();
    let deviations_m: Vec<f64> = predictions.iter().map(|p| p.variance.sqrt()).collect();
    let largest_m = deviations_m.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let colour = |deviation_m: f64| style::deviation_rgb(deviation_m / largest_m);
    let joined = grid_triangles(grid, grid)
        .filter_map(|[a, b, c]| Some([vertices[a]?, vertices[b]?, vertices[c]?]));
    PointCloud {
        comments: vec![
            title(run, planner, replay.touches.len() as u32),
            zone.frame_description(),
            "sigma_m: standard deviation of the height along the approach".into(),
        ],
        points,
        deviations: deviations_m.iter().map(|&sd_m| (sd_m, colour(sd_m))).collect(),
        triangles: joined.collect(),
        ..PointCloud::default()
    }
}
