//! Analytic objects by name; their formulas are the ground truth of the meshes in `models/`.
//!
//! Each has its own frame, in metres: origin at its centre, front towards +y, z up, and x to its
//! own right. All lengths are heuristics: the shapes of the objects of Yi et al. 2016, Fig. 2, are
//! not published; these objects replace them.

use nalgebra::{Point3, Vector3, matrix, point, vector};

use super::implicit::{Field, ImplicitSolid};

/// All analytic objects; add one line per object.
static SURFACES: &[(&str, &dyn ImplicitSolid)] = &[("container", &Container), ("bird", &Bird)];

/// Returns the analytic object called `name`.
pub fn by_name(name: &str) -> Option<&'static dyn ImplicitSolid> {
    SURFACES.iter().find(|(known, _)| *known == name).map(|(_, surface)| *surface)
}

/// Returns the names that [`by_name`] accepts.
pub fn names() -> impl Iterator<Item = &'static str> {
    SURFACES.iter().map(|(name, _)| *name)
}

/// A steel container, 120 mm wide and 200 mm high: an elliptic cylinder along z, with rounded edges
/// and a round bead around its top. The bead protrudes 2 mm from the front and 3 mm from the sides;
/// where |z| < 84 mm the front is y = 40 mm √(1 - (x / 60 mm)²).
pub struct Container;

impl ImplicitSolid for Container {
    fn field(&self, p: Point3<f64>) -> Field {
        // The front slopes by 45 degrees at x = 50 mm.
        let side = Field::ellipsoid(p.coords, vector![0.060, 0.040, f64::INFINITY]);
        let lid = Field::plane(p, point![0.0, 0.0, 0.098], Vector3::z());
        let floor = Field::plane(p, point![0.0, 0.0, -0.100], -Vector3::z());
        let body = side.intersection(lid, 0.014).intersection(floor, 0.014);

        let bead_height = Field::plane(p, point![0.0, 0.0, 0.096], Vector3::z());
        let bead = side.offset(-0.002).tube(bead_height, 0.004);
        body.union(bead, 0.004)
    }

    fn bounds(&self) -> [Point3<f64>; 2] {
        [point![-0.065, -0.044, -0.102], point![0.065, 0.044, 0.102]]
    }
}

/// A porcelain bird, 110 mm wide, 140 mm high and 80 mm deep, on a round foot, facing +y: a breast
/// and a back, two wings, a head with eyes and a tuft, and a nose thinner than a fingertip. It is
/// mirror-symmetric.
pub struct Bird;

impl ImplicitSolid for Bird {
    fn field(&self, p: Point3<f64>) -> Field {
        let mut field = right_half(point![p.x.abs(), p.y, p.z]);
        if p.x < 0.0 {
            field.gradient.x = -field.gradient.x;
        }
        field
    }

    fn bounds(&self) -> [Point3<f64>; 2] {
        [point![-0.058, -0.042, -0.074], point![0.058, 0.045, 0.072]]
    }
}

/// Returns the bird's field for x >= 0. Wing and eye do not reach x = 0, so that the field meets
/// its mirror image smoothly.
fn right_half(p: Point3<f64>) -> Field {
    let ellipsoid =
        |centre: Point3<f64>, radii_m: Vector3<f64>| Field::ellipsoid(p - centre, radii_m);
    let breast = ellipsoid(point![0.0, -0.006, -0.020], vector![0.044, 0.032, 0.048]);
    let back = ellipsoid(point![0.0, -0.014, 0.012], vector![0.038, 0.018, 0.038]);
    let foot = ellipsoid(point![0.0, -0.007, -0.058], vector![0.052, 0.031, 0.013]);
    let head = ellipsoid(point![0.0, 0.003, 0.035], vector![0.029, 0.028, 0.028]);
    let eye = ellipsoid(point![0.012, 0.026, 0.043], vector![0.0045, 0.0045, 0.0045]);

    // Its upper end leans inwards by 4.4 degrees, whose sine and cosine are these fractions: 52² +
    // 675² = 677².
    let (sine, cosine) = (52.0 / 677.0, 675.0 / 677.0);
    let tilt = matrix![cosine, 0.0, sine; 0.0, 1.0, 0.0; -sine, 0.0, cosine];
    let upright =
        Field::ellipsoid(tilt * (p - point![0.039, -0.010, -0.006]), vector![0.015, 0.026, 0.056]);
    let wing = Field { gradient: tilt.tr_mul(&upright.gradient), ..upright };

    let tuft = Field::round_cone(
        p,
        [point![0.0, 0.006, 0.058], point![0.0, -0.008, 0.067]],
        [0.0060, 0.0035],
    );
    let nose = Field::round_cone(
        p,
        [point![0.0, 0.024, 0.030], point![0.0, 0.0405, 0.028]],
        [0.0032, 0.0024],
    );

    let trunk = breast.union(back, 0.008).union(foot, 0.010).union(wing, 0.006);
    trunk.union(head, 0.010).union(tuft, 0.008).union(eye, 0.003).union(nose, 0.004)
}
