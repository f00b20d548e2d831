"""An independent ROS 2 peer: Eclipse Cyclone DDS, written from the table of topics alone.

    peer.py touch DOMAIN [hand|fingers]   drives a stage along -y until the finger feels something, and back
    peer.py listen DOMAIN SECONDS         counts what an explorer sends, and checks it
    peer.py echo DOMAIN SECONDS           answers every command with a joint state of the same stamp

Prints one JSON object, and exits with 1 if something is not as the table says.
"""
import json
import math
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, byte, float64, int16, int32, sequence, uint16, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Duration(IdlStruct, typename="builtin_interfaces::msg::dds_::Duration_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class JointTrajectoryPoint(IdlStruct, typename="trajectory_msgs::msg::dds_::JointTrajectoryPoint_"):
    positions: sequence[float64]
    velocities: sequence[float64]
    accelerations: sequence[float64]
    effort: sequence[float64]
    time_from_start: Duration


@dataclass
class JointTrajectory(IdlStruct, typename="trajectory_msgs::msg::dds_::JointTrajectory_"):
    header: Header
    joint_names: sequence[str]
    points: sequence[JointTrajectoryPoint]


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Wrench(IdlStruct, typename="geometry_msgs::msg::dds_::Wrench_"):
    force: Vector3
    torque: Vector3


@dataclass
class WrenchStamped(IdlStruct, typename="geometry_msgs::msg::dds_::WrenchStamped_"):
    header: Header
    wrench: Wrench


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class BioTacData(IdlStruct, typename="biotac_sensors::msg::dds_::BioTacData_"):
    bt_serial: str
    bt_position: uint16
    tdc_data: uint16
    tac_data: uint16
    pdc_data: uint16
    pac_data: array[uint16, 22]
    electrode_data: array[uint16, 19]


@dataclass
class BioTacTime(IdlStruct, typename="biotac_sensors::msg::dds_::BioTacTime_"):
    frame_start_time: Time
    frame_end_time: Time
    tdc_ns_offset: uint32
    tac_ns_offset: uint32
    pdc_ns_offset: uint32
    pac_ns_offset: array[uint32, 22]
    electrode_ns_offset: array[uint32, 19]


@dataclass
class BioTacHand(IdlStruct, typename="biotac_sensors::msg::dds_::BioTacHand_"):
    header: Header
    hand_id: str
    bt_data: sequence[BioTacData]
    bt_time: BioTacTime


@dataclass
class Biotac(IdlStruct, typename="sr_robot_msgs::msg::dds_::Biotac_"):
    pac0: int16
    pac1: int16
    pac: sequence[int16]
    pdc: int16
    tac: int16
    tdc: int16
    electrodes: sequence[int16]


@dataclass
class BiotacAll(IdlStruct, typename="sr_robot_msgs::msg::dds_::BiotacAll_"):
    header: Header
    tactiles: array[Biotac, 5]


RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile,
               Policy.History.KeepLast(50))


class Peer:
    def __init__(self, domain):
        self.participant = DomainParticipant(domain)

    def reader(self, name, kind):
        return DataReader(self.participant, Topic(self.participant, "rt" + name, kind, qos=RELIABLE), qos=RELIABLE)

    def writer(self, name, kind):
        return DataWriter(self.participant, Topic(self.participant, "rt" + name, kind, qos=RELIABLE), qos=RELIABLE)


def take(reader):
    # A writer that leaves hands over a sample without data.
    return [sample for sample in reader.take(N=100) if getattr(sample, "header", None) is not None]


def now():
    at = time.time()
    return Time(int(at), int((at % 1) * 1e9))


