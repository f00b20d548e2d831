//! Triangulation of polygons in space.

use foldhash::{HashMap, HashMapExt};
use nalgebra::{Point3, Vector3};

use super::primitives::{doubled_area, is_degenerate, rounding_m};
use super::raw::MAX_TRIANGLES;

/// Appends the triangles of a polygon, wound as its corners, which index `vertices`.
///
/// A polygon is seen along its normal, so it need not be flat. The fan around its first corner is
/// kept if each of its triangles faces along the normal, as for every convex polygon; otherwise
/// ears are clipped. Corners on a straight side keep their place in it, so that the polygon shares
/// all of them with its neighbours.
pub(super) fn triangulate(
    corners: &[u32],
    vertices: &[Point3<f64>],
    triangles: &mut Vec<[u32; 3]>,
) {
    let point = |&corner: &u32| vertices.get(corner as usize).copied();
    let found = match corners.len() {
        4..=MAX_TRIANGLES => corners.iter().map(point).collect::<Option<Vec<_>>>(),
        _ => None,
    };
    let found = match found {
        Some(points) => cut(&points),
        // Indices out of range and too many triangles are refused where they are added.
        None => fan(corners.len() as u32).take(MAX_TRIANGLES + 1).collect(),
    };
    triangles.extend(found.iter().map(|triangle| triangle.map(|i| corners[i as usize])));
}

/// Returns the triangles of a strip, all wound as the first one.
pub(super) fn strip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let windows = corners.array_windows().enumerate();
    windows.map(|(i, &[a, b, c])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] })
}

/// Returns the mean of a polygon's corners.
pub(super) fn centre(points: &[Point3<f64>]) -> Point3<f64> {
    let sum: Vector3<f64> = points.iter().map(|point| point.coords).sum();
    Point3::from(sum / points.len() as f64)
}

/// Returns the normal of a polygon after Newell (Sutherland et al., *A Characterization of Ten
/// Hidden-Surface Algorithms*, 1974), around which its corners turn anticlockwise; `None` if it
/// encloses no area.
pub(super) fn normal(points: &[Point3<f64>], centre: Point3<f64>) -> Option<Vector3<f64>> {
    let pairs = || points.iter().zip(points.iter().cycle().skip(1));
    let doubled: Vector3<f64> = pairs().map(|(a, b)| (a - centre).cross(&(b - centre))).sum();
    doubled.try_normalize(0.0).filter(|normal| normal.iter().all(|x| x.is_finite()))
}

/// Returns the triangles of a polygon by clipping its ears, seen along its normal; they are wound
/// as its corners. A corner on a straight side may be left out.
pub(super) fn ears(
    points: &[Point3<f64>],
    centre: Point3<f64>,
    normal: Vector3<f64>,
) -> Vec<[u32; 3]> {
    let across = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let up = normal.cross(&across);
    let flat = points.iter().map(|p| [(p - centre).dot(&across), (p - centre).dot(&up)]);
    let mut found: Vec<u32> = Vec::new();
    earcut::Earcut::new().earcut(flat, &[], &mut found);
    let (triangles, _) = found.as_chunks::<3>();
    let mut triangles = triangles.to_vec();
    let along = |corners: &[u32; 3]| doubled_area(of(points, *corners)).dot(&normal);
    if triangles.iter().map(along).sum::<f64>() < 0.0 {
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    triangles
}

fn of(points: &[Point3<f64>], corners: [u32; 3]) -> [Point3<f64>; 3] {
    corners.map(|corner| points[corner as usize])
}

fn fan(count: u32) -> impl Iterator<Item = [u32; 3]> {
    (2..count).map(|corner| [0, corner - 1, corner])
}

/// Returns the triangles over the corners of a polygon.
fn cut(points: &[Point3<f64>]) -> Vec<[u32; 3]> {
    let count = points.len() as u32;
    let centre = centre(points);
    let Some(normal) = normal(points, centre) else { return fan(count).collect() };
    let rounding_m = rounding_m(points);
    let is_flat = |corners: [u32; 3]| is_degenerate(of(points, corners), rounding_m);
    let faces_back = |corners: [u32; 3]| {
        doubled_area(of(points, corners)).dot(&normal) < 0.0 && !is_flat(corners)
    };
    let mut triangles: Vec<_> = fan(count).collect();
    if fan(count).any(faces_back) {
        // Nothing is clipped from some polygons that cross themselves.
        triangles =
            Some(ears(points, centre, normal)).filter(|it| !it.is_empty()).unwrap_or(triangles);
    }
    add_left_out(count, &mut triangles);
    flip_flat(points, is_flat, &mut triangles);
    triangles
}

/// Adds triangles without area between the sides of `triangles` and the corners that they leave
/// out.
fn add_left_out(count: u32, triangles: &mut Vec<[u32; 3]>) {
    let mut is_used = vec![false; count as usize];
    triangles.iter().flatten().for_each(|&corner| is_used[corner as usize] = true);
    let used: Vec<u32> = (0..count).filter(|&corner| is_used[corner as usize]).collect();
    for (&from, &to) in used.iter().zip(used.iter().cycle().skip(1)) {
        let steps = (to + count - from) % count;
        let corner = |step: u32| (from + step) % count;
        triangles.extend((2..=steps).map(|step| [from, corner(step - 1), corner(step)]));
    }
}

/// Flips the longest side of triangles without area, which are removed later: their middle corner
/// would remain on a side of a neighbour, and the mesh would be open there.
fn flip_flat(
    points: &[Point3<f64>],
    is_flat: impl Fn([u32; 3]) -> bool,
    triangles: &mut [[u32; 3]],
) {
    let all = 0..triangles.len();
    let mut waiting: Vec<usize> = all.clone().filter(|&i| is_flat(triangles[i])).collect();
    if waiting.is_empty() {
        return;
    }
    let mut owner = HashMap::with_capacity(3 * triangles.len());
    all.for_each(|i| own(triangles[i], i, &mut owner));
    // Flips among corners on one line may repeat.
    let mut flips_left = 4 * triangles.len();
    while let Some(flat) = waiting.pop() {
        let [a, b, c] = across_longest_side(points, triangles[flat]);
        let is_repeated = [a, c].iter().any(|&end| points[end as usize] == points[b as usize]);
        if is_repeated || flips_left == 0 || !is_flat([a, b, c]) {
            continue;
        }
        let Some(&other) = owner.get(&(a, c)) else { continue };
        let Some(&d) = triangles[other].iter().find(|&&corner| corner != a && corner != c) else {
            continue;
        };
        flips_left -= 1;
        owner.remove(&(a, c));
        owner.remove(&(c, a));
        for (i, triangle) in [(flat, [a, b, d]), (other, [b, c, d])] {
            triangles[i] = triangle;
            own(triangle, i, &mut owner);
            if is_flat(triangle) {
                waiting.push(i);
            }
        }
    }
}

/// Notes triangle `i` as the owner of its directed sides.
fn own([a, b, c]: [u32; 3], i: usize, owner: &mut HashMap<(u32, u32), usize>) {
    owner.extend([(a, b), (b, c), (c, a)].map(|side| (side, i)));
}

/// Returns a triangle with its longest side from the last corner to the first.
fn across_longest_side(points: &[Point3<f64>], [a, b, c]: [u32; 3]) -> [u32; 3] {
    let length_m = |[a, _, c]: &[u32; 3]| (points[*a as usize] - points[*c as usize]).norm();
    let turns = [[a, b, c], [b, c, a], [c, a, b]];
    turns.into_iter().max_by(|a, b| length_m(a).total_cmp(&length_m(b))).unwrap_or([a, b, c])
}
