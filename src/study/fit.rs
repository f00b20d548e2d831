//! Fit of a surface to recorded contacts, without a scene, and its error on held-out groups.

use crate::experiment::contact_log::{ContactLog, LoggedTouch};
use anyhow::{Context, ensure};
use nalgebra::{Point3, Vector3};
use palpate_explore::belief::{Belief, Deviation, HeightField};
use palpate_explore::evidence::{Contact, ErrorSource, Evidence, SurfacePoints};
use palpate_explore::gp_settings::{GpSettings, Kernels};
use palpate_explore::robot::Finger;
use palpate_explore::robot::sensor::TipSurface;
use palpate_explore::task::touch::TouchSettings;
use palpate_explore::task::{Ball, Task, Zone};
use palpate_explore::whole_object::settings::PriorShape;
use palpate_explore::whole_object::{ExplorationSetup, ImplicitSurface, SpatialGpSettings};
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::primitives::extent;
use palpate_gp::MeanModel;
use palpate_gp::math::normal::{BAND_95, band_factor};
use rayon::prelude::*;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};

/// Contacts to fit, and the kind of surface.
pub struct FitSpec<'a> {
    /// Contacts and misses.
    pub log: &'a ContactLog,
    /// Axis of the file along which the surface is a height field; `None` for a closed surface
    /// around a whole object.
    pub heights: Option<HeightAxis>,
}

/// Axis of a file along which heights rise, read from its name.
#[derive(Clone, Copy, Debug)]
pub struct HeightAxis {
    /// Rotation about the fixed axes x, then y, then z, deg, that turns y into it.
    rotation_deg: [f64; 3],
}

/// Axes by name, with their rotations.
const AXES: [(&str, [f64; 3]); 6] = [
    ("x", [0.0, 0.0, -90.0]),
    ("y", [0.0; 3]),
    ("z", [90.0, 0.0, 0.0]),
    ("-x", [0.0, 0.0, 90.0]),
    ("-y", [180.0, 0.0, 0.0]),
    ("-z", [-90.0, 0.0, 0.0]),
];

impl FromStr for HeightAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = AXES.iter().find(|(name, _)| *name == text);
        found
            .map(|(_, rotation_deg)| Self { rotation_deg: *rotation_deg })
            .ok_or_else(|| "allowed are x, y, z, -x, -y and -z".into())
    }
}

/// A fitted surface.
pub struct FitResult {
    /// Belief, whose deviations are multiplied by `sd_factor`.
    pub belief: Belief,
    /// Contacts, each predicted without its group.
    pub held_out: Vec<HeldOut>,
    /// Factor on the deviations with which 95 % of the held-out contacts are in the band; at least
    /// 1.
    pub sd_factor: f64,
    /// Numbers of contacts used, and in the log.
    pub counts: [usize; 2],
    /// Share of the normals that point towards the middle of the object, or down from a surface of
    /// heights.
    pub inward: f64,
    /// Whether the groups are those of the log; otherwise every so many contacts are one.
    pub has_groups: bool,
}

/// A contact, predicted from all other groups.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// Its group.
    pub group: String,
    /// Point of contact.
    pub p_w: Point3<f64>,
    /// Predicted distance outside the surface, with the standard deviation of a touch, m,
    /// multiplied by the factor of the other groups.
    pub deviation: Deviation,
    /// Distance from the estimated surface, m.
    pub distance_m: f64,
}

impl HeldOut {
    /// Whether it is within the 95 % band.
    pub fn is_covered(&self) -> bool {
        self.deviation.mean_m.abs() <= BAND_95 * self.deviation.sd_m
    }
}

impl FitResult {
    /// Root mean square distance of the held-out contacts from the surface, m; `None` without any.
    pub fn rms_m(&self) -> Option<f64> {
        let squares: f64 = self.held_out.iter().map(|it| it.distance_m.powi(2)).sum();
        (!self.held_out.is_empty()).then(|| (squares / self.held_out.len() as f64).sqrt())
    }

