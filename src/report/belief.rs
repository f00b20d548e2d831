//! Picture of a belief: mean and band over a zone with the contacts, or the estimated surface of a
//! whole object.

use super::axes::{Axis, Length, Panel, colour_bar};
use super::canvas::{Area, Canvas};
use super::figures::curves::belief_panel;
use super::heat_map::HeatMap;
use super::legend::{FigureLayout, Swatch};
use super::solid::{FilmPanels, PlannerSurfaces, SolidTouch, SurfaceFrame};
use super::style::{self, FAINT_INK, INK, PLANNED};
use palpate_explore::belief::{Belief, HeightField};
use palpate_explore::whole_object::ImplicitSurface;
use palpate_geometry::decimate::decimate;
use palpate_gp::Posterior;

/// Places at which a curve is computed.
const STEPS: usize = 300;
/// Size of a curve, and its largest height with equal axes.
const CURVE_PX: (f64, f64) = (460.0, 250.0);
const EQUAL_HEIGHT_PX: f64 = 340.0;
/// Largest size of a map with equal axes.
const MAP_PX: (f64, f64) = (300.0, 340.0);
const LEFT_PX: f64 = 66.0;
const TOP_PX: f64 = 66.0;
/// Distance between two maps, and height of the axis and the colour bar below them.
const GAP_PX: f64 = 76.0;
const FOOT_PX: f64 = 92.0;

/// Panel of a surface, and height of the scale bar and the colour bar below it.
const SOLID_PX: (f64, f64) = (290.0, 300.0);
const SOLID_FOOT_PX: f64 = 48.0;
/// Cells along the longest side of a surface, and its largest number of triangles.
// heuristic: more would not be visible at this size.
const CELLS: u32 = 48;
const TRIANGLES: usize = 4000;

/// Draws a belief as SVG; `None` before its first fit, or if it contains no surface.
pub fn picture(belief: &Belief) -> Option<String> {
    match (belief.height_field(), belief.implicit_surface()) {
        (Some(field), _) if field.zone().z_m.is_none() => curve(field, field.surface()?),
        (Some(field), _) => maps(field, field.surface()?),
        (None, around) => solid(around?),
    }
}

fn contact() -> (Swatch, &'static str) {
    (Swatch::Cross(PLANNED), "contact")
}

/// Draws mean and band over an interval.
fn curve(field: &HeightField, surface: &Posterior) -> Option<String> {
    let (zone, per_m) = (field.zone(), Length::of(field.zone()).per_m);
    let places = zone.grid(STEPS);
    let means_m = surface.means(places.iter().map(Vec::as_slice));
    let bands_m = field.bands_m(&places)?;
    let drawn = is_drawn(field, &places);
    let all = || places.iter().zip(&means_m).zip(&bands_m).zip(&drawn);
    let shown = all().filter(|(_, is_drawn)| **is_drawn).flat_map(|((_, band_m), _)| band_m);
    let heights = Axis::around(shown.map(|end_m| end_m * per_m), 0.05, 5.0)?;

    let most = Area { left: LEFT_PX, top: TOP_PX - 20.0, width: CURVE_PX.0, height: CURVE_PX.1 };
    let panel = belief_panel(zone, heights, most, EQUAL_HEIGHT_PX);
    let entries = [
        (Swatch::Line(style::stroke(INK, 1.6)), "mean"),
        (Swatch::Band(INK), "95 % band"),
        contact(),
    ];
    let size = [panel.area.right() + 20.0, panel.area.bottom() + 48.0];
    let mut sheet = FigureLayout::new(size, panel.area, [0.0; 2], size[0], "", entries);
    let panel = Panel { area: sheet.area(0, 0.0), ..panel };
    let (canvas, unit) = (&mut sheet.canvas, Length::of(zone));
    panel.titled_frame(canvas, "", &unit.named("x"), &unit.named("height"));
    let (mut mean, mut band) = (Vec::new(), Vec::new());
    for (((place, mean_m), [low_m, high_m]), is_drawn) in all() {
        let value = |height_m: f64| if *is_drawn { height_m * per_m } else { f64::NAN };
        mean.push((place[0] * per_m, value(*mean_m)));
        band.push((place[0] * per_m, value(*low_m), value(*high_m)));
    }
    panel.band(canvas, &band, INK);
    panel.curve(canvas, &mean, &style::stroke(INK, 1.6));
    canvas.clipped(panel.area, |canvas| {
        let seen = surface.observations();
        for (i, height_m) in seen.heights().iter().enumerate() {
            let x_m = seen.place(i).next().unwrap_or(f64::NAN);
            canvas.cross(panel.at(x_m * per_m, height_m * per_m), PLANNED);
        }
    });
    Some(sheet.canvas.finish())
}

