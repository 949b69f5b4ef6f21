"""Folders and files of scans as others lay them out: what is read as what, and what is refused in which words."""
import math
import os
import pathlib
import shutil
import struct
import tempfile
import unittest
import zlib

import numpy as np
import octosurf

SOURCE = pathlib.Path(os.environ["OCTOSURF_SOURCE"])
DATA = SOURCE.parent / "shared/data"
IDENTITY, UNIT_CAMERA = "0 0 0 0 0 0 1\n", "1 1 0 0\n"


def png(rows, bits=16, colour=0):
    """Gray, or colour=2: red, green and blue in turn."""
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = np.asarray(rows, ">u2" if bits == 16 else np.uint8)
    head = struct.pack(">IIBBBBB", rows.shape[1] // (3 if colour else 1), len(rows), bits, colour, 0, 0, 0)
    packed = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


def pcd(points, viewpoint="0 0 0 1 0 0 0", width=None, time=None):
    """Binary; a time: name, type of NumPy, values."""
    points = np.asarray(points, "<f4").reshape(-1, 3)
    name, kind, values = time or ("_", "u1", 0)
    table = np.zeros(len(points), [("p", "<f4", 3), ("t", kind)])
    table["p"], table["t"], kind, width = points, values, np.dtype(kind), width or len(points)
    head = (f"VERSION 0.7\nFIELDS x y z {name}\nSIZE 4 4 4 {kind.itemsize}\nTYPE F F F {kind.kind.upper()}\n"
            f"COUNT 1 1 1 1\nWIDTH {width}\nHEIGHT {len(points) // width}\nVIEWPOINT {viewpoint}\n"
            f"POINTS {len(points)}\nDATA binary\n")
    return head.encode() + table.tobytes()


THREE = [[1, 2, 3], [4, 5, 6], [math.nan] * 3]


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name, "scans")

    def write(self, name, content):
        file = self.folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content.encode() if isinstance(content, str) else content)
        return file

    def read(self, *names, **options):
        return list(octosurf.open_scans([self.folder / name for name in names or [""]], **options))

    def refused(self, words, *names, kind="data", **options):
        with self.assertRaises(octosurf.Error) as refused:
            self.read(*names, **options)
        self.assertEqual(refused.exception.kind, kind)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, str(refused.exception))

    def assert_points(self, scan, points):
        np.testing.assert_allclose(scan.points, np.asarray(points, np.float32), rtol=0, atol=1e-6)


def names(scans):
    return [pathlib.Path(scan.name).name for scan in scans]


def places(scans):
    return [scan.T_map_sensor[0, 3] for scan in scans]


def stamps(scans):
    return [scan.stamp_s for scan in scans]


def matrix(x):
    return f"1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"


def lines(*xs):
    """Poses along x."""
    return "".join(f"{x} 0 0 0 0 0 1\n" for x in xs)


