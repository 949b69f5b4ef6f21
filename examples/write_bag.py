#!/usr/bin/env python3
"""Writes a folder of depth images with poses (as `octosurf-lab simulate` makes them) as a ROS 1 bag, as a robot would have
recorded it: CompressedImage and CameraInfo of the camera, tf from the map to the robot's base, tf_static from there to
the camera.

  write_bag.py FOLDER walk.bag        needs Debian's python3-rosbag, python3-sensor-msgs and python3-tf2-msgs
"""
import pathlib
import sys

import numpy as np
import rosbag
from genpy import Time
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, CompressedImage
from tf2_msgs.msg import TFMessage

START_S = 1_700_000_000  # what the robot's clock said
# The camera looks out of the robot's base: x forward, y left, z up there; x right, y down, z forward here.
T_BASE_CAMERA = np.array([[0, 0, 1, 0.25], [-1, 0, 0, 0], [0, -1, 0, 0.4], [0, 0, 0, 1.0]])


def quaternion(R):
    """x, y, z, w: the eigenvector of the largest eigenvalue of Bar-Itzhack's matrix (2000)."""
    K = np.array([[R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
                  [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
                  [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
                  [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]]]) / 3
    return np.linalg.eigh(K)[1][:, -1]  # eigh reads the lower triangle


def transform(stamp, parent, child, T):
    message = TransformStamped()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, parent, child
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = T[:3, 3]
    rotation.x, rotation.y, rotation.z, rotation.w = quaternion(T[:3, :3])
    return TFMessage([message])


def camera_info(stamp, K):
    message = CameraInfo(height=480, width=640, distortion_model="plumb_bob", D=[0.0] * 5)
    message.header.stamp, message.header.frame_id = stamp, "camera"
    message.K, message.R = list(K.flat), list(np.eye(3).flat)
    message.P = list(np.hstack([K, np.zeros((3, 1))]).flat)
    return message


def image(stamp, file):
    message = CompressedImage(format="16UC1; png compressed", data=file.read_bytes())
    message.header.stamp, message.header.frame_id = stamp, "camera"
    return message


def main():
    folder, bag_file = pathlib.Path(sys.argv[1]), sys.argv[2]
    K = np.loadtxt(folder / "camera-intrinsics.txt")
    frames = [line.split() for line in (folder / "timestamps.txt").read_text().splitlines()]
    with rosbag.Bag(bag_file, "w") as bag:
        start = Time.from_sec(START_S)
        bag.write("/tf_static", transform(start, "base", "camera", T_BASE_CAMERA), start)
        for name, stamp_s in frames:
            stamp = Time.from_sec(START_S + float(stamp_s))
            T_map_camera = np.loadtxt(folder / (name + ".pose.txt"))
            bag.write("/tf", transform(stamp, "map", "base", T_map_camera @ np.linalg.inv(T_BASE_CAMERA)), stamp)
            bag.write("/camera/depth/camera_info", camera_info(stamp, K), stamp)
            bag.write("/camera/depth/image_rect/compressed", image(stamp, folder / (name + ".depth.png")), stamp)


main()
