"""Independent ROS 1 peer on rospy; see ../peer.py."""
import os
import pathlib
import sys
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from peer import VALID_NS, main

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

KINDS = {
    "/joint_states": JointState,
    "/ft_sensor/wrench": WrenchStamped,
    "/pa10/status": DiagnosticArray,
    "/biotac_pub": BIOTAC_HAND,
    "/biotac_pub as BiotacAll": BIOTAC_ALL,
    "/pa10/joint_velocity_cmd": JointTrajectory,
}


class Inbox:
    """Messages on a topic since the last call of take()."""

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


class Link:
    def __init__(self, master):
        os.environ["ROS_MASTER_URI"], os.environ["ROS_IP"] = master, "127.0.0.1"
        rospy.init_node("peer", anonymous=True, disable_signals=True, disable_rostime=True)
        self.command = None

    def inbox(self, name):
        return Inbox(name.split()[0], KINDS[name])

    def publisher(self, name):
        return rospy.Publisher(name, KINDS[name], queue_size=50, tcp_nodelay=True)

    def engage(self):
        self.command = self.publisher("/pa10/joint_velocity_cmd")
        rospy.wait_for_service("/pa10/unhold", 5.0)
        is_done = rospy.ServiceProxy("/pa10/unhold", Trigger)().success
        return [] if is_done else ["the arm is not released"]

    def drive(self, names, velocities):
        message = JointTrajectory(joint_names=names)
        message.header.stamp = rospy.Time.from_sec(time.time())
        message.points = [JointTrajectoryPoint(velocities=velocities, time_from_start=rospy.Duration(0, VALID_NS))]
        self.command.publish(message)

    def seconds(self, stamp):
        return stamp.to_sec()

    def validity_ns(self, point):
        return point.time_from_start.to_nsec()

    def echo(self, span):
        joints, counts = self.publisher("/joint_states"), []

        def answer(message):
            velocities = message.points[0].velocities
            joints.publish(JointState(header=message.header, name=message.joint_names, position=velocities,
                                      velocity=velocities))
            counts.append(1)

        rospy.Subscriber("/pa10/joint_velocity_cmd", JointTrajectory, answer, tcp_nodelay=True)
        time.sleep(span)
        return len(counts)


if __name__ == "__main__":
    main(Link)