def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def touch(domain, tactile):
    """One touch with a stage of three slides X, Y, Z: down at 15 mm/s until the pressure rises, and back."""
    peer = Peer(domain)
    joints = peer.reader("/joint_states", JointState)
    wrench = peer.reader("/ft_sensor/wrench", WrenchStamped)
    status = peer.reader("/pa10/status", DiagnosticArray)
    frames = peer.reader("/biotac_pub", BioTacHand if tactile == "hand" else BiotacAll)
    command = peer.writer("/pa10/joint_velocity_cmd", JointTrajectory)
    counts = {"joints": 0, "wrench": 0, "status": 0, "frames": 0}
    rest, felt, pressures, y, moved = [], None, [], [], False
    begun = time.time()
    problems = set()
    while time.time() - begun < 12:
        for message in take(joints):
            counts["joints"] += 1
            if list(message.name) != ["X", "Y", "Z"] or len(message.position) != 3 or len(message.velocity) != 3:
                problems.add(f"joint names {message.name}")
            if abs(seconds(message.header.stamp) - time.time()) > 0.5:
                problems.add("the stamp of a joint state is not now")
            y.append(message.position[1])
        for message in take(wrench):
            counts["wrench"] += 1
            parts = (message.wrench.force.x, message.wrench.torque.z)
            if not all(math.isfinite(part) for part in parts):
                problems.add("a force that is no number")
        for message in take(status):
            counts["status"] += 1
            if message.status[0].name != "pa10" or not message.status[0].values:
                problems.add("a status of something else")
        for message in take(frames):
            counts["frames"] += 1
            data = message.bt_data[0] if tactile == "hand" else message.tactiles[0]
            electrodes = data.electrode_data if tactile == "hand" else data.electrodes
            pressures.append(data.pdc_data if tactile == "hand" else data.pdc)
            if len(electrodes) != 19 or not all(0 < value < 4096 for value in electrodes):
                problems.add(f"electrodes {electrodes}")
        at = time.time() - begun
        # Stand still for a second, go down, and back as soon as the pressure has risen.
        speed = 0.0
        if at < 1.0:
            rest = pressures[-20:]
        elif felt is None:
            speed, moved = -0.015, True
            mean = sum(rest) / max(len(rest), 1)
            if rest and len(pressures) > 3 and min(pressures[-3:]) > mean + 10:
                felt = y[-1]
        elif y[-1] < felt + 0.01:
            speed = 0.02
        else:
            break
        point = JointTrajectoryPoint([], [0.0, speed, 0.0], [], [], Duration(0, 30_000_000))
        command.write(JointTrajectory(Header(now(), ""), ["X", "Y", "Z"], [point]))
        time.sleep(0.004)
    if felt is None or not moved:
        problems.add("nothing was felt")
    if min(counts.values()) < 20:
        problems.add("a topic is silent")
    print(json.dumps({"felt_y_m": felt, "counts": counts, "problems": sorted(problems)}))
    return not problems


def listen(domain, span):
    peer = Peer(domain)
    commands = peer.reader("/pa10/joint_velocity_cmd", JointTrajectory)
    hearts = peer.reader("/palpate/heartbeat", Header)
    count, beats, fastest, problems, ages = 0, 0, 0.0, set(), []
    begun = time.time()
    while time.time() - begun < span:
        for message in take(commands):
            count += 1
            point = message.points[0]
            fastest = max([fastest, *map(abs, point.velocities)])
            ages.append(time.time() - seconds(message.header.stamp))
            if len(message.points) != 1 or len(set(message.joint_names)) != len(point.velocities):
                problems.add(f"names {message.joint_names}")
            if not all(math.isfinite(value) for value in point.velocities) or point.positions:
                problems.add("velocities that are no numbers")
            if point.time_from_start.nanosec != 30_000_000:
                problems.add("a validity that is not that of the table")
        beats += len([beat for beat in hearts.take(N=100) if getattr(beat, "stamp", None)])
        time.sleep(0.001)
    if count < 100 * span / 2 or beats < 20 * span / 2 or fastest == 0.0:
        problems.add("too little was sent")
    if ages and sorted(ages)[len(ages) // 2] > 0.1:
        problems.add("stamps are not of now")
    print(json.dumps({"commands": count, "heartbeats": beats, "fastest_rad_s": fastest,
                      "problems": sorted(problems)}))
    return not problems


def echo(domain, span):
    peer = Peer(domain)
    commands = peer.reader("/pa10/joint_velocity_cmd", JointTrajectory)
    joints = peer.writer("/joint_states", JointState)
    count, begun = 0, time.time()
    while time.time() - begun < span:
        for message in take(commands):
            velocities = list(message.points[0].velocities)
            joints.write(JointState(message.header, message.joint_names, velocities, velocities, []))
            count += 1
        time.sleep(0.0002)
    print(json.dumps({"echoed": count}))
    return True


if __name__ == "__main__":
    what, number = sys.argv[1], int(sys.argv[2])
    if what == "touch":
        done = touch(number, sys.argv[3] if len(sys.argv) > 3 else "hand")
    elif what == "listen":
        done = listen(number, float(sys.argv[3]))
    else:
        done = echo(number, float(sys.argv[3]))
    sys.exit(0 if done else 1)
