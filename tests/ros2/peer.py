"""Independent ROS 2 peer on Eclipse Cyclone DDS; see ../peer.py."""
import pathlib
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, byte, float64, int16, int32, int64, sequence, uint8, uint16, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from messages import Header, Time


@dataclass
class Duration(IdlStruct, typename="builtin_interfaces::msg::dds_::Duration_"):
    sec: int32
    nanosec: uint32


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

# Service std_srvs/Trigger as Cyclone's rmw encodes it: the request's identity precedes the data.
@dataclass
class TriggerRequest(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Request_"):
    guid: uint64
    sequence: int64
    structure_needs_at_least_one_member: uint8


@dataclass
class TriggerResponse(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Response_"):
    guid: uint64
    sequence: int64
    success: bool
    message: str


sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from peer import VALID_NS, main

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile,
               Policy.History.KeepLast(50))

LATCHED = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal,
              Policy.History.KeepLast(1))

JOINTS = ["S1", "S2", "S3", "E1", "E2", "W1", "W2"]
FLAGS = {"servo_on": "True", "brake": "False", "estop": "False", "deadman": "True", "hold": "False"}
SERVICES = ["/pa10/hold", "/pa10/unhold", "/pa10/stop", "/pa10/clear_fault", "/ft_sensor/bias"]

KINDS = {
    "/joint_states": JointState,
    "/ft_sensor/wrench": WrenchStamped,
    "/pa10/status": DiagnosticArray,
    "/biotac_pub": BioTacHand,
    "/biotac_pub as BiotacAll": BiotacAll,
    "/pa10/joint_velocity_cmd": JointTrajectory,
}


class Inbox:
    def __init__(self, reader):
        self.reader = reader

    def take(self):
        # A writer that leaves sends a sample without data.
        is_whole = lambda sample: any(getattr(sample, name, None) is not None for name in ("header", "stamp"))
        return list(filter(is_whole, self.reader.take(N=100)))


class Link:
    def __init__(self, domain):
        self.domain = int(domain)
        self.participant = DomainParticipant(self.domain)
        self.command = None

    def topic(self, name):
        return Topic(self.participant, "rt" + name.split()[0], KINDS[name], qos=RELIABLE)

    def inbox(self, name):
        return Inbox(DataReader(self.participant, self.topic(name), qos=RELIABLE))

    def writer(self, name):
        return DataWriter(self.participant, self.topic(name), qos=RELIABLE)

    def engage(self):
        self.command = self.writer("/pa10/joint_velocity_cmd")
        return []

    def drive(self, names, velocities):
        at = time.time()
        header = Header(Time(int(at), int((at % 1) * 1e9)), "")
        point = JointTrajectoryPoint([], velocities, [], [], Duration(0, VALID_NS))
        self.command.write(JointTrajectory(header, names, [point]))

    def seconds(self, stamp):
        return stamp.sec + 1e-9 * stamp.nanosec

    def validity_ns(self, point):
        return point.time_from_start.nanosec

    def echo(self, span):
        commands, joints = self.inbox("/pa10/joint_velocity_cmd"), self.writer("/joint_states")
        count, begun = 0, time.time()
        while time.time() - begun < span:
            for message in commands.take():
                velocities = list(message.points[0].velocities)
                joints.write(JointState(message.header, message.joint_names, velocities, velocities, []))
                count += 1
            time.sleep(0.0002)
        return count

    def arm(self, span):
        """Simulates an arm at rest. Publishes its status once before any subscriber exists, and its services in
        another participant two seconds later. Returns the services that were called."""
        def now():
            at = time.time()
            return Header(Time(int(at), int((at % 1) * 1e9)), "")

        status = DataWriter(self.participant, self.topic("/pa10/status"), qos=LATCHED)
        flags = [KeyValue(key, value) for key, value in FLAGS.items()]
        status.write(DiagnosticArray(now(), [DiagnosticStatus(bytes([0])[0], "pa10", "", "pa10", flags)]))
        joints, wrench = self.writer("/joint_states"), self.writer("/ft_sensor/wrench")
        tactile = self.writer("/biotac_pub")
        zeros, servers, calls = [0.0] * 7, [], []
        count, begun = 0, time.time()
        while time.time() - begun < span:
            joints.write(JointState(now(), JOINTS, zeros, zeros, []))
            wrench.write(WrenchStamped(now(), Wrench(Vector3(1e-6 * count, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))))
            if count % 2 == 0:
                data = BioTacData("", 1, 2000, 2000, 2000, [2000] * 22, [2000 + count % 7] * 19)
                stamp = now().stamp
                times = BioTacTime(stamp, stamp, 0, 0, 0, [0] * 22, [0] * 19)
                tactile.write(BioTacHand(now(), "", [data], times))
            if not servers and time.time() - begun > 2.0:
                elsewhere = DomainParticipant(self.domain)
                for name in SERVICES:
                    request = Topic(elsewhere, f"rq{name}Request", TriggerRequest, qos=RELIABLE)
                    reply = Topic(elsewhere, f"rr{name}Reply", TriggerResponse, qos=RELIABLE)
                    servers.append((name, DataReader(elsewhere, request, qos=RELIABLE),
                                    DataWriter(elsewhere, reply, qos=RELIABLE)))
            for name, reader, writer in servers:
                for request in reader.take(N=10):
                    if isinstance(request, TriggerRequest):
                        calls.append(name)
                        writer.write(TriggerResponse(request.guid, request.sequence, True, "done"))
            count += 1
            time.sleep(0.005)
        return calls


if __name__ == "__main__":
    main(Link)
