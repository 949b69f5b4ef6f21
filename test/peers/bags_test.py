"""Bags as rosbags writes and reads them; test/io and test/apps map those of write_bag.py, which rosbags and mcap write."""
import functools
import pathlib
import subprocess
import unittest

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.typesys import get_types_from_msg

import world
import write_bag
from write_bag import ROS1, ROS2, message

LIVOX_POINT = "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line"
LIVOX = ("std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
         "livox_ros_driver2/CustomPoint[] points")


def setUpModule():
    world.command("simulate", "room", "--sensor", "spinning", "--frames", 3, "-o", world.FOLDER / "clouds")
    for store in (ROS1, ROS2):
        store.register(get_types_from_msg(LIVOX_POINT, "livox_ros_driver2/msg/CustomPoint"))
        store.register(get_types_from_msg(LIVOX, "livox_ros_driver2/msg/CustomMsg"))


def livox(store, stamp, points):
    points = [message(store, "livox_ros_driver2/msg/CustomPoint", x=x, y=y, z=z) for x, y, z in points.tolist()]
    return message(store, "livox_ros_driver2/msg/CustomMsg", stamp, "lidar", point_num=len(points), points=points,
                   rsvd=np.zeros(3, np.uint8))


class Bags(unittest.TestCase):
    def mapped(self, scans, *options):
        """The whole map file: scans, poses and stamps decide every byte."""
        world.command("map", scans, *options, "-o", world.FOLDER / "map", "--force", "--resolution", 0.1)
        return (world.FOLDER / "map.surfaces").read_bytes()

    def write(self, mode, plugin, all_messages=None, **options):
        name = f"{plugin.name}_{mode.name}_{len(list(world.FOLDER.iterdir()))}"
        recording = write_bag.Recording(world.FOLDER / "clouds")
        all_messages = all_messages or write_bag.messages(ROS2, recording, {"poses": "tf", "cloud": "plain"})
        writer = rosbag2.Writer(world.FOLDER / name, version=9, storage_plugin=plugin)
        writer.set_compression(mode, CompressionFormat.ZSTD)
        write_bag.write_to(writer, ROS2, functools.partial(ROS2.serialize_cdr, **options), all_messages)
        return world.FOLDER / name

    def test_folders_of_every_compression_and_byte_order_give_the_map_of_the_plain_files(self):
        wanted = self.mapped(world.FOLDER / "clouds")
        for plugin, mode in [(StoragePlugin.SQLITE3, CompressionMode.NONE), (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
                             (StoragePlugin.MCAP, CompressionMode.MESSAGE), (StoragePlugin.MCAP, CompressionMode.STORAGE)]:
            with self.subTest(plugin=plugin, mode=mode):
                self.assertEqual(self.mapped(self.write(mode, plugin)), wanted)
        self.assertEqual(self.mapped(self.write(CompressionMode.NONE, StoragePlugin.MCAP, little_endian=False)), wanted)

    def test_livox_and_poses_of_every_message_give_the_same_map(self):
        """Of both generations of ROS."""
        wanted = self.mapped(world.FOLDER / "clouds")
        recording = write_bag.Recording(world.FOLDER / "clouds")
        for store in (ROS1, ROS2):
            clouds = [("/livox", stamp, livox(store, stamp, write_bag.read_pcd(file)))
                      for stamp, file in zip(recording.stamps, recording.clouds)]
            for kind in ("Pose", "PoseWithCovariance", "Transform"):
                poses = [("/pose", stamp, self.stamped(store, kind, stamp, pose))
                         for stamp, pose in zip(recording.stamps, recording.poses)]
                together = sorted(poses + clouds, key=lambda one: one[1])
                if store is ROS1:
                    bag = world.FOLDER / f"{kind}.bag"
                    write_bag.write_to(rosbag1.Writer(bag), ROS1, ROS1.serialize_ros1, together)
                else:
                    bag = self.write(CompressionMode.NONE, StoragePlugin.MCAP, together)
                with self.subTest(bag=bag):
                    self.assertEqual(self.mapped(bag, "--pose-topic", "/pose"), wanted)

    def stamped(self, store, kind, stamp, pose):
        name = f"geometry_msgs/msg/{kind}"
        value = write_bag.placed(store, name.removesuffix("WithCovariance"), pose)
        if kind == "PoseWithCovariance":
            value = message(store, name, pose=value)
        return message(store, name + "Stamped", stamp, "map", child_frame_id="lidar", pose=value, transform=value)

    def test_the_examples_bag_is_read(self):
        bag = world.FOLDER / "example.bag"
        world.command("simulate", "room", "--frames", 2, "-o", world.FOLDER / "depth")
        written = subprocess.run(["/usr/bin/python3", world.SOURCE / "examples/write_bag.py", world.FOLDER / "depth", bag],
                                 env={}, stderr=subprocess.PIPE, text=True)
        if "No module named" in written.stderr:
            self.skipTest(written.stderr.splitlines()[-1])
        with AnyReader([pathlib.Path(bag)]) as reader:
            read = [(connection.topic, reader.deserialize(data, connection.msgtype))
                    for connection, _, data in reader.messages()]
        self.assertEqual([topic.split("/")[-1] for topic, _ in read],
                         ["tf_static"] + 2 * ["tf", "camera_info", "compressed"])
        self.assertEqual(bytes(read[3][1].data), (world.FOLDER / "depth/frame-000000.depth.png").read_bytes())
