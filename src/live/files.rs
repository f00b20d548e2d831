//! Files of the page: names of meshes that it takes, and the entry that opens it in a browser.

use palpate_input::error::InputError;
use palpate_input::files;
use std::io::Write as _;
use std::path::Path;
use tempfile::NamedTempFile;

/// Endings of mesh files that the page takes: one file holds all.
const ENDINGS: [&str; 4] = ["stl", "obj", "ply", "glb"];

/// Returns the name under which the page's file is stored: letters, digits and `-_.`.
///
/// # Errors
/// If the name does not end as a mesh file does.
pub fn file_name(name: &str) -> Result<String, InputError> {
    let wrong = || {
        let allowed = ENDINGS.join(", .");
        InputError::new(format!("file name {name:?}: allowed are names that end in .{allowed}"))
    };
    let (stem, ending) = name.rsplit_once('.').ok_or_else(wrong)?;
    let ending = ending.to_lowercase();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    let stem: String = stem.chars().map(|c| if is_plain(c) { c } else { '-' }).take(60).collect();
    let stem = stem.trim_matches('-');
    let is_fine = ENDINGS.contains(&ending.as_str()) && !stem.is_empty();
    is_fine.then(|| format!("{stem}.{ending}")).ok_or_else(wrong)
}

/// Writes a file in `folder` that only this user can read and that leads a browser to `url`. Other
/// users see the arguments of a process, so that the token cannot be one.
fn entry_file(folder: &Path, url: &str) -> std::io::Result<NamedTempFile> {
    files::make_folder(folder)?;
    let mut file = tempfile::Builder::new().prefix("live-").suffix(".html").tempfile_in(folder)?;
    write!(
        file,
        "<!doctype html>\n<meta charset=\"utf-8\">\n<title>Palpate live</title>\n\
         <meta http-equiv=\"refresh\" content=\"0;url={url}\">\n<a href=\"{url}\">Palpate live</a>\n"
    )?;
    Ok(file)
}

/// Opens the page if there is a screen, by a file that lasts as long as the returned value. Errors
/// are ignored, because the address is printed.
pub fn open_browser(url: &str) -> Option<NamedTempFile> {
    let has_screen =
        ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    let opener = match () {
        () if cfg!(target_os = "macos") => "open",
        () if has_screen => "xdg-open",
        () => return None,
    };
    let file = entry_file(Path::new("runs"), url).ok()?;
    let path = file.path().canonicalize().ok()?;
    let quiet = || std::process::Stdio::null();
    let _ = std::process::Command::new(opener).arg(path).stdout(quiet()).stderr(quiet()).spawn();
    Some(file)
}

#[cfg(test)]
mod tests {
    use super::file_name;

    #[test]
    fn names_of_files_stay_in_their_folder() {
        for (name, expected) in [
            ("part.stl", Some("part.stl")),
            ("My Part (2).STL", Some("My-Part--2.stl")),
            ("../../etc/part.obj", Some("etc-part.obj")),
            ("..\\part.ply", Some("part.ply")),
            (".stl", None),
            ("part", None),
            ("part.gltf", None),
            ("part.toml", None),
            ("..", None),
        ] {
            assert_eq!(file_name(name).ok().as_deref(), expected, "{name}");
        }
    }
}
