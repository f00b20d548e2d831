//! Low-discrepancy points: over a square, over directions, over the surface of a mesh.
//!
//! All of them use the additive sequence of Roberts ("The unreasonable effectiveness of quasirandom
//! sequences", 2018): the fractional parts of multiples of an irrational number in each dimension.
//! It has no state and no seed: a point depends on its number only.

use super::mesh::Mesh;
use nalgebra::{Point3, UnitVector3, Vector3};

/// 1/g and 1/g², where g³ = g + 1, the plastic number.
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// 1/g, where g² = g + 1, the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// A point of a mesh's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, in metres.
    pub point: Point3<f64>,
    /// Index of the triangle that contains it.
    pub triangle: u32,
}

/// Returns point `number` of a sequence that fills the unit square evenly.
pub fn in_square(number: usize) -> [f64; 2] {
    PLASTIC.map(|step| (0.5 + number as f64 * step).fract())
}

/// Returns `count` directions, each for an equal part of the sphere: at equal steps along z,
/// rotated by the golden section (González 2010, Math. Geosci. 42, 49).
pub fn directions(count: usize) -> impl ExactSizeIterator<Item = UnitVector3<f64>> {
    (0..count).map(move |number| direction(number, count))
}

/// Returns one of [`directions`].
pub fn direction(number: usize, count: usize) -> UnitVector3<f64> {
    let z = 1.0 - (2 * number + 1) as f64 / count as f64;
    let turn = std::f64::consts::TAU * (number as f64 * (1.0 - GOLDEN)).fract();
    let across = (1.0 - z * z).max(0.0).sqrt();
    UnitVector3::new_normalize(Vector3::new(across * turn.cos(), across * turn.sin(), z))
}

/// Returns `count` points of the surface, each for an equal part of its area. Each point is at the
/// centre of a stratum of the area accumulated over the triangles; its position within the triangle
/// follows from the sequence of the square, folded along the diagonal.
pub fn over_surface(mesh: &Mesh, count: usize) -> Vec<SurfacePoint> {
    let doubled_m2 = |[a, b, c]: [Point3<f64>; 3]| (b - a).cross(&(c - a)).norm();
    let stratum_m2 = mesh.iter_corners().map(doubled_m2).sum::<f64>() / count as f64;
    let mut spots = Vec::with_capacity(count);
    let mut passed_m2 = 0.0;
    for (triangle, corners) in mesh.iter_corners().enumerate() {
        passed_m2 += doubled_m2(corners);
        while spots.len() < count && (spots.len() as f64 + 0.5) * stratum_m2 <= passed_m2 {
            let [u, v] = in_square(spots.len());
            let (u, v) = if u + v > 1.0 { (1.0 - v, 1.0 - u) } else { (u, v) };
            let [a, b, c] = corners;
            let point = a + (b - a) * u + (c - a) * v;
            spots.push(SurfacePoint { point, triangle: triangle as u32 });
        }
    }
    spots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::{box_mesh, sphere_mesh};

    #[test]
    fn steps_are_powers_of_their_roots() {
        let [first, second] = PLASTIC;
        assert!((first * first - second).abs() < 1e-15);
        assert!((first.powi(-3) - first.recip() - 1.0).abs() < 1e-14);
        assert!((GOLDEN.recip() - GOLDEN - 1.0).abs() < 1e-15);
    }

    /// Tests the mean of n directions; that of random ones would have a length of √(1/n).
    #[test]
    fn directions_have_unit_length_and_no_mean() {
        for count in [1, 2, 64, 200] {
            let found: Vec<_> = directions(count).collect();
            assert!(found.iter().all(|u| (u.norm() - 1.0).abs() < 1e-12));
            let mean = found.iter().map(|u| u.into_inner()).sum::<Vector3<f64>>() / count as f64;
            assert!(count < 3 || mean.norm() < 0.5 / count as f64, "{count}: {mean}");
        }
    }

    /// Every face of a box gets its proportion of points to within one for each of its two
    /// triangles, and every octant of a ball its eighth.
    #[test]
    fn points_lie_on_the_surface_in_proportion_to_its_area() {
        let (vertices, triangles) = box_mesh([0.0; 3], [0.1, 0.2, 0.3]);
        let mesh = Mesh::new(&vertices, &triangles).unwrap().0;
        for count in [1, 7, 4000] {
            let spots = over_surface(&mesh, count);
            assert_eq!(spots.len(), count);
            for (axis, [low, high], area_m2) in
                [(0, [0.0, 0.1], 0.06), (1, [0.0, 0.2], 0.03), (2, [0.0, 0.3], 0.02)]
            {
                for side in [low, high] {
                    let on = spots.iter().filter(|s| (s.point[axis] - side).abs() < 1e-12).count();
                    let share = count as f64 * area_m2 / mesh.area_m2();
                    assert!((on as f64 - share).abs() <= 2.0, "{on} of {count}, not {share}");
                }
            }
        }
        let (vertices, triangles) = sphere_mesh(Point3::origin(), 0.05, 24);
        let mesh = Mesh::new(&vertices, &triangles).unwrap().0;
        let mut octants = [0_usize; 8];
        for spot in over_surface(&mesh, 4000) {
            octants
                [(0..3).map(|axis| usize::from(spot.point[axis] > 0.0) << axis).sum::<usize>()] +=
                1;
        }
        assert!(octants.iter().all(|&on| on.abs_diff(500) < 30), "{octants:?}");
    }

    /// Tests the mean of x·y over a square, whose variance is 7/144; random points have an error of
    /// √(variance / n). These points have a tenth of that; a fold that tears the square along its
    /// diagonal would have a quarter.
    #[test]
    fn means_over_a_surface_are_better_than_by_chance() {
        let corner = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let vertices = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        let mesh = Mesh::new(&vertices, &[[0, 1, 2], [0, 2, 3]]).unwrap().0;
        let spots = over_surface(&mesh, 4000);
        let mean = spots.iter().map(|s| s.point.x * s.point.y).sum::<f64>() / 4000.0;
        assert!((mean - 0.25).abs() < 0.2 * (7.0_f64 / 144.0 / 4000.0).sqrt(), "{mean}");
    }
}