class Folders(Folder):
    def test_seven_scenes(self):
        for place in ("", "frames/"):
            shutil.rmtree(self.folder, ignore_errors=True)
            self.write("camera-intrinsics.txt", "2 0 0\n0 2 0\n0 0 1\n")
            self.write("gravity-direction.txt", "0 0 1\n")
            for i in range(2):
                self.write(f"{place}frame-00000{i}.depth.png", png([[1000, 65535]]))
                self.write(f"{place}frame-00000{i}.color.png", png([[1, 2, 3]], 8, 2))
                self.write(f"{place}frame-00000{i}.pose.txt", matrix(i))
            source = octosurf.open_scans(self.folder)
            self.assertEqual(len(source), 2)
            scans = list(source)
            self.assertEqual(names(scans), ["frame-000000.depth.png", "frame-000001.depth.png"])
            self.assert_points(scans[1], [[0, 0, 1]])
            self.assertEqual(places(scans), [0, 1])
            self.assertEqual((scans[1].sensor, source.skipped()), ("depth_camera", []))
            self.assertAlmostEqual(scans[1].stamp_s, 1 / 30)

    def test_tum(self):
        self.write("depth.txt", "# timestamp filename\n9.0 depth/9.0.png\n10.0 depth/10.0.png\n10.05 depth/10.05.png\n")
        self.write("groundtruth.txt", "# tx ty tz q\n10.0 1 0 0 0 0 0 1\n10.1 2 0 0 0 0 0 1\n")
        for name in ("9.0", "10.0", "10.05"):
            self.write(f"depth/{name}.png", png([[5000]]))
        source = octosurf.open_scans(self.folder)
        self.assertEqual(len(source), 2)
        self.assertIn("9.0.png: no pose at its time", source.skipped()[0])
        scans = list(source)
        self.assertEqual(stamps(scans), [10, 10.05])
        self.assertAlmostEqual(places(scans)[1], 1.5, delta=1e-6)
        self.assert_points(scans[0], [[-319.5 / 525, -239.5 / 525, 1]])  # 5000 units per metre, 525 525 319.5 239.5
        # The folder of the images alone is known for what it is, and an intrinsics file wins.
        self.write("camera-intrinsics.txt", UNIT_CAMERA)
        depth_only = self.read("depth")
        self.assertEqual(len(depth_only), 2)
        self.assert_points(depth_only[0], [[0, 0, 1]])
        self.write("groundtruth.txt", "900.0 1 0 0 0 0 0 1\n")
        self.refused("no scan has a pose at its time")
        (self.folder / "groundtruth.txt").unlink()
        self.refused("without poses")

    def test_intrinsics_may_lie_above(self):
        self.write("camera-intrinsics.txt", UNIT_CAMERA)
        self.write("seq/frame-0.depth.png", png([[1000]]))
        self.write("seq/frame-0.pose.txt", IDENTITY)
        for name in ("seq", "seq/", "seq/frame-0.depth.png"):
            self.assertEqual(len(self.read(name)), 1, name)

    def test_a_pose_of_the_very_time_is_taken_to_the_bit(self):
        """slerp() at its end gives the end but for rounding."""
        random = np.random.default_rng(int(os.environ.get("OCTOSURF_TEST_SEED", "1")))
        poses = np.hstack([random.uniform(-1, 1, (20, 6)), np.full((20, 1), 2)])
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
        rows = [" ".join(map(repr, pose.tolist())) + "\n" for pose in poses]
        self.write("depth.txt", "".join(f"{10 + i}.03 depth/{10 + i}.03.png\n" for i in range(20)))
        self.write("groundtruth.txt", "".join(f"{10 + i}.03 {row}" for i, row in enumerate(rows)))
        for i in range(20):
            self.write(f"depth/{10 + i}.03.png", png([[5000]]))
        in_order = self.read(poses=self.write("elsewhere/poses", "".join(rows)))
        for by_time, one in zip(self.read(), in_order, strict=True):
            np.testing.assert_array_equal(by_time.T_map_sensor, one.T_map_sensor)

    def two_images(self):
        self.write("1.png", png([[1000, 2000]]))
        self.write("2.png", png([[3000, 4000]]))

    def test_any_depth_images_with_poses_intrinsics_and_scale(self):
        self.two_images()
        camera = self.write("elsewhere/k", UNIT_CAMERA)
        scans = self.read(poses=self.write("elsewhere/p", lines(0, 7)), intrinsics=camera, depth_scale=500)
        self.assert_points(scans[0], [[0, 0, 2], [4, 0, 4]])
        self.assertEqual((places(scans), stamps(scans)), ([0, 7], [0, 1 / 30]))
        self.write("pose.txt", lines(3, 4))  # the same found beside the images
        self.write("intrinsics.txt", UNIT_CAMERA)
        self.assertEqual(places(self.read()), [3, 4])
        self.write("poses.txt", lines(3, 4))
        self.refused("holds both pose.txt and poses.txt; choose one with poses")

    def test_a_folder_of_poses_has_a_file_for_each_scan_called_like_it(self):
        for i in (0, 2, 10):
            self.write(f"depth/{i}.png", png([[1000, 2000]]))
            self.write(f"pose/{i}.txt", matrix(i))
        self.write("intrinsics.txt", UNIT_CAMERA)
        for name in ("", "depth"):
            self.assertEqual(places(self.read(name)), [0, 2, 10])
        elsewhere = (self.folder / "pose").rename(self.folder / "elsewhere")
        self.refused("without poses")
        self.assertEqual(places(self.read(poses=elsewhere)), [0, 2, 10])
        (elsewhere / "10.txt").rename(elsewhere / "3.txt")
        self.refused(("poses from 0.txt to 3.txt, but scans from 0.png to 10.png", "10.png has none"), poses=elsewhere)
        self.refused("has no 0.txt", poses=self.folder / "depth")

    def test_clouds_take_viewpoint_or_poses(self):
        self.write("scans/1.pcd", pcd(THREE, "1 2 3 1 0 0 0"))
        self.write("scans/2.pcd", pcd(THREE, "4 5 6 1 0 0 0"))
        self.write("scans/._1.pcd", "of macOS")
        scans = self.read()
        self.assertEqual(scans[1].T_map_sensor[:3, 3].tolist(), [4, 5, 6])
        self.assertEqual((scans[1].sensor, stamps(scans)), ("lidar", [0, 0.1]))
        self.assertFalse(np.isfinite(scans[0].points[2]).any())
        stamped = "".join(f"1,0,0,7\n0,1,0,8\n0,0,1,9\n0,0,0,{stamp}\n" for stamp in (100.5, 101.5))
        scans = self.read(poses=self.write("p.csv", stamped))
        self.assertEqual(scans[0].T_map_sensor[:3, 3].tolist(), [7, 8, 9])
        self.assertEqual(stamps(scans), [100.5, 101.5])

    def test_kitti(self):
        """The scanner is 1 m ahead of the camera, axes as usual: velodyne x = camera z, y = −x, z = −y."""
        self.write("calib.txt", "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 1\n")
        self.write("times.txt", "0.0\n0.5\n")
        self.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 10\n")
        for i in range(2):
            self.write(f"velodyne/00000{i}.bin", np.array([5, 2, 3, 0], "<f4").tobytes())
        for name, options in (("", {}), ("velodyne", {}), ("", {"pose_form": "of-camera"})):
            scans = self.read(name, **options)
            self.assertEqual(stamps(scans), [0, 0.5])
            T = scans[1].T_map_sensor
            np.testing.assert_allclose(T[:3, :3] @ scans[1].points[0] + T[:3, 3], [-2, -3, 16], atol=1e-9)
        notes = lambda: "\n".join(octosurf.open_scans(self.folder).notes())
        self.assertRegex(notes(), "as KITTI has them.*as-given")
        own = self.read(pose_form="as-given")  # the scanner's
        np.testing.assert_array_equal(own[1].T_map_sensor[:3, :3], np.eye(3))
        (self.folder / "calib.txt").unlink()
        self.assertIn("--pose-form of-camera", notes())
        (self.folder / "poses.txt").unlink()
        self.refused("2 scans without poses; give poses")
        self.write("times.txt", "0.0\nnan\n")
        self.refused("times.txt:2: the time stamp is not finite")
        self.write("times.txt", "0.0\n")
        self.refused("1 time stamp for 2 scans")

    def test_inputs_follow_one_another(self):
        for i in (0, 1):
            self.write(f"a/{i + 1}.pcd", pcd(THREE))
            self.write(f"b/{i}.bin", np.array([1, 2, 3, 0], "<f4").tobytes())
            self.write(f"c/{i}.png", png([[1000] * (i + 1)]))
        self.write("b/times.txt", "0.05\n0.35\n")
        self.write("b/poses.txt", lines(0, 0))
        scans = self.read("a/2.pcd", "a/1.pcd", "b", "a")
        self.assertEqual(names(scans), ["2.pcd", "1.pcd", "0.bin", "1.bin", "1.pcd", "2.pcd"])
        # Time does not go back where the next input's stamps begin before.
        np.testing.assert_allclose(stamps(scans), [0, 0.1, 0.2, 0.5, 0.6, 0.7], rtol=1e-15)
        self.assertEqual(places(self.read("a", "b", poses=self.write("p", lines(1, 2, 3, 4)))), [1, 2, 3, 4])
        self.write("c/intrinsics.txt", UNIT_CAMERA)
        self.write("c/poses.txt", lines(0, 0))
        self.refused("2x1 pixels, but the images before have 1x1", "c")

    def test_other_files_and_empty_and_unclear_folders_are_refused(self):
        self.refused("missing: no such file or folder", "missing")
        self.write("notes.txt", "hello")
        self.refused("notes.txt: not a kind of file that is read", "notes.txt")
        self.refused("holds no scans")
        self.refused("a saved map", self.write("office.surfaces", "x"))
        self.refused("a saved map", "office")
        (self.folder / "office.surfaces").unlink()
        self.write("b/scans/1.pcd", pcd(THREE))
        self.write("a/1.pcd", pcd(THREE))
        self.refused("holds no scans but 2 folders: a, b; name one of them")
        self.write("1.png", png([[7, 7]], 8))
        self.refused(("1.png", "not a 16-bit depth image"))
        self.write("1.pcd", pcd(THREE))
        self.assertEqual(len(self.read()), 1)  # the picture is no scan
        self.write("2.png", png([[1]]))
        self.refused("holds depth images and clouds")

    def test_what_is_missing_or_does_not_fit_is_named(self):
        self.two_images()
        self.refused("without camera intrinsics; give intrinsics")
        self.write("intrinsics.txt", UNIT_CAMERA)
        self.refused("2 scans without poses; give poses")
        transforms = self.write("transforms.json", "{}")
        self.refused("2 scans without poses (transforms.json is not read: write tx")
        self.refused(("JSON", "tx ty tz qx qy qz qw"), poses=transforms)
        self.assertEqual(len(self.read("1.png")), 1)  # a single image is in the map frame
        self.write("poses.txt", IDENTITY)
        self.refused("poses.txt: 1 pose for 2 scans")
        self.refused("3 poses for 2 scans", poses=self.write("elsewhere/p", lines(0, 0, 0)))
        self.refused("nowhere: cannot be read", poses=self.folder / "nowhere")
        self.refused("3 numbers are no camera intrinsics", intrinsics=self.write("elsewhere/k", "1 2 3"))
        for scale in (0, -1, math.nan):
            self.refused("", "1.png", kind="usage", depth_scale=scale)
        self.refused("", "1.png", kind="usage", sensor="lidar")
        with self.assertRaises(octosurf.Error):
            octosurf.open_scans([])


