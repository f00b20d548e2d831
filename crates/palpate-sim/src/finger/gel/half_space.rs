//! Frictionless contact of a rigid body with an elastic half-space, on a grid of square cells.
//!
//! A uniform pressure on one cell displaces the surface by Love's formula (Love 1929; Johnson 1985,
//! Contact Mechanics, Eq. 3.25). The pressures p ≥ 0 minimise ½ pᵀKp − pᵀd for the displacements d
//! that the body demands: where it presses the displacement is d, elsewhere the surface is below
//! the body. The solver is the conjugate gradient method of Polonsky & Keer 1999 (Wear 231) for a
//! given approach.

use super::window::Window;
use std::f64::consts::PI;

/// Largest number of iterations.
// heuristic: usual contacts need 10 to 40.
const STEPS: usize = 200;

/// Change of the pressures, as a fraction of their sum, at which the solver stops.
// heuristic: less than a micrometre of the largest indentation of a gel.
const ACCURACY: f64 = 1e-5;

/// Displacements of the cells of a grid by unit pressures on them, in units of cell side over
/// modulus.
#[derive(Clone, Debug)]
pub struct HalfSpace {
    counts: [usize; 2],
    /// For each distance between two rows of cells, the displacements at all signed distances
    /// between two columns.
    influence: Vec<f64>,
}

/// Pressures on the cells of a grid, and displacements of their centres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Indentation {
    /// Pressures.
    pub pressure_pa: Vec<f64>,
    /// Displacements.
    pub displaced_m: Vec<f64>,
    residual_m: Vec<f64>,
    way_pa: Vec<f64>,
    bent_m: Vec<f64>,
}

impl HalfSpace {
    /// Creates the influences between `counts` cells along x and y.
    pub fn new(counts: [usize; 2]) -> Self {
        let [columns, rows] = counts;
        let influence = (0..rows)
            .flat_map(|row| (0..2 * columns - 1).map(move |column| [column, row]))
            .map(|[column, row]| love((column + 1) as f64 - columns as f64, row as f64) / PI)
            .collect();
        Self { counts, influence }
    }

    /// Writes K·`pressure` to `displaced`, both in units of the influences.
    fn displace(&self, pressure: &[f64], displaced: &mut [f64]) {
        let columns = self.counts[0];
        displaced.fill(0.0);
        for (from_row, from) in pressure.chunks_exact(columns).enumerate() {
            if from.iter().all(|p| *p == 0.0) {
                continue;
            }
            for (to_row, to) in displaced.chunks_exact_mut(columns).enumerate() {
                let wide = 2 * columns - 1;
                let row = &self.influence[from_row.abs_diff(to_row) * wide..][..wide];
                for (column, p) in from.iter().enumerate().filter(|(_, p)| **p != 0.0) {
                    let by = &row[columns - 1 - column..][..columns];
                    to.iter_mut().zip(by).for_each(|(to, by)| *to += by * p);
                }
            }
        }
    }

    /// Writes to `found` the contact of a half-space with the modulus E / (1 − ν²) with a body that
    /// demands the displacements `demanded_m`, positive into the half-space, at the centres of
    /// cells of side `step_m`.
    pub fn press(&self, modulus_pa: f64, step_m: f64, demanded_m: &[f64], found: &mut Indentation) {
        let count = demanded_m.len();
        let Indentation { pressure_pa: p, displaced_m, residual_m, way_pa, bent_m } = found;
        for vector in [&mut *p, displaced_m, residual_m, way_pa, bent_m] {
            vector.clear();
            vector.resize(count, 0.0);
        }
        // In units of modulus / step the pressures are displacements.
        let demanded = || demanded_m.iter().copied();
        let cells = demanded().filter(|d| *d > 0.0).count();
        let own = self.influence[self.counts[0] - 1] * cells as f64;
        p.iter_mut().zip(demanded()).for_each(|(p, d)| *p = d.max(0.0) / own);
        let (mut last, mut is_conjugate) = (1.0, false);
        for _ in 0..STEPS {
            self.displace(p, residual_m);
            residual_m.iter_mut().zip(demanded()).for_each(|(rest, d)| *rest -= d.max(0.0));
            let rests = residual_m.iter().zip(p.iter()).filter(|(_, p)| **p > 0.0);
            let squares: f64 = rests.map(|(rest, _)| rest * rest).sum();
            let kept = if is_conjugate { squares / last } else { 0.0 };
            for ((way, rest), p) in way_pa.iter_mut().zip(&*residual_m).zip(&*p) {
                *way = if *p > 0.0 { rest + kept * *way } else { 0.0 };
            }
            last = squares.max(f64::MIN_POSITIVE);
            self.displace(way_pa, bent_m);
            let along = |by: &[f64]| by.iter().zip(&*way_pa).map(|(by, way)| by * way).sum::<f64>();
            let (above, below) = (along(residual_m), along(bent_m));
            if below <= 0.0 || !below.is_finite() {
                break;
            }
            let length = above / below;
            is_conjugate = true;
            let (mut change, mut sum) = (0.0, 0.0);
            for (i, p) in p.iter_mut().enumerate().filter(|(i, _)| demanded_m[*i] > 0.0) {
                let before = *p;
                *p = (*p - length * way_pa[i]).max(0.0);
                // A cell without pressure that the body has not reached joins the contact.
                if *p == 0.0 && residual_m[i] < 0.0 {
                    *p = -length * residual_m[i];
                    is_conjugate = false;
                }
                change += (*p - before).abs();
                sum += *p;
            }
            if change <= ACCURACY * sum {
                break;
            }
        }
        self.displace(p, displaced_m);
        p.iter_mut().for_each(|p| *p *= modulus_pa / step_m);
    }
}

