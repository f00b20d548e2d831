//! Topology of a triangle mesh: edges, components, winding.

/// Marker of a side without a neighbour.
const NONE: u32 = u32::MAX;

/// Result of [`orient`]. Lists contain triangles in ascending order.
#[derive(Debug, Default)]
pub(super) struct Topology {
    /// One entry per edge that has a single triangle.
    pub border: Vec<u32>,
    /// One entry per edge with three or more triangles: the first of them.
    pub non_manifold: Vec<u32>,
    /// Triangles whose winding must be reversed.
    pub flip: Vec<u32>,
    /// Components connected over two-triangle edges.
    pub components: usize,
    /// Components that are one-sided, like a Möbius strip.
    pub unorientable: usize,
    /// Whether every component encloses a volume.
    pub closed: bool,
}

/// One side of a triangle, as an edge from its lower to its higher vertex.
#[derive(Clone, Default)]
struct Side {
    edge: (u32, u32),
    triangle: u32,
    side: u8,
    ascending: bool,
}

/// Per triangle and side: the neighbour over a two-triangle edge, and whether both traverse the
/// edge in the same direction, which means that one of them has the wrong winding.
type Neighbours = Vec<[(u32, bool); 3]>;

/// Finds the components of a mesh and a winding that is consistent over each: outward if the
/// component is closed, by majority of its triangles if it is open.
///
/// `signed_volume` is six times the volume under one triangle, in its input winding.
pub(super) fn orient(triangles: &[[u32; 3]], signed_volume: impl Fn(u32) -> f64) -> Topology {
    let sides = sorted_sides(triangles);
    let mut found = Topology { closed: true, ..Topology::default() };
    let neighbours = link(&sides, triangles.len(), &mut found);
    let flood = flood(&neighbours);
    let open = open_components(&sides, &flood);
    found.components = flood.members.len();
    for (component, members) in flood.members.iter().enumerate() {
        let one_sided = flood.one_sided[component];
        found.unorientable += usize::from(one_sided);
        found.closed &= !open[component] && !one_sided;
        let turned = |triangle: u32| flood.turned[triangle as usize];
        let reverse = if open[component] || one_sided {
            2 * members.iter().filter(|&&triangle| turned(triangle)).count() > members.len()
        } else {
            let sign = |triangle| if turned(triangle) { -1.0 } else { 1.0 };
            members.iter().map(|&triangle| sign(triangle) * signed_volume(triangle)).sum::<f64>()
                < 0.0
        };
        found.flip.extend(members.iter().filter(|&&triangle| turned(triangle) != reverse));
    }
    found.border.sort_unstable();
    found.non_manifold.sort_unstable();
    found.flip.sort_unstable();
    found
}

/// Returns the sides of all triangles sorted by edge, then by triangle. Bucketed by the lower
/// vertex first, which leaves few comparisons per bucket.
fn sorted_sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let sides = |triangle: usize| {
        let corners = triangles[triangle];
        (0..3u8).map(move |side| {
            let from = corners[usize::from(side)];
            let to = corners[usize::from(side + 1) % 3];
            Side {
                edge: (from.min(to), from.max(to)),
                triangle: triangle as u32,
                side,
                ascending: from < to,
            }
        })
    };
    let all = || (0..triangles.len()).flat_map(sides);
    let vertices = triangles.iter().flatten().max().map_or(0, |&last| last as usize + 1);
    let mut ends = vec![0; vertices];
    all().for_each(|side| ends[side.edge.0 as usize] += 1);
    let mut begin = 0;
    for end in &mut ends {
        begin += std::mem::replace(end, begin);
    }
    let mut sorted = vec![Side::default(); 3 * triangles.len()];
    for side in all() {
        let end = &mut ends[side.edge.0 as usize];
        sorted[*end] = side;
        *end += 1;
    }
    let mut begin = 0;
    for end in ends {
        sorted[begin..end].sort_unstable_by_key(|side| (side.edge.1, side.triangle));
        begin = end;
    }
    sorted
}

fn edges(sides: &[Side]) -> impl Iterator<Item = &[Side]> {
    sides.chunk_by(|a, b| a.edge == b.edge)
}

fn link(sides: &[Side], triangles: usize, found: &mut Topology) -> Neighbours {
    let mut neighbours = vec![[(NONE, false); 3]; triangles];
    for edge in edges(sides) {
        match edge {
            [only] => found.border.push(only.triangle),
            [a, b] => {
                let same_way = a.ascending == b.ascending;
                neighbours[a.triangle as usize][usize::from(a.side)] = (b.triangle, same_way);
                neighbours[b.triangle as usize][usize::from(b.side)] = (a.triangle, same_way);
            }
            [first, ..] => found.non_manifold.push(first.triangle),
            [] => {}
        }
    }
    neighbours
}

#[derive(Default)]
struct Flood {
    component: Vec<u32>,
    /// Whether the triangle must be reversed to agree with the first of its component.
    turned: Vec<bool>,
    members: Vec<Vec<u32>>,
    one_sided: Vec<bool>,
}

fn flood(neighbours: &Neighbours) -> Flood {
    let mut flood = Flood {
        component: vec![NONE; neighbours.len()],
        turned: vec![false; neighbours.len()],
        ..Flood::default()
    };
    for seed in 0..neighbours.len() as u32 {
        if flood.component[seed as usize] != NONE {
            continue;
        }
        let number = flood.members.len() as u32;
        flood.component[seed as usize] = number;
        let mut members = vec![seed];
        let mut one_sided = false;
        let mut next = 0;
        while let Some(&triangle) = members.get(next) {
            next += 1;
            for &(other, same_way) in &neighbours[triangle as usize] {
                if other == NONE {
                    continue;
                }
                let turned = flood.turned[triangle as usize] != same_way;
                if flood.component[other as usize] == NONE {
                    flood.component[other as usize] = number;
                    flood.turned[other as usize] = turned;
                    members.push(other);
                } else {
                    one_sided |= flood.turned[other as usize] != turned;
                }
            }
        }
        flood.members.push(members);
        flood.one_sided.push(one_sided);
    }
    flood
}

/// Returns whether each component is open: has an odd number of triangles on some edge. Two bodies
/// that share an edge, each with two triangles on it, are both closed.
fn open_components(sides: &[Side], flood: &Flood) -> Vec<bool> {
    let mut open = vec![false; flood.members.len()];
    let mut owners = Vec::new();
    for edge in edges(sides) {
        owners.clear();
        owners.extend(edge.iter().map(|side| flood.component[side.triangle as usize]));
        owners.sort_unstable();
        for same in owners.chunk_by(|a, b| a == b) {
            if let [owner, ..] = same
                && same.len() % 2 == 1
            {
                open[*owner as usize] = true;
            }
        }
    }
    open
}