/// Draws maps of the mean and of the width of the band over a rectangle.
fn maps(field: &HeightField, surface: &Posterior) -> Option<String> {
    let (zone, unit) = (field.zone(), Length::of(field.zone()));
    let per_m = unit.per_m;
    let sides = [zone.x_m, zone.z_m?].map(|side| side.map(|end_m| end_m * per_m));
    let [x, z] = sides.map(|[low, high]| Axis::linear(low, high, 5.0));
    let most = Area { left: LEFT_PX, top: TOP_PX, width: MAP_PX.0, height: MAP_PX.1 };
    let shape = Panel::equal(most, x, z);
    let step_px = shape.area.width + GAP_PX;
    let size = [LEFT_PX + 2.0 * step_px - GAP_PX + 30.0, shape.area.bottom() + FOOT_PX];
    let entries = [contact(), (Swatch::Circle(target()), "target")];
    let mut sheet = FigureLayout::new(size, shape.area, [step_px, 0.0], size[0], "", entries);

    // The zone's part of a panel, all of it unless the zone is far from square.
    let [[left, bottom], [right, top]] = [0, 1].map(|end| shape.at(sides[0][end], sides[1][end]));
    let within = Area { left, top, width: right - left, height: bottom - top };
    let mut lowest_m = 0.0;
    let heights = HeatMap::new(zone, within, |places| {
        let means_m = surface.means(places.iter().map(Vec::as_slice));
        let drawn = is_drawn(field, &places);
        let shown = means_m.iter().zip(&drawn).filter(|(_, is_drawn)| **is_drawn);
        lowest_m = shown.map(|(mean_m, _)| *mean_m).fold(f64::INFINITY, f64::min);
        let above = means_m.into_iter().map(|mean_m| mean_m - lowest_m);
        places.into_iter().zip(above).zip(drawn).map(|((at, value), is)| (at, value, is)).collect()
    });
    let widths = HeatMap::new(zone, within, |places| {
        let bands_m = field.bands_m(&places).unwrap_or_default();
        let drawn = is_drawn(field, &places);
        let widths = bands_m.into_iter().map(|[low_m, high_m]| high_m - low_m);
        places.into_iter().zip(widths).zip(drawn).map(|((at, value), is)| (at, value, is)).collect()
    });
    type Colour = fn(f64) -> String;
    let panels: [(HeatMap, f64, &str, Colour); 2] = [
        (heights, lowest_m, "mean height", |share| style::height(share, 1.0)),
        (widths, 0.0, "width of the 95 % band", style::deviation),
    ];
    for (column, (map, low_m, title, colour)) in panels.into_iter().enumerate() {
        let panel = Panel { area: sheet.area(column, 0.0), ..shape.clone() };
        let Area { left, width, .. } = panel.area;
        let moved = [left - shape.area.left, panel.area.top - shape.area.top];
        let within = Area { left: within.left + moved[0], top: within.top + moved[1], ..within };
        let canvas = &mut sheet.canvas;
        let z = if column == 0 { unit.named("z") } else { String::new() };
        panel.titled_frame(canvas, &unit.named(title), &unit.named("x"), &z);
        let largest_m = map.largest().max(f64::MIN_POSITIVE);
        map.draw(canvas, within, |value_m| colour(value_m / largest_m));
        let at = |x_m: f64, z_m: f64| panel.at(x_m * per_m, z_m * per_m);
        canvas.clipped(panel.area, |canvas| {
            for place in field.targets() {
                if let [x_m, z_m] = place[..] {
                    canvas.circle(at(x_m, z_m), 2.6, &target());
                }
            }
            let seen = surface.observations();
            for i in 0..seen.len() {
                if let [x_m, z_m] = seen.place(i).collect::<Vec<_>>()[..] {
                    canvas.cross(at(x_m, z_m), PLANNED);
                }
            }
        });
        let axis = Axis::linear(low_m * per_m, (low_m + largest_m) * per_m, 4.0);
        let bar = Area { left, width, top: panel.area.bottom() + 50.0, height: 13.0 };
        colour_bar(canvas, bar, &axis, "", colour);
    }
    Some(sheet.canvas.finish())
}

/// Returns the attributes of a target.
fn target() -> String {
    style::stroke(FAINT_INK, 1.1)
}

