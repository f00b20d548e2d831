//! Conversion of tactile frames from and to the messages of the two drivers.

use super::message::{BioTacData, BioTacHand, BioTacTime, Biotac, BiotacAll, Header, Time};
use super::topics::TactileMessage;
use super::transport::Packet;
use palpate_explore::robot::finger::Frame;
use palpate_explore::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS, VIBRATIONS};

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
