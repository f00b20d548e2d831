//! Results of a fit to recorded contacts: sentences, table, mesh and page.

use super::belief::picture;
use super::html::{figure, page, section, tables};
use super::points::PointCloud;
use super::solid::SurfaceFrame;
use super::table::{Column, Table};
use crate::study::fit::{FitResult, HeldOut};
use palpate_input::format::counted;

/// Cells along the longest side of the mesh of a whole object.
const CELLS: u32 = 64;

/// Returns what was fitted, and its error on held-out groups, a sentence each.
pub fn sentences(fit: &FitResult, name: &str) -> Vec<String> {
    let [used, all] = fit.counts;
    let mut sentences = vec![match used == all {
        true => format!("{name}: {} fitted", counted(all, "contact")),
        false => format!("{name}: {used} of {} fitted, evenly thinned", counted(all, "contact")),
    }];
    if let (Some(rms_m), Some(coverage)) = (fit.rms_m(), fit.coverage()) {
        let groups = if fit.has_groups { "their group" } else { "a twentieth of the contacts" };
        sentences.push(format!(
            "held out with {groups}, contacts lie {:.2} mm (rms) from the surface that the others \
             give, {:.0} % of {} within the 95 % band",
            1e3 * rms_m,
            100.0 * coverage,
            fit.held_out.len()
        ));
    }
    if fit.sd_factor > 1.0 {
        sentences.push(format!(
            "standard deviations are multiplied by {:.2}, so that the band holds for held-out groups",
            fit.sd_factor
        ));
    }
    if fit.inward > 0.5 {
        sentences.push(format!(
            "{:.0} % of the normals point inward: correct their signs, they point from the surface to \
             the finger",
            100.0 * fit.inward
        ));
    }
    if let Some(common_m) = fit.common_m() {
        sentences.push(format!(
            "contacts of a group are off together by {:.2} mm (standard deviation, learned)",
            1e3 * common_m
        ));
    }
    sentences
}

/// Returns the held-out contacts, a row each.
pub fn held_out(fit: &FitResult) -> Table {
    let mut table = Table::new([
        Column::new("group"),
        Column::new("x_m"),
        Column::new("y_m"),
        Column::new("z_m"),
        Column::new("distance_m").unit("mm", 1e3, 2),
        Column::new("predicted_m").unit("mm", 1e3, 2),
        Column::new("sd_m").unit("mm", 1e3, 2),
        Column::new("in_band"),
    ]);
    table.rows = (fit.held_out.iter())
        .map(|it: &HeldOut| {
            let [x, y, z]: [f64; 3] = it.p_w.coords.into();
            let is_in = if it.is_covered() { "yes" } else { "no" };
            vec![
                it.group.as_str().into(),
                x.into(),
                y.into(),
                z.into(),
                it.distance_m.into(),
                it.deviation.mean_m.into(),
                it.deviation.sd_m.into(),
                is_in.into(),
            ]
        })
        .collect();
    table
}

/// Returns the groups with their errors when left out, the largest first.
fn groups(fit: &FitResult) -> Table {
    let mut table = Table::new([
        Column::new("group").title("group left out"),
        Column::new("contacts"),
        Column::new("rms_m").title("distance from the surface, rms").unit("mm", 1e3, 2),
        Column::new("in_band").title("in the 95 % band").unit("%", 100.0, 0),
    ]);
    let mut names: Vec<&str> = Vec::new();
    for it in &fit.held_out {
        if !names.contains(&it.group.as_str()) {
            names.push(&it.group);
        }
    }
    let mut rows: Vec<(&str, usize, f64, f64)> = (names.into_iter())
        .map(|name| {
            let of: Vec<&HeldOut> = fit.held_out.iter().filter(|it| it.group == name).collect();
            let count = of.len() as f64;
            let squares: f64 = of.iter().map(|it| it.distance_m.powi(2)).sum();
            let covered = of.iter().filter(|it| it.is_covered()).count() as f64;
            (name, of.len(), (squares / count).sqrt(), covered / count)
        })
        .collect();
    rows.sort_by(|a, b| b.2.total_cmp(&a.2));
    table.rows = (rows.into_iter())
        .map(|(name, count, rms_m, covered)| {
            vec![name.into(), count.into(), rms_m.into(), covered.into()]
        })
        .collect();
    table
}

/// Returns the estimated surface with its standard deviation; `None` without a surface.
pub fn mesh(fit: &FitResult, name: &str) -> Option<PointCloud> {
    let around = fit.belief.implicit_surface().and_then(|it| it.surface());
    let (vertices, triangles, sds_m) = match around {
        Some(surface) => {
            let mesh = surface.mesh(CELLS)?;
            let sds_m = surface.offsets_m(mesh.vertices());
            (mesh.vertices().to_vec(), mesh.triangles().to_vec(), sds_m)
        }
        None => {
            let shape = fit.belief.shape()?;
            (shape.points_w, shape.triangles, shape.sds_m)
        }
    };
    let frame =
        SurfaceFrame { mesh: (vertices, triangles), sd_m: sds_m, ..SurfaceFrame::default() };
    Some(frame.points(vec![
        format!("Palpate {}: surface fitted to {name}", env!("CARGO_PKG_VERSION")),
        "metres in the frame of the file".into(),
        "sigma_m: standard deviation of the surface along its normal".into(),
    ]))
}

/// Returns the page as HTML.
pub fn html(fit: &FitResult, name: &str) -> String {
    let drawing = picture(&fit.belief).map_or_else(String::new, |svg| {
        figure(
            "surface",
            &svg,
            "Estimated surface, coloured by its standard deviation, with the contacts.",
        )
    });
    let words: String = sentences(fit, name)
        .iter()
        .map(|it| format!("<p>{}</p>\n", super::canvas::escape(it)))
        .collect();
    let groups = tables(
        "Held-out groups",
        &[groups(fit)],
        "named",
        "Each group is predicted by a surface that was fitted to all others.",
    );
    let files = "<p class=\"note\">surface.ply: the surface with its standard deviation · \
                 held_out.csv: a row per contact · belief.json: the belief, for \
                 <code>palpate.Belief.from_json</code></p>\n";
    let body = [section("", &words), drawing, groups, section("Files", files)].concat();
    page("Palpate fit", name, "", &body)
}
