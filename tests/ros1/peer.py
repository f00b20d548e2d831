"""An independent ROS 1 peer: rospy, written from the table of topics alone.

    peer.py touch MASTER [hand|fingers]   drives a stage along -y until the finger feels something, and back
    peer.py listen MASTER SECONDS         counts what an explorer sends, and checks it
    peer.py echo MASTER SECONDS           answers every command with a joint state of the same stamp

Prints one JSON object, and exits with 1 if something is not as the table says.
"""
import json
import math
import os
import sys
import threading
import time

MASTER = sys.argv[2]
os.environ["ROS_MASTER_URI"], os.environ["ROS_IP"] = MASTER, "127.0.0.1"

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

HEADER = "=" * 80 + "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
BIOTAC_HAND = generate_dynamic("biotac_sensors/BioTacHand", f"""std_msgs/Header header
string hand_id
biotac_sensors/BioTacData[] bt_data
biotac_sensors/BioTacTime bt_time
{HEADER}{"=" * 80}
MSG: biotac_sensors/BioTacData
string bt_serial
uint16 bt_position
uint16 tdc_data
uint16 tac_data
uint16 pdc_data
uint16[22] pac_data
uint16[19] electrode_data
{"=" * 80}
MSG: biotac_sensors/BioTacTime
time frame_start_time
time frame_end_time
uint32 tdc_ns_offset
uint32 tac_ns_offset
uint32 pdc_ns_offset
uint32[22] pac_ns_offset
uint32[19] electrode_ns_offset
""")["biotac_sensors/BioTacHand"]
BIOTAC_ALL = generate_dynamic("sr_robot_msgs/BiotacAll", f"""std_msgs/Header header
sr_robot_msgs/Biotac[5] tactiles
{HEADER}{"=" * 80}
MSG: sr_robot_msgs/Biotac
int16 pac0
int16 pac1
int16[] pac
int16 pdc
int16 tac
int16 tdc
int16[] electrodes
""")["sr_robot_msgs/BiotacAll"]


class Inbox:
    """What has come on a topic since it was last looked at."""

    def __init__(self, name, kind):
        self.lock, self.messages = threading.Lock(), []
        self.subscriber = rospy.Subscriber(name, kind, self.put, tcp_nodelay=True)

    def put(self, message):
        with self.lock:
            self.messages.append(message)

    def take(self):
        with self.lock:
            messages, self.messages = self.messages, []
        return messages


def touch(tactile):
    """One touch with a stage of three slides X, Y, Z: down at 15 mm/s until the pressure rises, and back."""
    joints = Inbox("/joint_states", JointState)
    wrench = Inbox("/ft_sensor/wrench", WrenchStamped)
    status = Inbox("/pa10/status", DiagnosticArray)
    frames = Inbox("/biotac_pub", BIOTAC_HAND if tactile == "hand" else BIOTAC_ALL)
    command = rospy.Publisher("/pa10/joint_velocity_cmd", JointTrajectory, queue_size=10, tcp_nodelay=True)
    counts = {"joints": 0, "wrench": 0, "status": 0, "frames": 0}
    rest, felt, pressures, y, moved = [], None, [], [], False
    problems = set()
    rospy.wait_for_service("/pa10/unhold", 5.0)
    if not rospy.ServiceProxy("/pa10/unhold", Trigger)().success:
        problems.add("the arm is not released")
    begun = time.time()
    while time.time() - begun < 12:
        for message in joints.take():
            counts["joints"] += 1
            if list(message.name) != ["X", "Y", "Z"] or len(message.position) != 3 or len(message.velocity) != 3:
                problems.add(f"joint names {message.name}")
            if abs(message.header.stamp.to_sec() - time.time()) > 0.5:
                problems.add("the stamp of a joint state is not now")
            y.append(message.position[1])
        for message in wrench.take():
            counts["wrench"] += 1
            if not all(map(math.isfinite, (message.wrench.force.x, message.wrench.torque.z))):
                problems.add("a force that is no number")
        for message in status.take():
            counts["status"] += 1
            if message.status[0].name != "pa10" or not message.status[0].values:
                problems.add("a status of something else")
        for message in frames.take():
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
        message = JointTrajectory(joint_names=["X", "Y", "Z"])
        message.header.stamp = rospy.Time.from_sec(time.time())
        message.points = [JointTrajectoryPoint(velocities=[0.0, speed, 0.0],
                                               time_from_start=rospy.Duration.from_sec(0.03))]
        command.publish(message)
        time.sleep(0.004)
    if felt is None or not moved:
        problems.add("nothing was felt")
    if min(counts.values()) < 20:
        problems.add("a topic is silent")
    print(json.dumps({"felt_y_m": felt, "counts": counts, "problems": sorted(problems)}))
    return not problems


def listen(span):
    commands = Inbox("/pa10/joint_velocity_cmd", JointTrajectory)
    hearts = Inbox("/palpate/heartbeat", Header)
    count, beats, fastest, problems, ages = 0, 0, 0.0, set(), []
    begun = time.time()
    while time.time() - begun < span:
        for message in commands.take():
            count += 1
            point = message.points[0]
            fastest = max([fastest, *map(abs, point.velocities)])
            ages.append(time.time() - message.header.stamp.to_sec())
            if len(message.points) != 1 or len(set(message.joint_names)) != len(point.velocities):
                problems.add(f"names {message.joint_names}")
            if not all(math.isfinite(value) for value in point.velocities) or point.positions:
                problems.add("velocities that are no numbers")
            if point.time_from_start.to_nsec() != 30_000_000:
                problems.add("a validity that is not that of the table")
        beats += len(hearts.take())
        time.sleep(0.001)
    if count < 100 * span / 2 or beats < 20 * span / 2 or fastest == 0.0:
        problems.add("too little was sent")
    if ages and sorted(ages)[len(ages) // 2] > 0.1:
        problems.add("stamps are not of now")
    print(json.dumps({"commands": count, "heartbeats": beats, "fastest_rad_s": fastest,
                      "problems": sorted(problems)}))
    return not problems


def echo(span):
    joints = rospy.Publisher("/joint_states", JointState, queue_size=50, tcp_nodelay=True)
    counts = []

    def answer(message):
        velocities = message.points[0].velocities
        joints.publish(JointState(header=message.header, name=message.joint_names, position=velocities,
                                  velocity=velocities))
        counts.append(1)

    rospy.Subscriber("/pa10/joint_velocity_cmd", JointTrajectory, answer, tcp_nodelay=True)
    time.sleep(span)
    print(json.dumps({"echoed": len(counts)}))
    return True


if __name__ == "__main__":
    rospy.init_node("peer", anonymous=True, disable_signals=True, disable_rostime=True)
    what, more = sys.argv[1], sys.argv[3:]
    if what == "touch":
        done = touch(more[0] if more else "hand")
    elif what == "listen":
        done = listen(float(more[0]))
    else:
        done = echo(float(more[0]))
    sys.exit(0 if done else 1)
