//! Conversion of a fingertip's samples from and to the messages of their drivers.

use super::message::{
    BioTacData, BioTacHand, BioTacTime, Biotac, BiotacAll, Header, Image, Time, Touching,
};
use super::topics::TactileMessage;
use super::transport::Packet;
use palpate_explore::backend::Sample;
use palpate_explore::robot::finger::Frame;
use palpate_explore::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS, VIBRATIONS};
use palpate_explore::robot::sensor::DepthImage;

/// Encoding of a depth image: metres (REP 118).
const DEPTHS: &str = "32FC1";

impl Image {
    /// Creates the message of a depth image.
    pub fn of(image: &DepthImage, stamp_s: f64) -> Self {
        let [width, height] = image.pixels.map(|count| count as u32);
        Self {
            header: Header::new(stamp_s, "P"),
            height,
            width,
            encoding: DEPTHS.into(),
            is_bigendian: 0,
            step: 4 * width,
            data: image.depths_m.iter().flat_map(|depth_m| depth_m.to_le_bytes()).collect(),
        }
    }

    /// Returns the depth image, with the time `time_s`.
    ///
    /// # Errors
    /// If the encoding is another, or the data are shorter than the image.
    fn depths(&self, time_s: f64) -> Result<DepthImage, String> {
        let Self { height, width, encoding, step, data, .. } = self;
        if encoding != DEPTHS {
            return Err(format!(
                "encoding \"{encoding}\"; allowed is \"{DEPTHS}\", depths in metres"
            ));
        }
        let (rows, columns) = (*height as usize, *width as usize);
        let pitch = (*step as usize).max(4 * columns);
        let is_whole = rows.checked_mul(pitch).is_some_and(|size| data.len() >= size);
        if !is_whole || rows * columns == 0 {
            let bytes = data.len();
            return Err(format!("{width} by {height} pixels of step {step} in {bytes} bytes"));
        }
        let number = |bytes: &[u8]| {
            let bytes = <[u8; 4]>::try_from(bytes).unwrap_or_default();
            if self.is_bigendian == 0 {
                f32::from_le_bytes(bytes)
            } else {
                f32::from_be_bytes(bytes)
            }
        };
        let row = |row: &[u8]| row[..4 * columns].chunks_exact(4).map(number).collect::<Vec<_>>();
        let depths_m = data.chunks_exact(pitch).take(rows).flat_map(row).collect();
        Ok(DepthImage { time_s, pixels: [columns, rows], depths_m })
    }
}

/// Reads the sample in a packet of the tactile topic, with the time `time_s`.
///
/// # Errors
/// If the hand lacks this finger, its model differs, or it is no depth image.
pub fn sample(packet: &Packet, finger: usize, time_s: f64) -> Result<Sample, String> {
    match packet {
        Packet::Touching(touching) => Ok(Sample::Flag(touching.data)),
        Packet::Depth(image) => image.depths(time_s).map(Sample::Depth),
        packet => frame(packet, finger, time_s)
            .map(Sample::BioTac)
            .ok_or_else(|| format!("the message has no finger {finger} with 19 electrodes")),
    }
}

/// Returns the packet of a sample, if the topic's messages can have it.
pub fn packet_of(
    sample: &Sample,
    stamp_s: f64,
    finger: usize,
    message: TactileMessage,
) -> Option<Packet> {
    match (sample, message) {
        (Sample::BioTac(frame), TactileMessage::Hand | TactileMessage::Fingers) => {
            Some(packet(frame, stamp_s, finger, message))
        }
        (Sample::Flag(data), TactileMessage::Flag) => Some(Touching { data: *data }.into()),
        (Sample::Depth(image), TactileMessage::Depth) => Some(Image::of(image, stamp_s).into()),
        _ => None,
    }
}

/// Reads the frame of a finger from a packet of the tactile topic, with the time `time_s`. Returns
/// `None` if the hand lacks this finger, or its model differs.
pub fn frame(packet: &Packet, finger: usize, time_s: f64) -> Option<Frame> {
    let (electrodes, pac, [pdc, tdc, tac]) = match packet {
        Packet::Hand(hand) => {
            let is_it = |data: &&BioTacData| usize::from(data.bt_position) == finger;
            // The driver numbers positions from 1; with one finger the number is ignored.
            let data = match hand.bt_data.as_slice() {
                [only] => only,
                many => many.iter().find(is_it)?,
            };
            let single = [data.pdc_data, data.tdc_data, data.tac_data].map(f64::from);
            (data.electrode_data.map(f64::from), Some(data.pac_data.map(f64::from)), single)
        }
        Packet::Fingers(hand) => {
            let data = hand.tactiles.get(finger)?;
            let electrodes: [i16; ELECTRODES] = data.electrodes.as_slice().try_into().ok()?;
            let pac: Option<[i16; VIBRATIONS]> = data.pac.as_slice().try_into().ok();
            let single = [data.pdc, data.tdc, data.tac].map(f64::from);
            (electrodes.map(f64::from), pac.map(|pac| pac.map(f64::from)), single)
        }
        _ => return None,
    };
    Some(Frame {
        time_s,
        electrode_counts: Some(electrodes),
        pdc_counts: Some(pdc),
        pac_counts: pac,
        tdc_counts: Some(tdc),
        tac_counts: Some(tac),
        slip: None,
    })
}

/// Writes a frame to `data` in the format of the BioTac's own driver: whole counts, 0 for missing
/// channels.
pub fn fill(data: &mut BioTacData, frame: &Frame) {
    let whole =
        |counts: Option<f64>| counts.unwrap_or(0.0).clamp(0.0, FULL_SCALE_COUNTS).round() as u16;
    data.pdc_data = whole(frame.pdc_counts);
    data.tdc_data = whole(frame.tdc_counts);
    data.tac_data = whole(frame.tac_counts);
    data.pac_data = std::array::from_fn(|i| whole(frame.pac_counts.map(|all| all[i])));
    data.electrode_data = std::array::from_fn(|i| whole(frame.electrode_counts.map(|all| all[i])));
}

/// Returns the packet of a frame; missing channels are 0 counts.
pub fn packet(frame: &Frame, stamp_s: f64, finger: usize, message: TactileMessage) -> Packet {
    let mut data = BioTacData { bt_position: finger as u16, ..BioTacData::default() };
    fill(&mut data, frame);
    let header = Header::new(stamp_s, "");
    if message == TactileMessage::Hand {
        let at = Time::from_s(stamp_s);
        return Packet::Hand(Box::new(BioTacHand {
            header,
            hand_id: String::new(),
            bt_data: vec![data],
            bt_time: BioTacTime {
                frame_start_time: at,
                frame_end_time: at,
                ..BioTacTime::default()
            },
        }));
    }
    let mut hand = BiotacAll { header, ..BiotacAll::default() };
    if let Some(place) = hand.tactiles.get_mut(finger) {
        let pac = data.pac_data.map(|value| value as i16);
        *place = Biotac {
            pac0: pac[VIBRATIONS - 2],
            pac1: pac[VIBRATIONS - 1],
            pac: pac.into(),
            pdc: data.pdc_data as i16,
            tac: data.tac_data as i16,
            tdc: data.tdc_data as i16,
            electrodes: data.electrode_data.map(|value| value as i16).into(),
        };
    }
    Packet::Fingers(Box::new(hand))
}
