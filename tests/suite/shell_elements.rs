//! Tests of the skin's shell elements against closed forms: a strip, a plate, a dome.

use nalgebra::{DMatrix, DVector, Vector3};
use palpate::math::banded::BandedMatrix;
use palpate::sim::finger::shell::elastic_sheet::{Material, Sheet};
use std::f64::consts::{FRAC_PI_2, TAU};

const SILICONE: Material = Material { young_pa: 1.552e6, poisson: 0.3165, thickness_m: 1.6e-3 };

/// A sheet of n × m cells over the unit square.
fn sheet(
    [n, m]: [usize; 2],
    held: bool,
    material: &Material,
    at: impl Fn(f64, f64) -> Vector3<f64>,
) -> Sheet {
    let part = |i: usize, n: usize| i as f64 / n as f64;
    let all = || (0..=n).flat_map(|i| (0..=m).map(move |j| (i, j)));
    let cells = (0..n).flat_map(|i| (0..m).map(move |j| i * (m + 1) + j));
    let points = all().map(|(i, j)| at(part(i, n), part(j, m))).collect();
    let border = |(i, j)| held && (i == 0 || j == 0 || i == n || j == m);
    let triangles: Vec<_> =
        cells.flat_map(|k| [[k, k + m + 1, k + m + 2], [k, k + m + 2, k + 1]]).collect();
    Sheet::new(points, &triangles, &all().map(border).collect::<Vec<_>>(), material)
}

/// Displacements under `forces_n`, with the directions selected by `fixed` held.
fn displaced(
    sheet: &Sheet,
    forces_n: &DVector<f64>,
    fixed: impl Fn(usize, usize) -> bool,
) -> DVector<f64> {
    let size = forces_n.len();
    let mut stiffness = DMatrix::zeros(size, size);
    sheet.stiffness(|[p, q], block| {
        let mut part = stiffness.fixed_view_mut::<3, 3>(3 * p, 3 * q);
        part += block;
    });
    let stiffest = stiffness.diagonal().max();
    for i in (0..size).filter(|i| fixed(i / 3, i % 3)) {
        stiffness[(i, i)] += 1e8 * stiffest;
    }
    stiffness.cholesky().unwrap().solve(forces_n)
}

/// Under tension a strip lengthens by F/(E A) and narrows by ν times that.
#[test]
fn a_strip_shows_its_modulus_and_poissons_ratio() {
    let (length_m, width_m) = (0.04, 0.01);
    let strip =
        sheet([16, 4], false, &SILICONE, |u, v| Vector3::new(length_m * u, width_m * v, 0.0));
    let mut forces_n = DVector::zeros(3 * 17 * 5);
    [0.125, 0.25, 0.25, 0.25, 0.125].iter().enumerate().for_each(|(j, f)| {
        forces_n[3 * (16 * 5 + j)] = *f;
    });
    let fixed = |node: usize, a: usize| a == 2 || (a == 0 && node < 5) || (a == 1 && node == 0);
    let moved_m = displaced(&strip, &forces_n, fixed);
    let strain = moved_m[3 * (16 * 5)] / length_m;
    let thinner = (moved_m[3 * (8 * 5) + 1] - moved_m[3 * (8 * 5 + 4) + 1]) / width_m;
    let modulus_pa = 1.0 / (width_m * SILICONE.thickness_m) / strain;
    assert!((modulus_pa / SILICONE.young_pa - 1.0).abs() < 1e-3, "{modulus_pa}");
    assert!((thinner / strain / SILICONE.poisson - 1.0).abs() < 1e-3, "{}", thinner / strain);
}

/// A clamped square plate of side a sinks by 0.00126 q a⁴/D in its middle (Timoshenko, Theory of
/// Plates and Shells, table 35). Constant curvatures are too soft, by an error that decreases with
/// the square of the cell size.
#[test]
fn a_clamped_plate_bends_as_stiffly_as_it_should() {
    let (side_m, material) = (0.02, Material { thickness_m: 4e-4, ..SILICONE });
    let rigidity_nm = material.young_pa * material.thickness_m.powi(3)
        / (12.0 * (1.0 - material.poisson.powi(2)));
    let stiffness = |n: usize| {
        let plate =
            sheet([n, n], true, &material, |u, v| Vector3::new(side_m * u, side_m * v, 0.0));
        let nodes = (n + 1) * (n + 1);
        let load_n = (side_m / n as f64).powi(2);
        let forces_n = DVector::from_fn(3 * nodes, |i, _| if i % 3 == 2 { load_n } else { 0.0 });
        let border = |k: usize| {
            let (i, j) = (k / (n + 1), k % (n + 1));
            i == 0 || j == 0 || i == n || j == n
        };
        let moved_m = displaced(&plate, &forces_n, |k, _| border(k));
        0.00126 * side_m.powi(4) / rigidity_nm / moved_m[3 * (nodes / 2) + 2]
    };
    let [coarse, fine] = [8, 16].map(stiffness);
    assert!((fine - 1.0).abs() < 0.06, "{fine}");
    assert!((fine - 1.0).abs() < 0.4 * (coarse - 1.0).abs(), "{coarse} {fine}");
}

/// A point load on a hemisphere: w = P R √(3 (1 − ν²)) / (4 E t²) (Reissner 1946). The bound of a
/// tenth allows for a thick dome in a theory of thin shallow ones.
#[test]
fn a_hemisphere_yields_under_a_point_as_reissner_says() {
    let radius_m = 7e-3;
    for (rings, thickness_m) in [(16, 1.6e-3), (24, 1.6e-3), (24, 8e-4)] {
        let around = 2 * rings;
        let mut points = vec![Vector3::z() * radius_m];
        for (i, j) in (1..=rings).flat_map(|i| (0..around).map(move |j| (i, j))) {
            let (polar, turn) =
                (FRAC_PI_2 * i as f64 / rings as f64, TAU * j as f64 / around as f64);
            let across = polar.sin();
            points.push(
                Vector3::new(across * turn.cos(), across * turn.sin(), polar.cos()) * radius_m,
            );
        }
        let id = |i: usize, j: usize| if i == 0 { 0 } else { 1 + (i - 1) * around + j % around };
        let mut triangles = Vec::new();
        for (i, j) in (0..rings).flat_map(|i| (0..around).map(move |j| (i, j))) {
            if i > 0 {
                triangles.push([id(i, j), id(i + 1, j), id(i, j + 1)]);
            }
            triangles.push([id(i, j + 1), id(i + 1, j), id(i + 1, j + 1)]);
        }
        let free = 1 + (rings - 1) * around;
        let held: Vec<bool> = (0..points.len()).map(|k| k >= free).collect();
        let dome = Sheet::new(points, &triangles, &held, &Material { thickness_m, ..SILICONE });
        let mut stiffness = BandedMatrix::zeros(3 * free, 9 * around);
        dome.stiffness(|[p, q], block| {
            if p < free && q < free {
                for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
                    stiffness.add(3 * p + a, 3 * q + b, block[(a, b)]);
                }
            }
        });
        let mut moved_m = vec![0.0; 3 * free];
        moved_m[2] = 1.0;
        stiffness.factor().solve(&mut moved_m);
        let reissner_m = radius_m * (3.0 * (1.0 - SILICONE.poisson.powi(2))).sqrt()
            / (4.0 * SILICONE.young_pa * thickness_m.powi(2));
        let stiffness = reissner_m / f64::from(moved_m[2]);
        assert!((stiffness - 1.0).abs() < 0.1, "{rings} rings, {thickness_m} m: {stiffness}");
    }
}
