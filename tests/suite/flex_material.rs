//! A shell of MuJoCo's against what a sheet of the stated material does.

use mujoco_rs::wrappers::MjModel;
use mujoco_rs::wrappers::mj_data::MjData;
use nalgebra::{DMatrix, DVector};
use palpate::sim::mjcf::elasticity;
use std::fmt::Write;

const YOUNG_PA: f64 = 1.552e6;
const THICKNESS_M: f64 = 1.6e-3;

/// A flat sheet of cells, each cut in two along the same diagonal.
struct Sheet {
    data: MjData<Box<MjModel>>,
    /// Column and row of each free node.
    free: Vec<[usize; 2]>,
}

impl Sheet {
    fn new(
        cells: [usize; 2],
        cell_m: f64,
        poisson: f64,
        is_held: impl Fn([usize; 2]) -> bool,
    ) -> Self {
        let [columns, rows] = cells;
        let (mut text, mut names, mut vertices) = (String::new(), String::new(), String::new());
        let mut free = Vec::new();
        for (column, row) in (0..=columns).flat_map(|i| (0..=rows).map(move |j| (i, j))) {
            let [x, y] = [column, row].map(|k| cell_m * k as f64);
            if is_held([column, row]) {
                names += "core ";
                write!(vertices, "{x} {y} 0 ").unwrap();
                continue;
            }
            let name = format!("n{column}.{row}");
            write!(
                text,
                r#"<body name="{name}" pos="{x} {y} 0"><inertial pos="0 0 0" mass="1e-3" diaginertia="1e-9 1e-9 1e-9"/>"#
            )
            .unwrap();
            for axis in ["1 0 0", "0 1 0", "0 0 1"] {
                write!(text, r#"<joint type="slide" axis="{axis}"/>"#).unwrap();
            }
            text += "</body>";
            names += &(name + " ");
            vertices += "0 0 0 ";
            free.push([column, row]);
        }
        let at = |column: usize, row: usize| column * (rows + 1) + row;
        let elements: Vec<String> = (0..columns)
            .flat_map(|i| (0..rows).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [a, b, c, a, c, d].map(|node| node.to_string())
            })
            .collect();
        let elasticity = elasticity([YOUNG_PA, poisson], THICKNESS_M, 0.0);
        let text = format!(
            r#"<mujoco><option gravity="0 0 0"/><worldbody>{text}<body name="core"/></worldbody>
            <deformable><flex name="sheet" dim="2" radius="1e-4" body="{names}" vertex="{vertices}" element="{elements}">{elasticity}<contact selfcollide="none" contype="0" conaffinity="0"/></flex></deformable></mujoco>"#,
            elements = elements.join(" "),
        );
        let model = Box::new(MjModel::from_xml_string(&text).unwrap());
        Self { data: MjData::new(model), free }
    }

    /// Force of the sheet on each free node when they have moved.
    fn forces_n(&mut self, moved_m: impl Fn([usize; 2]) -> [f64; 3]) -> Vec<[f64; 3]> {
        let qpos = self.data.qpos_mut();
        for (to, node) in qpos.chunks_exact_mut(3).zip(&self.free) {
            to.copy_from_slice(&moved_m(*node));
        }
        self.data.forward();
        let forces = self.data.qfrc_spring().chunks_exact(3);
        forces.map(|force_n| [force_n[0], force_n[1], force_n[2]]).collect()
    }
}

/// A strip of 20 × 6 cells that is stretched along x alone, and one that is sheared: Hooke's law of
/// plane stress gives σx = Eε/(1 − ν²), σy = νσx and τ = Eγ/(2(1 + ν)).
#[test]
fn a_strip_has_the_stated_moduli() {
    let (cells, cell_m, strain) = ([20, 6], 2e-3, 1e-4);
    for poisson in [0.0, 0.2, 0.3165, 0.49] {
        let mut strip = Sheet::new(cells, cell_m, poisson, |_| false);
        let free = strip.free.clone();
        let mut stress_pa = |moved: [usize; 2], face: usize, along: usize| {
            let forces_n = strip.forces_n(|node| {
                let mut moved_m = [0.0; 3];
                moved_m[moved[0]] = strain * cell_m * node[moved[1]] as f64;
                moved_m
            });
            let of_face = forces_n.iter().zip(&free).filter(|(_, node)| node[face] == cells[face]);
            let sum_n: f64 = of_face.map(|(force_n, _)| -force_n[along]).sum();
            sum_n / (THICKNESS_M * cell_m * cells[1 - face] as f64) / strain
        };
        let [along, across, shear] =
            [stress_pa([0, 0], 0, 0), stress_pa([0, 0], 1, 1), stress_pa([0, 1], 1, 0)];
        let expected = YOUNG_PA / (1.0 - poisson * poisson);
        println!("{poisson}: {along} {across} {shear}");
        // The law is Saint-Venant's and Kirchhoff's: off by the strain.
        assert!((along / expected - 1.0).abs() < 1e-3, "{along} {expected}");
        assert!((across / along - poisson).abs() < 1e-3, "{across} {along}");
        assert!((shear / (0.5 * YOUNG_PA / (1.0 + poisson)) - 1.0).abs() < 1e-3, "{shear}");
    }
}

/// A square plate clamped all around under an even load sinks by 0.00126532 q a⁴/D in the middle
/// (Timoshenko). The elements do not converge to it: their stiffness is that of the law on 10 to 12
/// cells a side, a skin's, and a tenth off on 8 and 16.
#[test]
fn a_clamped_plate_has_the_stated_stiffness() {
    let side_m = 0.02;
    for poisson in [0.0f64, 0.3165] {
        for cells in [8, 16] {
            let cell_m = side_m / cells as f64;
            let is_held = |node: [usize; 2]| node.iter().any(|&k| k <= 1 || k > cells);
            let mut plate = Sheet::new([cells + 2; 2], cell_m, poisson, is_held);
            let (count, moved_m) = (plate.free.len(), 1e-7);
            let mut stiffness = DMatrix::zeros(count, count);
            for k in 0..count {
                let pushed = plate.free[k];
                let off = |node| [0.0, 0.0, if node == pushed { moved_m } else { 0.0 }];
                for (i, force_n) in plate.forces_n(off).iter().enumerate() {
                    stiffness[(i, k)] = -force_n[2] / moved_m;
                }
            }
            let load_n = DVector::from_element(count, cell_m * cell_m);
            let sunk_m = stiffness.lu().solve(&load_n).unwrap();
            let middle = plate.free.iter().position(|node| *node == [(cells + 2) / 2; 2]).unwrap();
            let found_nm = 0.001_265_32 * side_m.powi(4) / sunk_m[middle];
            let stated_nm = YOUNG_PA * THICKNESS_M.powi(3) / (12.0 * (1.0 - poisson * poisson));
            println!("{cells} cells, {poisson}: {} of D", found_nm / stated_nm);
            assert!((found_nm / stated_nm - 1.0).abs() < 0.1, "{found_nm} {stated_nm}");
        }
    }
}
