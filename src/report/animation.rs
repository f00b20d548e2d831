//! Animations of drawings: GIF by this program, MP4 by ffmpeg.
//!
//! Frames have equal sizes. A GIF has the same bytes on every machine of one kind.

use super::raster::pixels;
use anyhow::{Context, anyhow};
use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Extension, Frame, Repeat};
use palpate_input::files;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use resvg::tiny_skia::Pixmap;
use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::process::{Command, Stdio};

/// Duration of a frame, and of the last one, in hundredths of a second.
const FRAME_CS: [u16; 2] = [20, 300];

/// Pixels per unit of the drawing. A film has more of them at little cost.
const GIF_SCALE: f32 = 1.0;
const MP4_SCALE: f32 = 2.0;

/// Colours of a GIF; the index after them marks a pixel that does not change.
const COLOURS: usize = 255;
const UNCHANGED: u8 = COLOURS as u8;

/// Inverse of the fraction of the colours that train the palette.
const SAMPLED: i32 = 3;

/// Comment that marks a file as the program's own.
const SIGNED: &[u8] = b"drawn by Palpate";

const PAPER: [u8; 4] = [255; 4];

fn rgba(pixels: &Pixmap) -> &[[u8; 4]] {
    pixels.data().as_chunks().0
}

/// Encodes drawings, SVGs on opaque paper, as a GIF that repeats.
///
/// # Errors
/// If a drawing is not an SVG, or too large.
pub fn gif(drawings: &[String]) -> anyhow::Result<Vec<u8>> {
    let frames = drawings.par_iter().map(|svg| pixels(svg, GIF_SCALE));
    let frames: Vec<Pixmap> = frames.collect::<anyhow::Result<_>>()?;
    let first = frames.first().context("a film needs a frame")?;
    let [width, height] = [first.width(), first.height()].map(u16::try_from);
    let (width, height) =
        (width.context("too wide for a GIF")?, height.context("too high for a GIF")?);

    // One palette for all frames, so that colours do not flicker. Each colour counts once in a
    // frame; otherwise the paper would take most of the palette.
    let of_frame = |frame: &Pixmap| rgba(frame).iter().copied().collect::<BTreeSet<[u8; 4]>>();
    let of_frames: Vec<BTreeSet<[u8; 4]>> = frames.par_iter().map(of_frame).collect();
    let sample: Vec<u8> = of_frames.iter().flatten().flatten().copied().collect();
    let colours: BTreeSet<[u8; 4]> = of_frames.into_iter().flatten().collect();
    let network = NeuQuant::new(SAMPLED, COLOURS, &sample);
    let index = |colour: &[u8; 4]| network.index_of(colour) as u8;
    let indices: HashMap<[u8; 4], u8> =
        colours.iter().map(|colour| (*colour, index(colour))).collect();
    let mut palette = network.color_map_rgb();
    let paper = 3 * usize::from(index(&PAPER));
    palette[paper..paper + 3].fill(u8::MAX);

    let mut encoder = Encoder::new(Vec::new(), width, height, &palette)?;
    encoder.set_repeat(Repeat::Infinite)?;
    encoder.write_raw_extension(Extension::Comment.into(), &[SIGNED])?;
    let mut before: Vec<Option<u8>> = vec![None; rgba(first).len()];
    for (i, frame) in frames.iter().enumerate() {
        let pixels = rgba(frame).iter().zip(&mut before).map(|(colour, before)| {
            let index = indices.get(colour).copied();
            let is_new = std::mem::replace(before, index) != index;
            index.filter(|_| is_new).unwrap_or(UNCHANGED)
        });
        encoder.write_frame(&Frame {
            delay: FRAME_CS[usize::from(i + 1 == frames.len())],
            dispose: DisposalMethod::Keep,
            transparent: Some(UNCHANGED),
            width,
            height,
            buffer: pixels.collect(),
            ..Frame::default()
        })?;
    }
    Ok(encoder.into_inner()?)
}

/// Checks that ffmpeg can be run.
///
/// # Errors
/// If it cannot, with the remedy.
pub fn check_ffmpeg() -> anyhow::Result<()> {
    let version = Command::new("ffmpeg").arg("-version").stdin(Stdio::null()).output();
    version.map(drop).map_err(no_ffmpeg)
}

fn no_ffmpeg(error: io::Error) -> anyhow::Error {
    anyhow!(
        "ffmpeg, which writes MP4 files, cannot be run: {error}; install it (Debian: apt-get install \
         ffmpeg), or use a file ending in .gif"
    )
}

/// Writes drawings, SVGs on opaque paper, as an MP4 file.
///
/// # Errors
/// If a drawing is not an SVG, ffmpeg cannot be run or fails, or the file cannot be written.
pub fn mp4(drawings: &[String], path: &Path) -> anyhow::Result<()> {
    let first = pixels(drawings.first().context("a film needs a frame")?, MP4_SCALE)?;
    let partial = files::partial_path(path);
    // Replaces a symbolic link, which ffmpeg would follow.
    files::create(&partial).with_context(|| partial.display().to_string())?;
    let size = format!("{}x{}", first.width(), first.height());
    let rate = format!("100/{}", FRAME_CS[0]);
    let input = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", &size, "-r", &rate, "-i", "-"];
    // Pixels in a format that all players read.
    let codec = ["-c:v", "libx264", "-pix_fmt", "yuv420p"];
    // The comment, at the end of the file, marks it as the program's own.
    let output = ["-metadata", "comment=drawn by Palpate", "-f", "mp4"];
    // A path may begin with a hyphen or contain a colon.
    let mut file = OsString::from("file:");
    file.push(&partial);
    let mut child = Command::new("ffmpeg")
        .args(["-loglevel", "error", "-y"])
        .args(input)
        .args(codec)
        .args(output)
        .arg(file)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| {
            let _ = files::remove(&partial);
            no_ffmpeg(error)
        })?;
    let mut pipe = child.stdin.take().context("ffmpeg has no input")?;
    let held = usize::from(FRAME_CS[1] / FRAME_CS[0]);
    let mut send = || -> anyhow::Result<()> {
        for (i, svg) in drawings.iter().enumerate() {
            let frame = pixels(svg, MP4_SCALE)?;
            let times = if i + 1 == drawings.len() { held } else { 1 };
            (0..times).try_for_each(|_| pipe.write_all(frame.data()))?;
        }
        Ok(())
    };
    let sent = send();
    drop(pipe);
    let ended = child.wait_with_output().context("ffmpeg")?;
    let written = match ended.status.success() {
        true => sent.and_then(|()| Ok(fs::rename(&partial, path)?)),
        false => Err(anyhow!("ffmpeg failed: {}", String::from_utf8_lossy(&ended.stderr).trim())),
    };
    if written.is_err() {
        let _ = files::remove(&partial);
    }
    written.with_context(|| path.display().to_string())
}