    /// Share of the held-out contacts within the 95 % band; `None` without any.
    pub fn coverage(&self) -> Option<f64> {
        let covered = self.held_out.iter().filter(|it| it.is_covered()).count();
        (!self.held_out.is_empty()).then(|| covered as f64 / self.held_out.len() as f64)
    }

    /// Standard deviation of an error that contacts of a group have in common, m, where it was
    /// learned.
    pub fn common_m(&self) -> Option<f64> {
        self.belief.fit()?.hyperparameters.common_sd
    }
}

/// Largest number of contacts that are used, and of groups that are left out in turn.
// heuristic: half a minute on two cores.
const CONTACTS_MAX: usize = 600;
const FOLDS_MAX: usize = 40;

/// Number of groups in which contacts without groups are left out.
const FOLDS: usize = 20;

/// Radius of the ball in which the object may be, over half of the contacts' diagonal, and part of
/// its sides by which a zone is larger than the contacts.
// heuristics: an object is hardly touched all around; a tenth of an edge beyond.
const ROOMIER: f64 = 1.5;
const BEYOND: f64 = 0.05;

/// Cells along the longest side of a surface from which distances are measured.
// heuristic: a few per cent of the object.
const CELLS: u32 = 40;

/// Fits a surface; `None` if `stop` became true. `progress` is called with the number of groups
/// that were left out, and of all.
///
/// # Errors
/// If there are fewer than three contacts, or their covariance cannot be factored.
pub fn run(
    spec: &FitSpec,
    stop: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> anyhow::Result<Option<FitResult>> {
    let ContactLog { touches, has_groups, .. } = spec.log;
    let all = touches.iter().filter(|touch| touch.contact.is_some()).count();
    let step = all.div_ceil(CONTACTS_MAX).max(1);
    let mut number = 0..;
    let used: Vec<&LoggedTouch> = touches
        .iter()
        .filter(|touch| touch.contact.is_none() || number.next().is_some_and(|n| n % step == 0))
        .collect();
    let contacts: Vec<&Contact> = used.iter().filter_map(|it| it.contact.as_ref()).collect();
    ensure!(contacts.len() >= 3, "{} contacts: allowed are 3 or more", contacts.len());
    let model = Model::new(spec, &contacts)?;
    let folds = folds(&used, *has_groups);
    let count = folds.iter().max().map_or(0, |last| last + 1);
    let done = std::sync::atomic::AtomicUsize::new(0);
    let predicted = (0..count).into_par_iter().map(|fold| -> anyhow::Result<Vec<HeldOut>> {
        if stop.load(Ordering::Relaxed) {
            return Ok(Vec::new());
        }
        let kept = used.iter().zip(&folds).filter(|(_, of)| **of != fold).map(|(it, _)| *it);
        let belief = model.belief(kept, 1.0)?;
        let out = used.iter().zip(&folds).filter(|(_, of)| **of == fold).map(|(it, _)| *it);
        let found = held_out(&belief, out);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, count);
        Ok(found)
    });
    let predicted: Vec<Vec<HeldOut>> =
        if count < 2 { Vec::new() } else { predicted.collect::<anyhow::Result<_>>()? };
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let z = |fold: &Vec<HeldOut>| -> Vec<f64> {
        fold.iter().map(|it| it.deviation.mean_m / it.deviation.sd_m).collect()
    };
    let zs: Vec<Vec<f64>> = predicted.iter().map(z).collect();
    let sd_factor = if zs.is_empty() { 1.0 } else { band_factor(&zs.concat()) };
    // A group is not to choose the factor that it tests.
    let calibrated = predicted.into_iter().enumerate().flat_map(|(fold, held_out)| {
        let others = zs.iter().enumerate().filter(|(of, _)| *of != fold).flat_map(|(_, z)| z);
        let factor = band_factor(&others.copied().collect::<Vec<_>>());
        held_out.into_iter().map(move |it| {
            let Deviation { mean_m, sd_m } = it.deviation;
            HeldOut { deviation: Deviation { mean_m, sd_m: factor * sd_m }, ..it }
        })
    });
    let held_out = calibrated.collect();
    let belief = model.belief(used.iter().copied(), sd_factor)?;
    let counts = [contacts.len(), all];
    let measured: Vec<&Contact> = contacts.iter().copied().filter(|it| it.has_normal).collect();
    let is_inward = |it: &&&Contact| it.normal_w.dot(&model.outward(&it.p_wc)) < 0.0;
    let inward = measured.iter().filter(is_inward).count() as f64 / measured.len().max(1) as f64;
    let has_groups = *has_groups;
    Ok(Some(FitResult { belief, held_out, sd_factor, counts, inward, has_groups }))
}