class BadScans(Folder):
    def setUp(self):
        super().setUp()
        self.write("intrinsics.txt", UNIT_CAMERA)
        self.write("poses.txt", lines(0, 1) + "2 0 0 0 0 0 3\n" + lines(3, 4, 5))
        for i, content in enumerate((png([[1000]]), "", png([[1000]]), png([[1000, 1000]]), png([[1000]]))):
            self.write(f"{i + 1}.png", content)
        (self.folder / "6.png").symlink_to("nowhere.png")

    def test_stop_the_run_with_their_names(self):
        source = octosurf.open_scans(self.folder)
        next(source)
        for words in (("2.png: is empty",), ("3.png", "poses.txt:3", "not a rigid motion"), ("4.png", "2x1", "1x1")):
            with self.assertRaises(octosurf.Error) as refused:
                next(source)
            for word in words:
                self.assertIn(word, str(refused.exception))

    def test_are_skipped_and_listed_on_demand(self):
        source = octosurf.open_scans(self.folder, skip_bad=True)
        self.assertEqual(len(source), 6)
        scans = list(source)
        self.assertEqual((names(scans), places(scans)), (["1.png", "5.png"], [0, 4]))
        self.assertAlmostEqual(scans[1].stamp_s, 4 / 30)  # time went on
        for skipped, name in zip(source.skipped(), ("2.png", "3.png", "4.png", "6.png: is a link to a file"), strict=True):
            self.assertIn(name, skipped)
        self.assertEqual(list(source), [])

    def test_set_up_problems_are_not_skipped_and_nothing_good_at_all_is_a_failure(self):
        self.write("bad/1.pcd", "x")
        self.refused("none of the 1 scans is good", "bad", skip_bad=True)
        self.write("poses.txt", IDENTITY)
        self.refused("1 pose for 6 scans", skip_bad=True)
        (self.folder / "intrinsics.txt").unlink()
        self.refused("without camera intrinsics", skip_bad=True)

    def test_own_pose_file_missing_or_double(self):
        self.write("seven/camera-intrinsics.txt", UNIT_CAMERA)
        for i in (1, 2):
            self.write(f"seven/a-{i}.depth.png", png([[1000]]))
        self.write("seven/a-1.pose.txt", IDENTITY)
        self.refused("a-2.pose.txt: cannot be read", "seven")
        self.write("seven/a-2.pose.txt", lines(0, 0))
        self.refused("a-2.pose.txt: 2 poses for one scan", "seven")
        self.write("seven/a-2.pose.txt", "1 0 0 0\n0 -1.#IND 0 0\n0 0 1 0\n0 0 0 1\n")
        self.refused("a-2.pose.txt:2: '-1.#IND' is not a number", "seven")


