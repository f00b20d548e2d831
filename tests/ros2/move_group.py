"""Subscriber of collision objects as a stock move_group of MoveIt 2, on Eclipse Cyclone DDS.

    move_group.py DOMAIN FOLDER     writes each object to FOLDER/NUMBER.json until its standard input closes

Messages: moveit_msgs, branch ros2 (msg/CollisionObject.msg); shape_msgs and geometry_msgs of common_interfaces,
branch jazzy; object_recognition_msgs, branch ros2. QoS: rclcpp's ServicesQoS (reliable, volatile, depth 10), topic
collision_object (moveit2, planning_scene_monitor.cpp, branches humble and jazzy). Prints a JSON object per message,
and ends with 1 if one is not as MoveIt requires.
"""
import json
import pathlib
import select
import sys
import time
from collections import Counter

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl.types import array, float32, float64, sequence, uint8, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ur_messages import Header, Point, Pose, Strings, message

ObjectType = message("object_recognition_msgs/msg/ObjectType", key=str, db=str)
Point32 = message("geometry_msgs/msg/Point32", x=float32, y=float32, z=float32)
Polygon = message("geometry_msgs/msg/Polygon", points=sequence[Point32])
SolidPrimitive = message("shape_msgs/msg/SolidPrimitive", type=uint8, dimensions=sequence[float64, 3], polygon=Polygon)
MeshTriangle = message("shape_msgs/msg/MeshTriangle", vertex_indices=array[uint32, 3])
Mesh = message("shape_msgs/msg/Mesh", triangles=sequence[MeshTriangle], vertices=sequence[Point])
Plane = message("shape_msgs/msg/Plane", coef=array[float64, 4])
CollisionObject = message(
    "moveit_msgs/msg/CollisionObject", header=Header, pose=Pose, id=str, type=ObjectType,
    primitives=sequence[SolidPrimitive], primitive_poses=sequence[Pose], meshes=sequence[Mesh],
    mesh_poses=sequence[Pose], planes=sequence[Plane], plane_poses=sequence[Pose], subframe_names=Strings,
    subframe_poses=sequence[Pose], operation=uint8)
SERVICES_QOS = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile,
                   Policy.History.KeepLast(10))
ADD = 0


def is_identity(pose):
    at, turn = pose.position, pose.orientation
    return [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w] == [0, 0, 0, 0, 0, 0, 1]


def problems(received):
    """Returns the reasons why MoveIt would not add the object, or not as a closed solid."""
    found = []
    if received.operation != ADD or not received.header.frame_id or not received.id:
        found.append(f"operation {received.operation}, frame {received.header.frame_id}, id {received.id}")
    if len(received.meshes) != 1 or received.primitives or received.planes:
        return [*found, "not one mesh"]
    if len(received.mesh_poses) != 1 or not all(map(is_identity, [received.pose, *received.mesh_poses])):
        found.append("a pose")
    mesh = received.meshes[0]
    edges = Counter()
    for triangle in mesh.triangles:
        a, b, c = triangle.vertex_indices
        if max(a, b, c) >= len(mesh.vertices) or len({a, b, c}) < 3:
            return [*found, f"triangle {a} {b} {c}"]
        edges.update([(a, b), (b, c), (c, a)])
    # Watertight: each edge is passed as often in one direction as in the other.
    if any(edges[b, a] != count for (a, b), count in edges.items()):
        found.append("an edge without its neighbour")
    if volume_m3(mesh) <= 0:
        found.append("inside out")
    return found


def volume_m3(mesh):
    total = 0.0
    for triangle in mesh.triangles:
        a, b, c = (mesh.vertices[i] for i in triangle.vertex_indices)
        total += (a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x)) / 6
    return total


def main(domain, folder):
    participant = DomainParticipant(domain)
    about = Topic(participant, "rt/collision_object", CollisionObject, qos=SERVICES_QOS)
    reader, count, is_sound = DataReader(participant, about, qos=SERVICES_QOS), 0, True
    is_open = True
    while is_open:
        is_open = not select.select([sys.stdin], [], [], 0)[0]
        for received in reader.take(N=100):
            # A writer that leaves sends a sample without data.
            if not received.sample_info.valid_data:
                continue
            wrong, mesh = problems(received), received.meshes[0]
            is_sound = is_sound and not wrong
            stored = {"id": received.id, "frame": received.header.frame_id,
                      "vertices": [[p.x, p.y, p.z] for p in mesh.vertices],
                      "triangles": [list(triangle.vertex_indices) for triangle in mesh.triangles]}
            (pathlib.Path(folder) / f"{count}.json").write_text(json.dumps(stored))
            count += 1
            print(json.dumps({"event": {"id": received.id, "frame": received.header.frame_id,
                                        "triangles": len(mesh.triangles), "volume_m3": volume_m3(mesh),
                                        "problems": wrong}, "time_unix_s": time.time()}), flush=True)
        time.sleep(0.005)
    return is_sound


if __name__ == "__main__":
    sys.exit(0 if main(int(sys.argv[1]), sys.argv[2]) else 1)
