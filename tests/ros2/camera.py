"""Depth camera on Eclipse Cyclone DDS that sees the plane z = 0.5 m: camera.py DOMAIN SECONDS best_effort|reliable"""
import struct
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from messages import Header, Time


@dataclass
class PointField(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


WIDTH, HEIGHT, FOCAL, DEPTH_MM = 320, 240, 300.0, 500

domain, span, confirmation = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
reliability = {"best_effort": Policy.Reliability.BestEffort,
               "reliable": Policy.Reliability.Reliable(duration(seconds=1))}[confirmation]
qos = Qos(reliability, Policy.Durability.Volatile, Policy.History.KeepLast(5))
participant = DomainParticipant(domain)
writer = lambda name, kind: DataWriter(participant, Topic(participant, "rt" + name, kind, qos=qos), qos=qos)
clouds, images = writer("/camera/points", PointCloud2), writer("/camera/depth/image_rect_raw", Image)
infos = writer("/camera/depth/camera_info", CameraInfo)

header = Header(Time(1, 0), "camera_depth_optical_frame")
centre = [(WIDTH - 1) / 2, (HEIGHT - 1) / 2]
rays = [((u - centre[0]) / FOCAL, (v - centre[1]) / FOCAL) for v in range(HEIGHT) for u in range(WIDTH)]
depth = DEPTH_MM / 1000
# Each point is padded to 16 bytes, as drivers do; the first has no depth.
points = b"".join(struct.pack("<4f", depth * x, depth * y, depth, 0.0) for x, y in rays[1:])
points = struct.pack("<4f", *[float("nan")] * 3, 0.0) + points
fields = [PointField(name, 4 * i, 7, 1) for i, name in enumerate("xyz")]
cloud = PointCloud2(header, HEIGHT, WIDTH, fields, False, 16, 16 * WIDTH, list(points), False)
depths = list(struct.pack("<H", 0) + struct.pack("<H", DEPTH_MM) * (len(rays) - 1))
image = Image(header, HEIGHT, WIDTH, "16UC1", 0, 2 * WIDTH, depths)
k = [FOCAL, 0.0, centre[0], 0.0, FOCAL, centre[1], 0.0, 0.0, 1.0]
info = CameraInfo(header, HEIGHT, WIDTH, "plumb_bob", [0.0] * 5, k, [1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0],
                  k[:3] + [0.0] + k[3:6] + [0.0] + k[6:] + [0.0], 0, 0, RegionOfInterest(0, 0, 0, 0, False))
print("ready", flush=True)
begun = time.time()
while time.time() - begun < span:
    clouds.write(cloud)
    images.write(image)
    infos.write(info)
    time.sleep(0.1)