def rings(ranges):
    """Rays of 32 rings around z, each of the length that ranges(row, column) has, m."""
    row, column = np.mgrid[0:32, 0:256]
    elevation, azimuth = np.radians(2 * (row - 15.5)), column * np.pi / 128
    level = np.cos(elevation)
    rays = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=-1)
    return (ranges(row, column)[..., None] * rays).reshape(-1, 3)


def wavy_walls(row, column):
    """From 5 to 9 m."""
    return 7 + 2 * np.sin(0.37 * column + 0.21 * row)


class ReadingRules(Folder):
    """What readings mean: whose they are, which are none, in what unit."""

    def cloud(self, points, width=256):
        self.write("a.pcd", pcd(points, "0 0 1 1 0 0 0", width))

    def count(self, name="a.pcd", **options):
        return int(np.isfinite(self.read(name, **options)[0].points).all(axis=1).sum())

    def test_a_cloud_is_a_lidars_unless_the_file_or_an_option_says_other(self):
        v, u = np.mgrid[0:48, 0:64]
        depth = 2 + 0.01 * u + 0.02 * v
        points = np.stack([(u - 31.5) / 50 * depth, (v - 23.5) / 50 * depth, depth], axis=-1)
        for width, kind in ((64, "lidar"), (1, "depth_camera")):  # a column: as a camera's scans are kept
            self.cloud(points, width)
            self.assertEqual(self.read("a.pcd")[0].sensor, kind)
            for asked in ("lidar", "depth_camera"):
                self.assertEqual(self.read("a.pcd", sensor=asked)[0].sensor, asked)

    def test_far_values_and_named_ones(self):
        self.cloud(rings(lambda row, column: np.where(column % 4 == 0, 120, wavy_walls(row, column))))
        self.assertEqual(self.count(), 32 * 256, "what many share is a reading")
        self.assertEqual(self.count(no_return=[120]), 32 * 192)
        self.cloud(rings(lambda row, column: np.where(column % 8 == 0, 3.5, wavy_walls(row, column))))
        self.assertEqual(self.count(no_return=[3.5, 77]), 32 * 224, "to the millimetre")
        self.refused("", "a.pcd", kind="usage", no_return=[-1])

    def test_a_formats_largest_number_is_no_return(self):
        for largest in (np.finfo(np.float32).max, 1e10, 2**32):
            points = rings(wavy_walls)
            points[100] = largest
            points[200] = 0, 0, largest
            self.cloud(points)
            self.assertEqual(self.count(), 32 * 256 - 2)

    def test_a_cameras_named_depth_is_no_return(self):
        v, u = np.mgrid[0:48, 0:64]
        image = np.where((u // 8 + v // 8) % 3 == 0, 10000, 2000 + 10 * u + 20 * v)
        self.write("image.png", png(image))
        self.write("intrinsics.txt", "50 50 31.5 23.5\n")
        self.assertEqual(self.count("image.png", no_return=[10]), (image != 10000).sum())

    def test_readings_in_a_self_box_are_the_robots_own(self):
        self.cloud(rings(lambda row, column: np.where(column < 16, 0.5, wavy_walls(row, column))))
        source = octosurf.open_scans(self.folder / "a.pcd", self_boxes=[([0.2, -1, -1], [1, 1, 1])])
        self.assertEqual(int(np.isfinite(next(source).points).all(axis=1).sum()), 32 * 240)
        self.assertIn("self-box: 512 of the 8192 readings", "\n".join(source.notes()))

    def test_a_clouds_scale_is_its_viewpoints_too(self):
        points = rings(wavy_walls)
        self.cloud(1000 * points)
        scan, = self.read("a.pcd", depth_scale=1000)
        np.testing.assert_allclose(scan.points, points, rtol=0, atol=1e-5)
        self.assertAlmostEqual(scan.T_map_sensor[2, 3], 0.001, delta=1e-12)


# A sensor at 2 m/s that sees a wall at x = 10: SCANS clouds of POINTS, 0.1 s apart, with times as drivers have them.
SCANS, POINTS, FIRST_STAMP_S = 4, 11, 1700000000.5
AFTER_S = 0.0099 * np.arange(POINTS)
# Name, type, unit (s), whether on the stamps' clock or after the stamp.
TIME_FIELDS = [("t", "<u4", 1e-9, False), ("time", "<f4", 1, False), ("timestamp", "<f8", 1, True),
               ("timestamp", "<f8", 1e-9, True), ("offset_time", "<u4", 1e-9, False),
               ("time_stamp", "<u4", 1e-6, False), ("time", "<f4", 1e-6, False), ("t", "<i4", 1e-6, False)]


def stamp_of(scan):
    return FIRST_STAMP_S + 0.1 * scan


def place_at(time_s):
    return 2 * (time_s - FIRST_STAMP_S)


def wall(scan):
    """What it sees of it."""
    x = 10 - place_at(stamp_of(scan) + AFTER_S)
    return np.stack(np.broadcast_arrays(x, np.arange(POINTS), 0.5), axis=-1).astype("<f4")


def times(field, scan):
    _, kind, unit_s, absolute = field
    values = (AFTER_S + stamp_of(scan) * absolute) / unit_s
    return (values if "f" in kind else np.rint(values)).astype(kind)


def track():
    """Times, and places at 100 Hz."""
    t = FIRST_STAMP_S + 0.01 * np.arange(-2, 10 * SCANS + 3)
    return zip(t.tolist(), place_at(t).tolist())


def assert_undone(test, scans):
    """All points on the wall, and rays from where the sensor was."""
    test.assertGreaterEqual(len(scans), SCANS - 1)
    for scan in scans:
        np.testing.assert_allclose(scan.T_map_sensor[0, 3] + scan.points[:, 0].astype(float), 10, atol=1e-4)
        np.testing.assert_allclose(scan.origins[:, 0], 2 * AFTER_S, atol=1e-4)
        test.assertEqual(len(scan.times_s), 0)


class PointTime(Folder):
    """Of points, in cloud files; in bags: bag_reading_test."""

    def test_of_files_undoes_the_motion(self):
        poses = self.write("trajectory.txt", "".join(f"{t:.6f} {x} 0 0 0 0 0 1\n" for t, x in track()))
        head = ("ply\nformat {}\nelement vertex 11\n{}property float x\nproperty float y\nproperty float z\n{}"
                "end_header\n")
        for scan in range(SCANS):
            for n, field in enumerate(TIME_FIELDS):
                self.write(f"pcd_{n}/{stamp_of(scan):.6f}.pcd", pcd(wall(scan), time=(*field[:2], times(field, scan))))
            rows = np.column_stack([np.rint(1e6 * AFTER_S), wall(scan)]).tolist()
            self.write(f"ascii/{stamp_of(scan):.6f}.ply", head.format("ascii 1.0", "property uint t\n", "")
                       + "".join(f"{t:.0f} {x} {y} {z}\n" for t, x, y, z in rows))
            binary = np.zeros(POINTS, [("p", "<f4", 3), ("t", "<f8")])
            binary["p"], binary["t"] = wall(scan), stamp_of(scan) + AFTER_S
            self.write(f"binary/{stamp_of(scan):.6f}.ply",
                       head.format("binary_little_endian 1.0", "", "property double timestamp\n").encode()
                       + binary.tobytes())
        for name in ["ascii", "binary", *(f"pcd_{n}" for n in range(len(TIME_FIELDS)))]:
            with self.subTest(name):
                assert_undone(self, self.read(name, poses=poses))

    def test_a_pose_for_each_scan_is_enough(self):
        for scan in range(SCANS):
            self.write(f"{scan}.pcd", pcd(wall(scan), time=(*TIME_FIELDS[0][:2], times(TIME_FIELDS[0], scan))))
        self.write("poses.txt", lines(*(f"{place_at(stamp_of(scan)):.6f}" for scan in range(SCANS))))
        self.assertEqual(len(self.read()[0].origins), 0, "without time stamps")
        self.write("times.txt", "".join(f"{stamp_of(scan):.6f}\n" for scan in range(SCANS)))
        scans = self.read()
        self.assertEqual(len(scans.pop().times_s), POINTS, "no pose after it")
        assert_undone(self, scans)


@unittest.skipUnless(DATA.is_dir(), f"{DATA} is missing")
class RealScans(Folder):
    """Expected numbers are those of the data's own README files."""

    def of(self, *names, **options):
        return list(octosurf.open_scans([DATA / name for name in names], **options))

    def way(self, scans):
        return np.linalg.norm(np.diff([scan.T_map_sensor[:3, 3] for scan in scans], axis=0), axis=1).sum()

    def sizes(self, scans):
        return [len(scan.points) for scan in scans]

    def test_red_kitchen(self):
        poses, last = [], None
        for last in octosurf.open_scans(DATA / "rgbd_7scenes_redkitchen"):
            poses.append(last.with_pose(last.T_map_sensor))
            self.assertGreaterEqual(len(last.points), 0.85 * 640 * 480)
            self.assertTrue(((last.points[::997, 2] >= 0.8) & (last.points[::997, 2] <= 3.61)).all())
        self.assertEqual((len(poses), last.sensor), (300, "depth_camera"))
        self.assertAlmostEqual(self.way(poses), 2.1, delta=0.05)
        self.assertAlmostEqual(last.stamp_s, 299 / 30)

    def test_balm_lidar(self):
        balm = "lidar_balm_realworld"
        for name in (balm, f"{balm}/scans"):
            scans = self.of(name, poses=DATA / balm / "poses_subset.csv")
            self.assertEqual({scan.sensor for scan in scans}, {"lidar"})
            self.assertEqual(len(scans), 14)
            self.assertTrue(65000 <= min(self.sizes(scans)) and max(self.sizes(scans)) <= 88999)
            np.testing.assert_allclose(np.diff(stamps(scans)), 2.5, atol=0.2)
            self.assertTrue(5 < self.way(scans) < 27.6)  # of all 177 scans
        with self.assertRaisesRegex(octosurf.Error, "177 poses for 14 scans"):
            self.of(balm, poses=DATA / balm / "alidarPose.csv")

    def test_static_clouds(self):
        for name, points in (("pcl_room_scan1.pcd", 112586), ("open3d_fragment.pcd", 113662),
                             ("pcl_region_growing_tutorial.pcd", 108104), ("cgal_building.ply", 100000)):
            cloud, = self.of(f"static_clouds/{name}")
            self.assertEqual(len(cloud.points), points)
        above = cloud.T_map_sensor[:3, 3]  # where it is seen from
        np.testing.assert_allclose(cloud.points[0] + above, [8.19821, -21.7553, 7.88123], atol=1e-4)
        self.assertAlmostEqual(np.ptp(cloud.points[:, 1]), 54.8378, delta=1e-3)  # by awk
        mug, = self.of("static_clouds/pcl_table_scene_mug_stereo_textured.pcd")
        self.assertEqual(np.isfinite(mug.points).all(axis=1).sum(), 209280)
        with self.assertRaisesRegex(octosurf.Error, "not a kind of file"):
            self.of("static_clouds/octomap_scan.dat.bz2")
        sphere, = self.of("static_clouds/octomap_spherical_scan.graph")
        self.assertEqual(len(sphere.points), 10201)
        np.testing.assert_allclose(np.linalg.norm(sphere.points, axis=1), 4.01, atol=0.01)


if __name__ == "__main__":
    unittest.main()
