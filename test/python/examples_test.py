"""The examples run as a reader runs them."""

import collections
import json
import re
import runpy
import struct
import subprocess
import sys
import types
import unittest
import unittest.mock
import zlib

import numpy as np
import octosurf
import world


class Examples(unittest.TestCase):
    def run_python(self, *arguments):
        return subprocess.run([sys.executable, *map(str, arguments)], check=True, capture_output=True, text=True,
                              cwd=world.FOLDER).stdout

    def test_kitchen(self):
        picture = world.FOLDER / "kitchen.png"
        told = self.run_python(world.SOURCE / "examples/kitchen.py", world.recording(), "--picture", picture)
        self.assertRegex(told, r"\d+ surfaces")
        self.assertRegex(told, r"steps|no plan: ")
        self.assertGreater(picture.stat().st_size, 10000)

    def test_sl1m_piece(self):
        """As SL1M's convert_surface_to_inequality() reads it, and where that shears: at any tilt A p <= b is the piece."""
        sl1m_piece = runpy.run_path(str(world.SOURCE / "examples/sl1m_pieces.py"))["sl1m_piece"]
        rng = np.random.default_rng(3)
        for count in range(5, 60):
            angles = np.sort(rng.uniform(0, 2 * np.pi, count)) / 2 + np.linspace(0, np.pi, count, endpoint=False)
            flat = np.c_[2 * np.cos(angles), np.sin(angles), np.zeros(count)]
            flat = np.insert(flat, 1, flat[:2].mean(axis=0), axis=0)  # three in a row on one side
            turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            turn *= np.linalg.det(turn)
            piece = sl1m_piece(7, turn[:, 2], flat @ turn.T + rng.uniform(-8, 8, 3))
            ring, A, b = (np.array(piece[key]) for key in ("vertices", "A", "b"))
            first = np.cross(ring[1] - ring[0], ring[2] - ring[0])  # SL1M's normal
            np.testing.assert_allclose(first / np.linalg.norm(first), turn[:, 2], atol=1e-6)
            np.testing.assert_allclose(np.linalg.norm(A, axis=1), 1)
            slack = b[:, None] - A @ ring.T
            self.assertGreater(slack.min(), -1e-12)
            # A row for each edge, which its two ends touch; the last two are the plane.
            on = slack < 1e-9
            for edge in range(len(ring)):
                self.assertTrue(on[edge, [edge, (edge + 1) % len(ring)]].all())
            self.assertTrue(on[-2:].all())
            outside = ring[0] + ring[1] - 2 * ring.mean(axis=0)
            self.assertGreater((A[0] @ (ring[0] + 1e-3 * outside)) - b[0], 0)

    def test_policy_heights(self):
        told = self.run_python(world.SOURCE / "examples/policy_heights.py", world.recording())
        self.assertRegex(told, r"\(17, 11\) heights, \d+ times: p50 [\d.]+ ms")

    def test_height_image(self):
        file = world.FOLDER / "heights.png"
        self.run_python(world.SOURCE / "examples/height_image.py", world.SOURCE / "maps/office", file, 0.1)
        about, grid = json.loads(file.with_suffix(".json").read_text()), octosurf.height_grid(
            octosurf.load(world.SOURCE / "maps/office").snapshot(), cell=0.1)
        data = file.read_bytes()
        self.assertEqual(data[16:26], struct.pack(">IIBB", about["width"], about["height"], 16, 0))
        start, length = data.index(b"IDAT"), int.from_bytes(data[data.index(b"IDAT") - 4:][:4], "big")
        rows = np.frombuffer(zlib.decompress(data[start + 4:start + 4 + length]), np.uint8).reshape(about["height"], -1)
        self.assertFalse(rows[:, 0].any())  # unfiltered
        values = rows[:, 1:].copy().view(">u2").astype(int)
        for row, column in np.ndindex(grid.elevation.shape):
            x, y = (grid.center_of(row, column) - about["origin"]) / about["cell"]
            value, height = values[round(-y), round(x)], grid.elevation[row, column]
            self.assertEqual(value == 0, np.isnan(height))
            if value:
                self.assertAlmostEqual(about["offset"] + about["scale"] * value, height, delta=0.51 * about["scale"])

    def test_frontiers(self):
        """Edges of the surfaces' own planes; of the tables that the recording went around none."""
        file = world.FOLDER / "edges.json"
        told = self.run_python(world.SOURCE / "examples/frontiers.py", world.SOURCE / "maps/office", file)
        lengths = {int(surface): float(metres) for surface, metres in re.findall(r"surface (\d+): ([\d.]+) m", told)}
        snapshot = octosurf.load(world.SOURCE / "maps/office").snapshot()
        self.assertEqual(set(lengths), {surface.id for surface in snapshot.surfaces})
        self.assertGreater(sum(lengths.values()), 1)
        self.assertGreater(sum(metres == 0 for metres in lengths.values()), len(lengths) / 4)
        for edge in json.loads(file.read_text()):
            plane = snapshot.find(edge["surface"]).plane
            np.testing.assert_allclose(np.array(edge["edge"]) @ plane.normal, plane.offset, atol=1e-6)

    def test_circles(self):
        """Each lies in a piece, and of random points of the piece none is farther from its edges than the centre."""
        exported, file = world.FOLDER / "convex.json", world.FOLDER / "circles.json"
        world.command("export", world.SOURCE / "maps/office", "--to", exported, "--what", "convex")
        self.run_python(world.SOURCE / "examples/circles.py", exported, file, 0.05)
        circles, rng, found = json.loads(file.read_text()), np.random.default_rng(5), 0
        radii = [circle["radius"] for circle in circles]
        self.assertEqual(radii, sorted(radii, reverse=True))
        self.assertGreaterEqual(radii[-1], 0.05)
        for surface in json.loads(exported.read_text())["surfaces"]:
            to_surface = np.linalg.inv(np.reshape(surface["T_map_surface"], (4, 4)))
            own = [circle for circle in circles if circle["surface"] == surface["id"]]
            centers = np.array([to_surface @ [*circle["center"], 1] for circle in own]).reshape(-1, 4)
            np.testing.assert_allclose(centers[:, 2], 0, atol=1e-9)
            for piece in surface["convex"]:
                A, b = np.array(piece["A"]), np.array(piece["b"])
                depth = (b - centers[:, :2] @ A.T).min(axis=1)
                here = [circle["radius"] for circle, inside in zip(own, depth) if abs(inside - circle["radius"]) < 1e-6]
                found += len(here)
                shares = rng.dirichlet(np.ones(len(piece["vertices"])), 1000)
                points = np.c_[shares @ np.array(piece["vertices"]), np.ones(1000)] @ to_surface.T
                deepest = (b - points[:, :2] @ A.T).min(axis=1).max()
                self.assertLessEqual(deepest, max(here, default=0.05) + 1e-9)
        self.assertEqual(found, len(circles))

    def test_hpp_affordances(self):
        pieces, folder = world.FOLDER / "pieces.json", world.FOLDER / "affordances"
        told = self.run_python(world.SOURCE / "examples/sl1m_pieces.py", world.SOURCE / "maps/office", pieces,
                               "--foot", 0.06)
        self.assertIn(f"{len(json.loads(pieces.read_text()))} convex pieces", told)
        self.run_python(world.SOURCE / "examples/hpp_affordances.py", pieces, folder)
        listed, corners = json.loads(pieces.read_text()), {}
        self.assertEqual(len(list(folder.iterdir())), len(listed))
        numbers = collections.Counter()
        for piece in listed:
            numbers[piece["id"]] += 1
            stl = (folder / f"surface_{piece['id']}_{numbers[piece['id']]}.stl").read_bytes()
            rows = np.frombuffer(stl[84:], [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
            self.assertEqual(len(rows), int.from_bytes(stl[80:84], "little"))
            a, b, c = np.moveaxis(rows["corners"].astype(float), 1, 0)
            doubled = np.cross(b - a, c - a)  # hpp takes the triangle's own normal, so the winding matters
            self.assertTrue((doubled @ piece["normal"] > 0.9999 * np.linalg.norm(doubled, axis=1)).all())
            ring = np.array(piece["vertices"])
            area = np.cross(ring[1:-1] - ring[0], ring[2:] - ring[0]).sum(axis=0) @ piece["normal"]
            self.assertAlmostEqual(np.linalg.norm(doubled, axis=1).sum(), area, delta=0.001)
            # Within 3e-8 m hpp joins faces: those of one surface may meet, others may not.
            for corner in map(tuple, rows["corners"].reshape(-1, 3)):
                self.assertEqual(corners.setdefault(corner, piece["id"]), piece["id"])

    def test_ihmc_regions(self):
        folder = world.FOLDER / "regions"
        self.run_python(world.SOURCE / "examples/ihmc_regions.py", world.SOURCE / "maps/office", folder)
        snapshot = octosurf.load(world.SOURCE / "maps/office").snapshot()
        surfaces = {surface.id: surface for surface in snapshot.surfaces}
        real = r"(-?[\d.]+(?:e-?\d+)?)"
        line = re.compile(rf"regionId: (\d+), index: (\d+), origin: {real}, {real}, {real}, "
                          rf"orientation: {real}, {real}, {real}, {real}, concave hull size: (\d+), "
                          r"number of convex polygons: (\d+), \[([\d, ]*)\]")
        header = (folder / "header.txt").read_text().splitlines()
        self.assertEqual(len(header), sum(len(surface.polygons) for surface in surfaces.values()))
        convex = collections.Counter()
        for text in header:
            identity, index, *numbers, hull, count, sizes = line.fullmatch(text).groups()
            surface, (x, y, z, angle) = surfaces[int(identity)], map(float, numbers[3:])
            self.assertAlmostEqual(x * x + y * y + z * z, 1)
            # Rodrigues: where the turn takes z, which is the normal turned so that up is z.
            normal_z = np.cos(angle) + z * z * (1 - np.cos(angle))
            self.assertAlmostEqual(normal_z, np.cos(surface.slope_rad(snapshot.up())))
            sizes = [int(hull), *map(int, filter(None, sizes.split(", ")))]
            self.assertEqual(len(sizes), int(count) + 1)
            vertices = np.loadtxt(folder / f"region{identity}_{index}", delimiter=",")
            self.assertEqual(vertices.shape, (sum(sizes), 2))
            for k, ring in enumerate(np.split(vertices, np.cumsum(sizes)[:-1])):
                doubled = np.cross(ring, np.roll(ring, -1, axis=0)).sum()
                self.assertLess(doubled, 0)  # clockwise, as theirs
                convex[int(identity)] -= doubled / 2 if k else 0
        for identity, surface in surfaces.items():
            self.assertAlmostEqual(convex[identity], surface.area_m2, delta=0.05 * surface.area_m2 + 0.01)

    def test_ros1_node(self):
        """With a ROS that hands over two clouds, the second in a frame that tf does not know."""
        rows = np.zeros((100, 110), [("intensity", "<f4"), ("z", "<f4"), ("x", "<f4"), ("y", "<f4")])  # the last 10 pad
        rows["x"], rows["y"] = np.meshgrid(np.arange(110) * 0.02, np.arange(100) * 0.02)
        rows["z"], rows["intensity"] = -1, np.nan
        cloud = types.SimpleNamespace(height=100, width=100, point_step=16, row_step=110 * 16, is_bigendian=False,
                                      data=rows.tobytes(), fields=[types.SimpleNamespace(name=name, offset=4 * i)
                                                                   for i, name in enumerate(rows.dtype.names)])
        half = 0.5 ** 0.5  # a quarter turn about z, 3 m to the side and 1.5 m up
        pose = types.SimpleNamespace(translation=types.SimpleNamespace(x=3, y=0, z=1.5),
                                     rotation=types.SimpleNamespace(x=0, y=0, z=half, w=half))
        stamp = types.SimpleNamespace(to_sec=lambda: 7.0)
        ros = {name: types.ModuleType(name) for name in ("rospy", "tf2_ros", "sensor_msgs", "sensor_msgs.msg")}
        rospy, tf = ros["rospy"], ros["tf2_ros"]
        ros["sensor_msgs"].msg, ros["sensor_msgs.msg"].PointCloud2 = ros["sensor_msgs.msg"], None
        warnings, tf.TransformException = [], LookupError
        tf.Buffer = lambda: types.SimpleNamespace(
            lookup_transform=lambda to, of, at, _: types.SimpleNamespace(
                transform={("map", "lidar", 7.0): pose}[to, of, at.to_sec()]))
        tf.TransformListener = rospy.Duration = rospy.init_node = lambda *_: None
        rospy.logwarn = lambda *words: warnings.append(words)
        rospy.Subscriber = lambda topic, kind, callback, **_: setattr(rospy, "callback", callback)

        def spin():
            for frame in ("lidar", "elsewhere"):
                cloud.header = types.SimpleNamespace(stamp=stamp, frame_id=frame)
                rospy.callback(cloud)

        rospy.spin = spin
        with unittest.mock.patch.dict(sys.modules, ros):
            runpy.run_path(str(world.SOURCE / "examples/ros1_node.py"))["main"]("/points", "map", f"{world.FOLDER}/ros1")
        self.assertEqual(len(warnings), 1)
        (surface,) = octosurf.load(f"{world.FOLDER}/ros1").snapshot().surfaces
        corners = surface.boundary
        np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[1.02, 0, 0.5], [3, 1.98, 0.5]], atol=0.03)
