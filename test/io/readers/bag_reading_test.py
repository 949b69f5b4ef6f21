"""Bags that others wrote: all that write_bag.py writes hold the very scans of their folder, whole or damaged, and what
ROS 2's own recorder wrote (../shared/data/ros2_bags) is listed."""
import itertools
import json
import os
import pathlib
import shutil
import sqlite3
import struct
import subprocess
import unittest

import numpy as np
import octosurf
import scans_test
import world
import write_bag
import zstandard
from PIL import Image

FOLDER = world.FOLDER
POINT_FIELD = {"<i4": 5, "<u4": 6, "<f4": 7, "<f8": 8}
FOREIGN = world.SOURCE.parent / "shared/data/ros2_bags"


def setUpModule():
    """Three images of 6 × 4 pixels with readings and none, three clouds of 40 points, one at the origin, at 30 Hz."""
    half = 0.1 + 0.3 * np.arange(3)
    poses = np.stack(np.broadcast_arrays(np.arange(3) / 30, np.arange(3) / 10, -0.3, 1 / 3, 0, 0.6 * np.sin(half),
                                         0.8 * np.sin(half), np.cos(half)), axis=-1)
    for kind in ("images", "clouds"):
        (FOLDER / kind).mkdir()
        np.savetxt(FOLDER / kind / "poses.txt", poses, "%.17g")
        np.savetxt(FOLDER / kind / "times.txt", poses[:, 0], "%.17g")
    (FOLDER / "images/camera-intrinsics.txt").write_text("5.25 0 2.5\n0 5.3 1.5\n0 0 1\n")
    for i in range(3):
        pixels = (1000 + 37 * np.arange(24) + 501 * i).astype(np.uint16)
        pixels[[3, 20]] = 0, 65535
        Image.fromarray(pixels.reshape(4, 6)).save(FOLDER / f"images/frame-00000{i}.depth.png")
        n = np.arange(40, dtype=np.float32)
        points = np.stack([0.1 * n, 1 / (n + 1), np.full_like(n, i - 0.7)], axis=-1).astype("<f4")
        points[7] = 0
        (FOLDER / f"clouds/scan-{i}.pcd").write_bytes(scans_test.pcd(points))


def command(*words, code=0):
    done = subprocess.run([os.environ["OCTOSURF"], *map(str, words)], capture_output=True, text=True, cwd=FOLDER)
    assert done.returncode == code, (words, done)
    return done.stderr if code else done.stdout


def info(bag):
    return json.loads(command("info", "--json", bag))


