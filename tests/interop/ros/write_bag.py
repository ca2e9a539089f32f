"""Writes a drive (plan.json and its images) as a bag of ROS 1 by rosbag.

usage: write_bag.py PLAN BAG [bz2|lz4]"""
import json
import pathlib
import sys

import rosbag
from geometry_msgs.msg import TransformStamped
from genpy import Time
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu
from tf2_msgs.msg import TFMessage


def time_of(ns):
    return Time(ns // 10**9, ns % 10**9)


def stamped(message, ns, frame):
    message.header.stamp = time_of(ns)
    message.header.frame_id = frame
    return message


def camera_info(camera, ns):
    info = stamped(CameraInfo(), ns, camera["frame"])
    info.width, info.height = camera["width"], camera["height"]
    info.distortion_model, info.D, info.K = camera["model"], camera["d"], camera["k"]
    return info


def image_of(entry, camera, data):
    if "format" in entry:
        return stamped(CompressedImage(format=entry["format"], data=data), entry["ns"], camera["frame"])
    message = stamped(Image(data=data, encoding=entry["encoding"]), entry["ns"], camera["frame"])
    message.width, message.height, message.step = camera["width"], camera["height"], entry["step"]
    return message


def transform_of(camera, imu_frame):
    one = stamped(TransformStamped(), 0, imu_frame)
    one.child_frame_id = camera["frame"]
    t, q = one.transform.translation, one.transform.rotation
    t.x, t.y, t.z = camera["p"]
    q.x, q.y, q.z, q.w = camera["q"]
    return one


def imu_of(values, frame):
    message = stamped(Imu(), values[0], frame)
    g, a = message.angular_velocity, message.linear_acceleration
    g.x, g.y, g.z, a.x, a.y, a.z = values[1:]
    return message


folder = pathlib.Path(sys.argv[1]).parent
plan = json.loads(pathlib.Path(sys.argv[1]).read_text())
cameras = {camera["name"]: camera for camera in plan["cameras"]}
messages = []
for ns, *values in plan["imu"]:
    messages.append((int(ns), plan["imu_topic"], imu_of([int(ns), *values], plan["imu_frame"])))
for entry in plan["images"]:
    camera, ns = cameras[entry["camera"]], int(entry["ns"])
    entry["ns"] = ns
    data = (folder / entry["file"]).read_bytes()
    messages.append((ns, entry["topic"], image_of(entry, camera, data)))
    messages.append((ns, camera["info_topic"], camera_info(camera, ns)))
messages.sort(key=lambda one: one[0])
start = messages[0][0]
with rosbag.Bag(sys.argv[2], "w", compression=sys.argv[3] if len(sys.argv) > 3 else "none",
                chunk_threshold=8 * 1024) as bag:
    if plan["transforms"]:
        static = TFMessage([transform_of(camera, plan["imu_frame"]) for camera in plan["cameras"]])
        bag.write("/tf_static", static, time_of(start))
    for ns, topic, message in messages:
        bag.write(topic, message, time_of(ns + 1000000))
