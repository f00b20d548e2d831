//! What a tactile fingertip says, as the two drivers in use send it.
//!
//! `biotac_sensors` (kth-ros-pkg/biotac_driver, BSD) and `sr_robot_msgs` (shadow-robot/sr_common,
//! BSD-3) are packages of ROS 1; in ROS 2 they keep their fields, with that system's header.

use super::definition::{Definition, Described};
use super::header::{Header, Time};
use serde::{Deserialize, Serialize};

/// `biotac_sensors/BioTacData`: one finger, in counts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BioTacData {
    /// Serial number.
    pub bt_serial: String,
    /// Which finger of the hand.
    pub bt_position: u16,
    /// TDC, temperature.
    pub tdc_data: u16,
    /// TAC, change of temperature.
    pub tac_data: u16,
    /// PDC, static pressure.
    pub pdc_data: u16,
    /// PAC, vibration, oldest first.
    pub pac_data: [u16; 22],
    /// E1 to E19.
    pub electrode_data: [u16; 19],
}

impl Described for BioTacData {
    const DEFINITION: Definition = Definition {
        name: "biotac_sensors/msg/BioTacData",
        fields: "string bt_serial\nuint16 bt_position\nuint16 tdc_data\nuint16 tac_data\nuint16 pdc_data\n\
                 uint16[22] pac_data\nuint16[19] electrode_data\n",
        parts: &[],
    };
}

/// `biotac_sensors/BioTacTime`: when the frame was taken, and its channels after that.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BioTacTime {
    /// First channel.
    pub frame_start_time: Time,
    /// Last channel.
    pub frame_end_time: Time,
    /// Offset of TDC; the driver's own arithmetic of offsets is wrong, and they are not used.
    pub tdc_ns_offset: u32,
    /// Offset of TAC.
    pub tac_ns_offset: u32,
    /// Offset of PDC.
    pub pdc_ns_offset: u32,
    /// Offsets of PAC.
    pub pac_ns_offset: [u32; 22],
    /// Offsets of the electrodes.
    pub electrode_ns_offset: [u32; 19],
}

impl Described for BioTacTime {
    const DEFINITION: Definition = Definition {
        name: "biotac_sensors/msg/BioTacTime",
        fields: "builtin_interfaces/Time frame_start_time\nbuiltin_interfaces/Time frame_end_time\n\
                 uint32 tdc_ns_offset\nuint32 tac_ns_offset\nuint32 pdc_ns_offset\n\
                 uint32[22] pac_ns_offset\nuint32[19] electrode_ns_offset\n",
        parts: &[&Time::DEFINITION],
    };
}

/// `biotac_sensors/BioTacHand`: one frame of all fingers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BioTacHand<H = Header> {
    /// Host's time at the frame's end.
    pub header: H,
    /// Which hand.
    pub hand_id: String,
    /// One entry per finger.
    pub bt_data: Vec<BioTacData>,
    /// When.
    pub bt_time: BioTacTime,
}

impl<H> Described for BioTacHand<H> {
    const DEFINITION: Definition = Definition {
        name: "biotac_sensors/msg/BioTacHand",
        fields: "std_msgs/Header header\nstring hand_id\nbiotac_sensors/BioTacData[] bt_data\n\
                 biotac_sensors/BioTacTime bt_time\n",
        parts: &[&Header::DEFINITION, &BioTacData::DEFINITION, &BioTacTime::DEFINITION],
    };
}

/// `sr_robot_msgs/Biotac`: one finger. Its channels come one after another over EtherCAT, so that
/// those of one message are of different ages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Biotac {
    /// Vibration, the newest two.
    pub pac0: i16,
    /// Vibration.
    pub pac1: i16,
    /// Vibration, as many as came.
    pub pac: Vec<i16>,
    /// Static pressure.
    pub pdc: i16,
    /// Change of temperature.
    pub tac: i16,
    /// Temperature.
    pub tdc: i16,
    /// Electrodes, 19 or 24 by model.
    pub electrodes: Vec<i16>,
}

impl Described for Biotac {
    const DEFINITION: Definition = Definition {
        name: "sr_robot_msgs/msg/Biotac",
        fields: "int16 pac0\nint16 pac1\nint16[] pac\nint16 pdc\nint16 tac\nint16 tdc\nint16[] electrodes\n",
        parts: &[],
    };
}

/// `sr_robot_msgs/BiotacAll`: the five fingers of a hand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BiotacAll<H = Header> {
    /// Host's time.
    pub header: H,
    /// First finger to thumb.
    pub tactiles: [Biotac; 5],
}

impl<H> Described for BiotacAll<H> {
    const DEFINITION: Definition = Definition {
        name: "sr_robot_msgs/msg/BiotacAll",
        fields: "std_msgs/Header header\nsr_robot_msgs/Biotac[5] tactiles\n",
        parts: &[&Header::DEFINITION, &Biotac::DEFINITION],
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_names_every_part_once() {
        let text = BioTacHand::<Header>::DEFINITION.text();
        for part in ["std_msgs/Header", "biotac_sensors/BioTacData", "builtin_interfaces/Time"] {
            assert_eq!(text.matches(&format!("MSG: {part}\n")).count(), 1, "{part} in {text}");
        }
    }
}