class Bags(unittest.TestCase):
    number = itertools.count()

    def write(self, recording, name, options=""):
        """In a folder of its own."""
        bag = FOLDER / str(next(self.number)) / name
        bag.parent.mkdir()
        write_bag.write_bag(FOLDER / recording, bag, options.split())
        return bag

    def assert_same(self, scans, expected, pose_error=0):
        for scan, one in zip(scans, expected):
            np.testing.assert_array_equal(scan.points, one.points)
            np.testing.assert_allclose(scan.T_map_sensor, one.T_map_sensor, rtol=0, atol=pose_error)
            self.assertEqual(scan.sensor, one.sensor)
            self.assertAlmostEqual(scan.stamp_s - scans[0].stamp_s, one.stamp_s - expected[0].stamp_s, delta=1e-6)

    def refused(self, bag, *words):
        with self.assertRaises(octosurf.Error) as refused:
            list(octosurf.open_scans(bag))
        for word in words:
            self.assertIn(word, str(refused.exception))

    def test_scans_are_those_of_the_folder(self):
        for recording, bags in (
                ("images", ("a.bag", "a.bag packing=bz2 poses=odometry", "a.bag packing=lz4 poses=pose depth=mono16",
                            "a.bag depth=32FC1 chunk=100 poses=chain", "a.bag depth=big", "a.bag depth=png",
                            "a.db3", "a.db3 poses=odometry depth=32FC1", "a.db3 poses=pose depth=compressedDepth",
                            "a.db3 poses=chain depth=big", "a.mcap", "a.mcap chunk=0 poses=odometry",
                            "a.mcap packing=zstd poses=pose depth=big", "a.mcap packing=zstd depth=compressedDepth",
                            "a.mcap packing=lz4 chunk=100 poses=chain depth=mono16")),
                ("clouds", ("a.bag", "a.bag cloud=doubles packing=lz4", "a.bag cloud=padded", "a.bag cloud=organised",
                            "a.bag cloud=big", "a.db3", "a.db3 cloud=doubles", "a.db3 cloud=padded", "a.mcap cloud=big",
                            "a.mcap packing=zstd cloud=organised"))):
            expected = list(octosurf.open_scans(FOLDER / recording))
            for bag in bags:
                with self.subTest(recording=recording, bag=bag):
                    scans = list(octosurf.open_scans(self.write(recording, *bag.split(" ", 1))))
                    self.assertEqual(len(scans), 3)
                    # Where tf is a product of two turns, its rounding is not the folder's.
                    self.assert_same(scans, expected, 1e-15 if "chain" in bag else 0)

    def test_a_folder_with_metadata_is_one_recording_of_its_files(self):
        first = self.write("clouds", "walk_0.mcap")
        shutil.copy(self.write("clouds", "walk_1.mcap", "packing=lz4"), first.parent)
        (first.parent / "metadata.yaml").write_text("rosbag2_bagfile_information:\n")
        (first.parent / "._walk_0.mcap").write_text("of macOS")
        source = octosurf.open_scans(first.parent)
        self.assertEqual((len(source), len(list(source))), (6, 6))
        scans, poses = source.notes()
        self.assertIn("scans: 6 messages of /lidar/points", scans)
        self.assertIn("poses: tf of lidar in map", poses)

    def test_poses_and_intrinsics_of_a_file_win(self):
        (FOLDER / "line.txt").write_text("".join(f"0 0 {z} 0 0 0 1\n" for z in (1, 2, 3)))
        (FOLDER / "k.txt").write_text("10 10 0 0\n")
        of_files = {"poses": FOLDER / "line.txt", "intrinsics": FOLDER / "k.txt"}
        scans = list(octosurf.open_scans(self.write("images", "a.bag"), **of_files))
        self.assertEqual(scans[0].points[0].tolist(), [0, 0, 1])
        self.assertEqual([scan.T_map_sensor[2, 3] for scan in scans], [1, 2, 3])

    def test_with_skip_bad_what_is_whole_of_a_damaged_bag_is_there(self):
        for name in ("a.mcap", "a.db3", "a.bag"):
            bag = self.write("images", name, "chunk=300")
            whole = list(octosurf.open_scans(bag))
            os.truncate(bag, bag.stat().st_size // 2)
            try:
                source = octosurf.open_scans(bag, skip_bad=True)
            except octosurf.Error as refused:  # what is whole holds no scan
                self.assertIn(name, str(refused))
                continue
            scans = list(source)
            self.assertTrue(source.skipped())
            self.assertLessEqual(len(scans), len(whole))
            self.assert_same(scans, whole)

    def test_a_bag_without_index_is_read(self):
        """The head of a ROS 1 bag says where its index is, once there is one; until then, zero."""
        bag = self.write("images", "a.bag", "chunk=300")
        whole, content = list(octosurf.open_scans(bag)), bytearray(bag.read_bytes())
        place = content.index(b"index_pos=") + len(b"index_pos=")
        index, = struct.unpack_from("<Q", content, place)
        struct.pack_into("<Q", content, place, 0)
        active = bag.with_suffix(".bag.active")
        active.write_bytes(content[:index])
        scans = list(octosurf.open_scans(active))
        self.assertEqual(len(scans), 3)
        self.assert_same(scans, whole)

    def test_a_base_is_read_with_the_log_beside_it(self):
        """SQLite writes the log into the base when the last one closes it; a recorder that was killed did not."""
        whole = self.write("images", "whole.db3")
        killed = whole.with_name("killed.db3")
        if (child := os.fork()) == 0:
            base = sqlite3.connect(killed, isolation_level=None)
            base.execute("PRAGMA journal_mode=WAL")
            base.execute("PRAGMA wal_autocheckpoint=0")
            for line in sqlite3.connect(whole).iterdump():
                if line not in ("COMMIT;", "BEGIN TRANSACTION;"):
                    base.execute(line)
            os._exit(0)
        os.waitpid(child, 0)
        pathlib.Path(f"{killed}-shm").unlink()
        base = sqlite3.connect(whole)
        base.execute("PRAGMA journal_mode=WAL")
        base.close()
        sizes = lambda: {file.name: file.stat().st_size for file in whole.parent.iterdir()}
        before = sizes()
        self.assertIn("killed.db3-wal", before)
        scans = list(octosurf.open_scans(killed))
        self.assertEqual(len(scans), 3)
        self.assert_same(scans, list(octosurf.open_scans(whole)))
        self.assertEqual(sizes(), before, "nothing is written")

    def test_forged_chunks_and_foreign_files_are_refused(self):
        zeros = zstandard.compress(bytes(100 << 20), 1)
        record = lambda op, body: struct.pack("<BQ", op, len(body)) + body
        chunk = lambda size, how, packed: b"\x89MCAP0\r\n" + record(
            6, struct.pack("<QQQII", 0, 0, size, 0, len(how)) + how + struct.pack("<Q", len(packed)) + packed)
        for name, content, *words in (
                ("a.mcap", chunk(100 << 20, b"zstd", zeros), "far more than the file's size"),
                ("a.mcap", chunk(1 << 60, b"zstd", zeros), "far more than the file's size"),
                ("a.mcap", chunk(1000, b"zstd", zeros), "zstd says"),
                ("a.mcap", chunk(3, b"rar", b"abc"), "compressed as 'rar', which is not read"),
                ("a.mcap", b"", "is empty"), ("a.bag", b"something else", "no bag"),
                ("a.bag", b"#ROSBAG V1.2\n", "version before 2.0", "rosbag migrate"),
                ("a.db3", b"SQLite format 3\0" + 4096 * b"x", "SQLite says")):
            (FOLDER / name).write_bytes(content)
            self.refused(FOLDER / name, *words)
        walk = FOLDER / "walk"
        walk.mkdir()
        for name in ("metadata.yaml", "walk_0.db3.zstd"):
            (walk / name).touch()
        for name in ("", "walk_0.db3.zstd"):
            self.refused(walk / name, "compressed as a file", "zstd -d")
        (walk / "walk_0.db3.zstd").unlink()
        self.refused(walk, "holds no scans")

    def timed_bag(self, field, track):
        """Of scans_test's wall."""
        ns, make = lambda stamp_s: round(1e9 * stamp_s), lambda kind, /, *of, **fields: write_bag.message(
            write_bag.ROS2, f"sensor_msgs/msg/{kind}", *of, **fields)
        messages = [("/tf", ns(t), write_bag.transforms(write_bag.ROS2, ns(t), "map", ["lidar"], [x, 0, 0, 0, 0, 0, 1]))
                    for t, x in track]
        layout = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), (field[0], 12, POINT_FIELD[field[1]])]
        fields = [make("PointField", name=name, offset=offset, datatype=kind, count=1) for name, offset, kind in layout]
        for scan in range(scans_test.SCANS):
            rows = np.zeros(scans_test.POINTS, [("p", "<f4", 3), ("t", field[1])])
            rows["p"], rows["t"] = scans_test.wall(scan), scans_test.times(field, scan)
            stamp = ns(scans_test.stamp_of(scan))
            messages.append(("/points", stamp, make(
                "PointCloud2", stamp, "lidar", height=1, width=len(rows), fields=fields, point_step=rows.itemsize,
                row_step=rows.nbytes, data=np.frombuffer(rows.tobytes(), np.uint8))))
        bag = FOLDER / f"{next(self.number)}.mcap"
        write_bag.write_mcap(bag, messages, {"chunk": "0", "packing": "none"})
        return bag

    def test_motion_within_scans_is_undone_by_the_times_of_points(self):
        for field in scans_test.TIME_FIELDS:
            with self.subTest(field=field):
                source = octosurf.open_scans(self.timed_bag(field, scans_test.track()))
                unit = {1: "s", 1e-6: "µs", 1e-9: "ns"}[field[2]]
                clock = "on the stamps' clock" if field[3] else "after"
                self.assertRegex("\n".join(source.notes()), rf"field {field[0]} \({unit} {clock}.*undone.*up to 20 cm")
                scans_test.assert_undone(self, list(source))

    def test_with_too_few_poses_motion_is_left_and_told(self):
        stamp = scans_test.stamp_of(1)
        bag = self.timed_bag(scans_test.TIME_FIELDS[0], [(stamp, scans_test.place_at(stamp))])
        source = octosurf.open_scans(bag, skip_bad=True)
        self.assertRegex("\n".join(source.notes()), "not undone in 1 of 1.*as often as scans")
        scan, = source
        np.testing.assert_array_equal(scan.points, scans_test.wall(1))
        np.testing.assert_allclose(scan.times_s, scans_test.AFTER_S, atol=1e-6)

    def test_info_tells_topics_counts_and_times(self):
        for name in ("walk.bag", "walk.db3", "walk.mcap"):
            bag = self.write("clouds", name)
            self.assertRegex(command("info", bag), r"/lidar/points  sensor_msgs/PointCloud2 +3  1700000000  1700000000.0667")
            told = info(bag.parent)  # a folder of bags
            self.assertEqual((told["messages"], told["first_s"]), (6, 1.7e9))
            self.assertAlmostEqual(told["duration_s"], 2 / 30, delta=1e-6)
            topic = told["topics"][0]
            self.assertEqual([topic[key] for key in ("name", "type", "messages")],
                             ["/lidar/points", "sensor_msgs/PointCloud2", 3])
            self.assertAlmostEqual(topic["last_s"] - topic["first_s"], 2 / 30, delta=1e-6)
        self.assertIn("a bag", command("info", bag, "--up", "z", code=2))
        refused = command("map", bag, "-o", "n", "--topic", "/camera", code=1)
        self.assertIn("no topic /camera", refused)
        self.assertIn("/lidar/points (sensor_msgs/PointCloud2)", refused)

    def test_the_documented_commands_run(self):
        """Those of docs/usage.md, as they stand there."""
        for recording, name, poses in (("clouds", "walk.bag", "chain"), ("clouds", "walk.mcap", "chain"),
                                       ("images", "kitchen.db3", "odometry")):
            write_bag.write_bag(FOLDER / recording, FOLDER / name, [f"poses={poses}"])
        (FOLDER / "maps").mkdir()
        usage = (world.SOURCE / "docs/usage.md").read_text().split("\n## Bags\n")[1]
        lines = usage.split("```sh\n")[1].split("```")[0].splitlines()
        self.assertGreaterEqual(len(lines), 4)
        for line in lines:
            said = command(*line.split("#")[0].split()[1:])
            if line == lines[1]:
                self.assertIn("walk.mcap: scans: 3 messages of /lidar/points (sensor_msgs/PointCloud2)\n", said)
                self.assertIn("walk.mcap: poses: tf of lidar in map", said)

    @unittest.skipUnless(FOREIGN.is_dir(), f"{FOREIGN} is missing")
    def test_both_containers_of_ros_2s_recorder_hold_the_same(self):
        told = lambda name: {one["name"]: (one["type"], one["messages"]) for one in info(FOREIGN / name)["topics"]}
        for name in ("talker", "wbag_0", "cdr_test_0"):
            mcap = told(f"{name}.mcap")
            self.assertEqual(mcap, told(f"{name}.db3"))
        self.assertEqual(info(FOREIGN / "only_topics.mcap")["messages"], 7)
        self.assertEqual(info(FOREIGN / "wbag_0.mcap")["messages"], 1246)
        talker = told("talker.mcap")
        self.assertEqual(set(talker), {"/parameter_events", "/rosout", "/topic"})
        self.assertEqual(talker["/parameter_events"][1], 0)