/// Returns whether the belief is drawn at each of `places`: it has a value everywhere, also where
/// the zone reaches past the object.
fn is_drawn(field: &HeightField, places: &[Vec<f64>]) -> Vec<bool> {
    field.surface_evidence().silhouette().is_likely(places.iter().map(Vec::as_slice))
}

/// Draws the estimated surface from the front and from behind, coloured by its standard deviation.
fn solid(belief: &ImplicitSurface) -> Option<String> {
    let surface = belief.surface()?;
    let mesh = decimate(&surface.mesh(CELLS)?, TRIANGLES);
    let centre_w = belief.scope().ball.centre_w;
    let touches: Vec<SolidTouch> = (belief.contacts())
        .map(|p_w| SolidTouch {
            aim_w: *p_w,
            along_w: centre_w - p_w,
            contact_w: Some(*p_w),
            path_w: Vec::new(),
            is_initial: false,
        })
        .collect();
    let frame = SurfaceFrame {
        touches: u32::try_from(touches.len()).unwrap_or(u32::MAX),
        sd_m: surface.offsets_m(&mesh.0),
        seen_w: belief.seen().iter().flat_map(|it| it.elements()).map(|it| it.p_w).collect(),
        mesh,
        ..SurfaceFrame::default()
    };
    let sequence = PlannerSurfaces { touches, frames: vec![frame], ..PlannerSurfaces::default() };
    let area = |column: f64| {
        let (width, height) = SOLID_PX;
        Area { left: 10.0 + column * width, top: 4.0, width, height }
    };
    let panels = FilmPanels::new(&sequence, None, [area(0.0), area(1.0), area(1.0)])?;
    let mut canvas = Canvas::new(20.0 + 2.0 * SOLID_PX.0, SOLID_PX.1 + SOLID_FOOT_PX);
    let top = SOLID_PX.1 + 8.0;
    panels.draw(&mut canvas, &sequence.frames[0], [20.0, top]);
    let bar = Area { left: 20.0 + SOLID_PX.0, top, width: SOLID_PX.0 - 40.0, height: 13.0 };
    if let Some(axis) = panels.axis() {
        colour_bar(&mut canvas, bar, axis, "standard deviation (mm)", style::deviation);
    }
    Some(canvas.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use palpate_explore::evidence::Contact;
    use palpate_explore::gp_settings::GpSettings;
    use palpate_explore::task::Zone;

    /// Belief of a plane of slope 0.5 along x after touches at `fractions` of the zone.
    fn belief(zone: Zone, fractions: &[[f64; 2]]) -> Belief {
        let mut belief: Belief = HeightField::new(zone.clone(), GpSettings::default()).into();
        for fraction in fractions {
            let place = zone.at(fraction);
            let p_w = zone.point(&place, 0.5 * place[0]);
            belief.observe(&place.into(), &Contact::new(p_w, Vector3::y()).into());
        }
        if !fractions.is_empty() {
            belief.refit().unwrap();
        }
        belief
    }

    const FRACTIONS: [[f64; 2]; 6] =
        [[0.1, 0.1], [0.9, 0.2], [0.5, 0.5], [0.2, 0.9], [0.8, 0.8], [0.4, 0.3]];

    fn zones() -> [Zone; 2] {
        [None, Some([0.4, 0.5])].map(|z_m| Zone::new([-0.03, 0.03], z_m))
    }

    /// Every contact is a cross, as is the legend's, in each panel; before the first fit there is
    /// no picture.
    #[test]
    fn every_contact_is_drawn() {
        for (zone, panels) in zones().into_iter().zip([1, 2]) {
            assert!(picture(&belief(zone.clone(), &[])).is_none());
            let svg = picture(&belief(zone, &FRACTIONS)).unwrap();
            assert_eq!(svg.matches(PLANNED).count(), 1 + panels * FRACTIONS.len());
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
        }
    }

    /// The map of a plane has its lowest colour on the left, its highest on the right.
    #[test]
    fn heights_are_coloured_from_low_to_high() {
        let [_, rectangle] = zones();
        let svg = picture(&belief(rectangle, &FRACTIONS)).unwrap();
        // Left end of the first cell of a colour in the map, whose cells are drawn as `M x y H`.
        let left_px = |share: f64| -> f64 {
            let fill = format!("fill=\"{}\"", style::height(share, 1.0));
            let path = svg.lines().find(|line| line.contains(&fill) && line.contains('H')).unwrap();
            path.split(['M', ' ']).find_map(|word| word.parse().ok()).unwrap()
        };
        let [low, high] = [0.5 / 64.0, 63.5 / 64.0].map(left_px);
        assert!(low < LEFT_PX + 10.0 && high > low + 100.0, "{low} {high}");
    }
}