/// Returns the fold in which each touch is left out: its group, or that of several groups.
fn folds(touches: &[&LoggedTouch], has_groups: bool) -> Vec<usize> {
    if !has_groups {
        let count = FOLDS.min(touches.len());
        return (0..touches.len()).map(|number| number % count.max(1)).collect();
    }
    let mut groups: Vec<&str> = Vec::new();
    let numbers = touches.iter().map(|touch| {
        let known = groups.iter().position(|group| *group == touch.group);
        known.unwrap_or_else(|| {
            groups.push(&touch.group);
            groups.len() - 1
        })
    });
    numbers.map(|number| number % FOLDS_MAX).collect()
}

/// Region and settings of a fit, which all folds share.
enum Model {
    Ball { scope: ExplorationSetup, settings: SpatialGpSettings },
    Zone { zone: Zone, settings: Box<GpSettings> },
}

impl Model {
    fn new(spec: &FitSpec, contacts: &[&Contact]) -> anyhow::Result<Self> {
        let points = contacts.iter().map(|contact| &contact.p_wc);
        let [low, high] = extent(points.clone()).context("no contact")?;
        ensure!((high - low).norm() > 1e-6, "all contacts are at one place: allowed are several");
        let has_normals = contacts.iter().any(|contact| contact.has_normal);
        if let Some(axis) = spec.heights {
            return Ok(Self::over(axis, contacts, has_normals));
        }
        let radius_m = ROOMIER * 0.5 * (high - low).norm();
        let ball = Ball { centre_w: nalgebra::center(&low, &high), radius_m, lowest_m: None };
        let radii_m =
            spec.log.touches.iter().filter_map(|it| Some(it.free.as_ref()?.finger.radius_m));
        let finger = Finger {
            // heuristic: without a path a finger is as thin as a probe.
            radius_m: radii_m.reduce(f64::min).unwrap_or(1e-3),
            length_m: 0.0,
            ..Finger::default()
        };
        let task = Task::new(ball, TouchSettings::default(), &finger)?;
        let scope = ExplorationSetup::new(ball, &task, &TipSurface::Rigid);
        let has_free = spec.log.touches.iter().any(|touch| touch.free.is_some());
        let shown = SpatialGpSettings {
            // heuristic: up to twice the signal, because a hand errs by a part of its object.
            noise: [1e-3, 2.0],
            sd_inflation: 1.0,
            ..SpatialGpSettings::default()
        };
        let settings = match has_normals || has_free {
            true => shown,
            // heuristic: a contact shows the surface in its own direction, at least.
            false => SpatialGpSettings {
                kernel: "matern_32".into(),
                prior: PriorShape::Star,
                length_scale: [0.3, 2.5],
                ..shown
            },
        };
        Ok(Self::Ball { scope, settings })
    }

