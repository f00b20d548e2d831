//! A tactile frame as the two drivers send it.

use super::message::{BioTacData, BioTacHand, BioTacTime, Biotac, BiotacAll, Header, Time};
use super::transport::Packet;
use palpate_explore::robot::finger::Frame;
use palpate_explore::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS, VIBRATIONS};

/// Reads the frame of a finger out of a packet of the tactile topic; it gets the time `time_s`.
/// None if the hand has no such finger, or one of another model.
pub fn frame(packet: &Packet, finger: usize, time_s: f64) -> Option<Frame> {
    match packet {
        Packet::Hand(hand) => {
            let is_it = |data: &&BioTacData| usize::from(data.bt_position) == finger;
            // The driver counts positions from 1; with one finger its number does not matter.
            let data = match hand.bt_data.as_slice() {
                [only] => only,
                many => many.iter().find(is_it)?,
            };
            Some(Frame {
                time_s,
                electrode_counts: Some(data.electrode_data.map(f64::from)),
                pdc_counts: Some(data.pdc_data.into()),
                pac_counts: Some(data.pac_data.map(f64::from)),
                tdc_counts: Some(data.tdc_data.into()),
                tac_counts: Some(data.tac_data.into()),
                slip: None,
            })
        }
        Packet::Fingers(hand) => {
            let data = hand.tactiles.get(finger)?;
            let electrodes: [i16; ELECTRODES] = data.electrodes.as_slice().try_into().ok()?;
            let pac: Option<[i16; VIBRATIONS]> = data.pac.as_slice().try_into().ok();
            Some(Frame {
                time_s,
                electrode_counts: Some(electrodes.map(f64::from)),
                pdc_counts: Some(data.pdc.into()),
                pac_counts: pac.map(|pac| pac.map(f64::from)),
                tdc_counts: Some(data.tdc.into()),
                tac_counts: Some(data.tac.into()),
                slip: None,
            })
        }
        _ => None,
    }
}

/// The packet of a frame; what the frame lacks is 0 counts.
pub fn packet(frame: &Frame, stamp_s: f64, finger: usize, is_shadow: bool) -> Packet {
    let counts = |value: f64| value.clamp(0.0, FULL_SCALE_COUNTS).round();
    let one = |value: Option<f64>| counts(value.unwrap_or(0.0));
    let electrodes = frame.electrode_counts.unwrap_or_default().map(counts);
    let pac = frame.pac_counts.unwrap_or_default().map(counts);
    let header = Header::new(stamp_s, "");
    if is_shadow {
        let mut hand = BiotacAll { header, ..BiotacAll::default() };
        if let Some(place) = hand.tactiles.get_mut(finger) {
            *place = Biotac {
                pac0: pac[VIBRATIONS - 2] as i16,
                pac1: pac[VIBRATIONS - 1] as i16,
                pac: pac.map(|value| value as i16).into(),
                pdc: one(frame.pdc_counts) as i16,
                tac: one(frame.tac_counts) as i16,
                tdc: one(frame.tdc_counts) as i16,
                electrodes: electrodes.map(|value| value as i16).into(),
            };
        }
        return Packet::Fingers(Box::new(hand));
    }
    let at = Time::from_s(stamp_s);
    Packet::Hand(Box::new(BioTacHand {
        header,
        hand_id: String::new(),
        bt_data: vec![BioTacData {
            bt_serial: String::new(),
            bt_position: finger as u16,
            tdc_data: one(frame.tdc_counts) as u16,
            tac_data: one(frame.tac_counts) as u16,
            pdc_data: one(frame.pdc_counts) as u16,
            pac_data: pac.map(|value| value as u16),
            electrode_data: electrodes.map(|value| value as u16),
        }],
        bt_time: BioTacTime { frame_start_time: at, frame_end_time: at, ..BioTacTime::default() },
    }))
}