/// Returns the displacement at (x, y) by unit pressure on a unit square about the origin, times
/// π E / (1 − ν²): ∫∫ dξ dη / ρ.
fn love(x: f64, y: f64) -> f64 {
    let ([low_x, high_x], [low_y, high_y]) = ([x - 0.5, x + 0.5], [y - 0.5, y + 0.5]);
    // The integral up to a corner (a, b): a ln(b + ρ) + b ln(a + ρ).
    let corner = |a: f64, b: f64| {
        let distance = a.hypot(b);
        let log = |c: f64, other: f64| match c < 0.0 {
            // The sum cancels; ρ + c = other² / (ρ − c).
            true => (other * other / (distance - c)).ln(),
            false => (c + distance).ln(),
        };
        let part = |a: f64, b: f64| if a == 0.0 { 0.0 } else { a * log(b, a) };
        part(a, b) + part(b, a)
    };
    corner(high_x, high_y) - corner(low_x, high_y) - corner(high_x, low_y) + corner(low_x, low_y)
}

impl Indentation {
    /// Force on the grid.
    pub fn force_n(&self, window: &Window) -> f64 {
        self.pressure_pa.iter().sum::<f64>() * window.cell_m2()
    }

    /// Whether nothing is pressed.
    pub fn is_empty(&self) -> bool {
        self.pressure_pa.is_empty()
    }

    /// Returns the bytes held beside the structure itself.
    pub fn bytes(&self) -> usize {
        let Self { pressure_pa, displaced_m, residual_m, way_pa, bent_m } = self;
        let all = [pressure_pa, displaced_m, residual_m, way_pa, bent_m];
        all.iter().map(|numbers| numbers.capacity() * size_of::<f64>()).sum()
    }

    /// Removes all pressure.
    pub fn clear(&mut self) {
        self.pressure_pa.clear();
        self.displaced_m.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS: [usize; 2] = [24, 18];

    /// Force and contact radius of a sphere, and displacement around it, against Hertz.
    #[test]
    fn a_sphere_is_that_of_hertz() {
        for (radius_m, depth_m) in [(4e-3, 0.5e-3), (3e-3, 0.3e-3), (12e-3, 1e-3), (0.05, 1e-5)] {
            presses_as_hertz_says(radius_m, depth_m);
        }
    }

    fn presses_as_hertz_says(radius_m: f64, depth_m: f64) {
        let modulus_pa = 2e5;
        let contact_m = (radius_m * depth_m).sqrt();
        let space = HalfSpace::new(COUNTS);
        // The window holds all that the undeformed surface would touch, √2 times the contact.
        let half_m = 1.5 * contact_m;
        let window = Window::around([-half_m; 2], [half_m; 2], COUNTS);
        let demanded: Vec<f64> = (0..window.len())
            .map(|cell| {
                let [x, y] = window.centre_m(cell);
                depth_m - (x * x + y * y) / (2.0 * radius_m)
            })
            .collect();
        let mut found = Indentation::default();
        space.press(modulus_pa, window.step_m[0], &demanded, &mut found);
        let force_n = found.force_n(&window);
        let hertz_n = 4.0 / 3.0 * modulus_pa * radius_m.sqrt() * depth_m.powf(1.5);
        assert!((force_n / hertz_n - 1.0).abs() < 0.02, "{force_n} {hertz_n}");
        let cells = found.pressure_pa.iter().filter(|p| **p > 0.0).count() as f64;
        let area = cells * window.cell_m2();
        let hertz_m2 = PI * contact_m * contact_m;
        assert!((area / hertz_m2 - 1.0).abs() < 0.1, "{area} {hertz_m2}");
        for (i, d) in demanded.iter().enumerate() {
            let over_m = found.displaced_m[i] - d;
            assert!(over_m > -1e-7, "the body enters the surface by {over_m}");
            assert!(found.pressure_pa[i] == 0.0 || over_m.abs() < 1e-7, "{over_m}");
        }
    }

    /// A loaded cell displaces far away like a point load, and its own middle like a square:
    /// 4 ln(1 + √2).
    #[test]
    fn one_cell_is_that_of_love() {
        let space = HalfSpace::new([40, 2]);
        let far = space.influence[39 + 30] * PI;
        assert!((far - 1.0 / 30.0).abs() < 1e-4, "{far}");
        let middle = space.influence[39] * PI;
        assert!((middle - 4.0 * (1.0 + 2f64.sqrt()).ln()).abs() < 1e-12, "{middle}");
    }
}
