"""Converts the ROS 1 bags of a folder into one CSV file per bag, for tests/suite/real_recordings.rs.

Usage: convert_bags.py BAGS OUT. It needs the Python package rosbags:

    python -m pip install rosbags==0.11.9

The bags are those of https://github.com/peterkty/pnpush: an ABB IRB 120 pushes blocks, 2015. They have no licence, so
they are not part of Palpate. To fetch them (22 bags, 29 MB):

    git clone --filter=blob:none --no-checkout https://github.com/peterkty/pnpush
    cd pnpush
    git sparse-checkout set catkin_ws/src/pnpush_planning/preliminary_push_testing
    git checkout c8352f5fe9a4f03aa07bf3753e04ca7898df6e1f

A row is a message; rows are in order of arrival. Its columns: arrival_s and stamp_s, both since the bag's first
message; kind; values. The kinds:

    joints  positions of joints 1 to 6, rad; the bags have no velocities
    wrench  force x y z, N, and torque x y z, N m, of the sensor at the flange, in the sensor's frame
    tip     position x y z, m, and quaternion x y z w of the arm's tip in its base frame
    pose    the same of the pushed block in the frame of Vicon
"""

import csv
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader


def vector(v):
    return [v.x, v.y, v.z]


def quaternion(q):
    return [q.x, q.y, q.z, q.w]


# Values of a message of each kind.
VALUES = {
    "joints": lambda message: list(message.position),
    "wrench": lambda message: vector(message.wrench.force) + vector(message.wrench.torque),
    "tip": lambda message: vector(message.pose.position) + quaternion(message.pose.orientation),
    "pose": lambda message: vector(message.transform.translation) + quaternion(message.transform.rotation),
}

KINDS = {"/joint_states": "joints", "/netft_data": "wrench", "/tip_pose": "tip"}


def kind_of(connection):
    """Returns the kind of a topic's messages, or None for a topic that is not converted."""
    if connection.topic.startswith("/vicon/") and connection.msgtype == "geometry_msgs/msg/TransformStamped":
        return "pose"
    return KINDS.get(connection.topic)


def convert(bag, out):
    """Writes the messages of a bag to the file `out`; returns their number."""
    count = 0
    with AnyReader([bag]) as reader, out.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["arrival_s", "stamp_s", "kind", "values"])
        begun_ns = reader.start_time
        for connection, arrival_ns, raw in reader.messages():
            kind = kind_of(connection)
            if kind is None:
                continue
            message = reader.deserialize(raw, connection.msgtype)
            stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            times = [f"{(ns - begun_ns) / 1e9:.6f}" for ns in (arrival_ns, stamp_ns)]
            rows.writerow([*times, kind, *(f"{value:.9g}" for value in VALUES[kind](message))])
            count += 1
    return count


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: convert_bags.py BAGS OUT")
    bags, out = map(Path, sys.argv[1:])
    found = sorted(bags.rglob("*.bag"))
    if not found:
        sys.exit(f"{bags}: no *.bag below it")
    out.mkdir(parents=True, exist_ok=True)
    for bag in found:
        print(f"{bag.stem}: {convert(bag, out / f'{bag.stem}.csv')} messages")


if __name__ == "__main__":
    main()