    /// Returns the model of a height field along an axis of the file.
    fn over(axis: HeightAxis, contacts: &[&Contact], has_normals: bool) -> Self {
        let zone =
            Zone { rotation_deg: axis.rotation_deg, ..Zone::new([0.0, 1.0], Some([0.0, 1.0])) };
        let points: Vec<Point3<f64>> =
            contacts.iter().map(|it| zone.x_wz().inverse_transform_point(&it.p_wc)).collect();
        let side = |axis: usize| {
            let [low, high] = points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |ends, p| {
                [ends[0].min(p[axis]), ends[1].max(p[axis])]
            });
            let beyond = (BEYOND * (high - low)).max(1e-5);
            [low - beyond, high + beyond]
        };
        let mean_m = points.iter().map(|p| p.y).sum::<f64>() / points.len() as f64;
        let zone = Zone { x_m: side(0), z_m: Some(side(2)), datum_y_m: Some(mean_m), ..zone };
        let settings = GpSettings {
            kernel: Kernels::One("matern_52".into()),
            mean: MeanModel::Constant,
            // heuristics: as for a zone, with lengths and noise of a surface that is nearly flat.
            length_scale: [0.02, 3.0],
            noise: [1e-3, 1e1],
            normals: has_normals,
            ..GpSettings::default()
        };
        Self::Zone { zone, settings: Box::new(settings) }
    }

    /// Returns the belief after `touches`, with deviations times `sd_factor`.
    fn belief<'a>(
        &self,
        touches: impl Iterator<Item = &'a LoggedTouch>,
        sd_factor: f64,
    ) -> anyhow::Result<Belief> {
        let evidence = evidence(touches, |p_w| self.outward(p_w));
        let mut belief: Belief = match self {
            Self::Ball { scope, settings } => {
                let settings = SpatialGpSettings { sd_inflation: sd_factor, ..settings.clone() };
                let mut surface = ImplicitSurface::new(scope.clone(), settings);
                evidence.iter().for_each(|evidence| surface.add(evidence));
                surface.into()
            }
            Self::Zone { zone, settings } => {
                let settings = GpSettings { sd_inflation: sd_factor, ..(**settings).clone() };
                let mut field = HeightField::new(zone.clone(), settings);
                evidence.iter().for_each(|evidence| field.add(evidence));
                field.into()
            }
        };
        belief.refit()?;
        Ok(belief)
    }

    /// Returns the direction away from the object at a point.
    fn outward(&self, p_w: &Point3<f64>) -> Vector3<f64> {
        match self {
            Self::Ball { scope, .. } => {
                (p_w - scope.ball.centre_w).try_normalize(1e-9).unwrap_or_else(Vector3::z)
            }
            Self::Zone { zone, .. } => -zone.ahead_w().into_inner(),
        }
    }
}

/// Returns the evidence of touches: the contacts of a group have an error in common. Where a normal
/// is not known, it points `outward`.
pub fn evidence<'a>(
    touches: impl Iterator<Item = &'a LoggedTouch>,
    outward: impl Fn(&Point3<f64>) -> Vector3<f64>,
) -> Vec<Evidence> {
    let mut groups: Vec<(&str, Vec<Contact>)> = Vec::new();
    let mut free = Vec::new();
    for touch in touches {
        if let Some(contact) = &touch.contact {
            let is_measured = contact.has_normal || touch.free.is_some();
            let normal_w = if is_measured { contact.normal_w } else { outward(&contact.p_wc) };
            let contact = Contact { normal_w, ..contact.clone() };
            match groups.iter_mut().find(|(group, _)| *group == touch.group) {
                Some((_, contacts)) => contacts.push(contact),
                None => groups.push((&touch.group, vec![contact])),
            }
        }
        free.extend(touch.free.clone().map(Evidence::Free));
    }
    let points = groups.into_iter().map(|(_, points)| {
        let source = (points.len() > 1).then_some(ErrorSource::Posture);
        Evidence::Points(SurfacePoints { points, source })
    });
    points.chain(free).collect()
}

/// Returns the contacts of `touches`, predicted by a belief without them.
fn held_out<'a>(belief: &Belief, touches: impl Iterator<Item = &'a LoggedTouch>) -> Vec<HeldOut> {
    let mesh = belief.implicit_surface().and_then(|it| it.surface()?.mesh(CELLS));
    let mesh = mesh.map(MeshBvh::new);
    let each = touches.filter_map(|touch| {
        let contact = touch.contact.as_ref()?;
        let p_w = contact.p_wc;
        let deviation = belief.distance_m(&p_w, contact.sd_m())?;
        let nearest = mesh.as_ref().map(|mesh| mesh.closest_point(&p_w).distance_m);
        let distance_m = nearest.unwrap_or(deviation.mean_m.abs());
        Some(HeldOut { group: touch.group.clone(), p_w, deviation, distance_m })
    });
    each.collect()
}
