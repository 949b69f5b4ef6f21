"""What the node publishes against what `octosurf export` writes of the same map, and against liboctomap."""

import json
import math
import os
import struct
import subprocess
import unittest

from ros_world import FOLDER, Node, Player, Topic, octosurf, recording_as_bag, start_ros, wait_for

import rospy

# As their packages publish them: octomap_msgs 0.3, grid_map_msgs 1.6, jsk_recognition_msgs 1.2 and
# convex_plane_decomposition_msgs of elevation_mapping_cupy.
PUBLISHED_SUMS = {"octomap_msgs/Octomap": "9a45536b45c5e409cd49f04bb2d9999f",
                  "grid_map_msgs/GridMap": "95681e052b1f73bf87b7eb984382b401",
                  "jsk_recognition_msgs/PolygonArray": "709b37d39871cfdbbfbd5c41cf9bc2be",
                  "convex_plane_decomposition_msgs/PlanarTerrain": "081e702fce247ef5685dd96b39e3dfd4",
                  "visualization_msgs/MarkerArray": "d155b9ce5188fbaf89745847fd5882d7"}


def single(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def point(message):
    return [message.x, message.y, message.z]


class Published(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        bag = recording_as_bag("depth", ["--frames", "5"], [])
        player = Player(bag)
        cls.node = Node(depth_topics="/camera/depth/image", publish_rate=50).wait_until_ready()
        cls.addClassCleanup(cls.node.end)
        player.connect()
        early = Topic("surfaces", "octosurf_msgs/Surfaces")
        player.play(cls.node, range(len(player.scans)))
        revision = cls.node.status().revision
        early.next(lambda message: message.revision == revision)  # what is new is sent unasked
        early.subscriber.unregister()
        # Whoever comes late gets the map as it is.
        cls.topics = {name: Topic(name, kind) for name, kind in (
            ("surfaces", "octosurf_msgs/Surfaces"), ("markers", "visualization_msgs/MarkerArray"),
            ("polygons", "jsk_recognition_msgs/PolygonArray"), ("octomap_binary", "octomap_msgs/Octomap"),
            ("grid_map", "grid_map_msgs/GridMap"),
            ("planar_terrain", "convex_plane_decomposition_msgs/PlanarTerrain"))}
        cls.messages = {name: topic.next() for name, topic in cls.topics.items()}
        cls.map = FOLDER / "map"
        saved = cls.node.call("save", "Save", file=str(cls.map))
        assert saved.success, saved.message
        file = FOLDER / "map.json"
        octosurf("export", cls.map, "--to", file, "--what", "polygons,convex")
        cls.offline = {surface["id"]: surface for surface in json.loads(file.read_text())["surfaces"]}
        cls.stamp = player.scans[-1][-1][1].header.stamp

    def export(self, kind, *options):
        file = FOLDER / f"{kind}.json"
        octosurf("export", self.map, "--to", file, "--format", kind, "--frame", "map", "--force", *options)
        return json.loads(file.read_text())

    def assert_close(self, a, b):
        self.assertEqual(len(a), len(b))
        for one, other in zip(a, b):
            self.assertAlmostEqual(one, other, delta=1.1e-9)

    def assert_ring(self, message, exported):
        self.assertEqual(len(message.points), len(exported))
        for vertex, expected in zip(message.points, exported):
            self.assert_close(point(vertex), expected)

    def assert_same(self, message, exported, where):
        """A message field by field against the JSON of the same message; headers have their own times."""
        if isinstance(exported, dict):
            for name, value in exported.items():
                if name != "stamp":
                    self.assert_same(getattr(message, name), value, f"{where}.{name}")
        elif isinstance(exported, list):
            self.assertEqual(len(message), len(exported), where)
            for i, (one, other) in enumerate(zip(message, exported)):
                self.assert_same(one, other, f"{where}[{i}]")
        elif exported is None:
            self.assertTrue(math.isnan(message), where)
        elif isinstance(exported, float):
            self.assertIn(message, (exported, single(exported)), where)
        else:
            self.assertEqual(message, exported, where)

    def test_types_are_the_published_ones(self):
        for name, topic in self.topics.items():
            if name != "surfaces":
                self.assertEqual(topic.kind._md5sum, PUBLISHED_SUMS[topic.kind._type])
                self.assertEqual(self.messages[name]._connection_header["md5sum"], topic.kind._md5sum)
                self.assertEqual(self.messages[name]._connection_header["type"], topic.kind._type)

    def test_surfaces(self):
        message = self.messages["surfaces"]
        self.assertEqual(message.header.frame_id, "map")
        self.assertEqual(message.header.stamp, self.stamp)
        self.assertEqual([surface.id for surface in message.surfaces], sorted(self.offline))
        self.assertGreater(len(self.offline), 3)
        for surface in message.surfaces:
            expected = self.offline[surface.id]
            self.assert_close(point(surface.normal), expected["plane"]["normal"])
            self.assertAlmostEqual(surface.offset, expected["plane"]["offset"], delta=1.1e-9)
            self.assertAlmostEqual(surface.area, expected["area_m2"], delta=1e-9)
            self.assertEqual((surface.inliers, surface.revision, list(surface.parents)),
                             (expected["inliers"], expected["revision"], expected["parents"]))
            self.assertEqual(len(surface.polygons), len(expected["polygons"]))
            for polygon, rings in zip(surface.polygons, expected["polygons"]):
                self.assert_ring(polygon.outer, rings["outer"])
                self.assertEqual(len(polygon.holes), len(rings["holes"]))
                for hole, ring in zip(polygon.holes, rings["holes"]):
                    self.assert_ring(hole, ring)

    def test_markers(self):
        first, *markers = self.messages["markers"].markers
        self.assertEqual(first.action, first.DELETEALL)
        self.assertEqual({(marker.ns, marker.id) for marker in markers},
                         {(space, id) for id in self.offline for space in ("surfaces", "outlines")})
        for marker in markers:
            expected = self.offline[marker.id]
            self.assertEqual(marker.header.frame_id, "map")
            if marker.ns == "surfaces":
                self.assertEqual(marker.type, marker.TRIANGLE_LIST)
                lines = [corner for piece in expected["convex"] for k in range(2, len(piece["vertices"]))
                         for corner in (piece["vertices"][0], piece["vertices"][k - 1], piece["vertices"][k])]
            else:
                self.assertEqual(marker.type, marker.LINE_LIST)
                lines = [corner for polygon in expected["polygons"] for ring in (polygon["outer"], *polygon["holes"])
                         for k in range(len(ring)) for corner in (ring[k], ring[(k + 1) % len(ring)])]
            self.assertGreater(len(lines), 0)
            self.assertEqual(len(marker.points), len(lines))
            for one, other in zip(marker.points, lines):
                self.assert_close(point(one), other)

    def test_polygons_are_the_convex_pieces(self):
        message = self.messages["polygons"]
        expected = [(id, piece["vertices"]) for id in sorted(self.offline) for piece in self.offline[id]["convex"]]
        self.assertEqual(list(message.labels), [id for id, _ in expected])
        self.assertEqual(len(message.likelihood), len(expected))
        self.assertEqual(len(message.polygons), len(expected))
        for polygon, (_, vertices) in zip(message.polygons, expected):
            self.assertEqual(polygon.header.frame_id, "map")
            self.assertEqual(len(polygon.polygon.points), len(vertices))
            for vertex, exported in zip(polygon.polygon.points, vertices):
                for one, other in zip(point(vertex), exported):
                    self.assertAlmostEqual(one, other, delta=1e-9 + 1e-7 * abs(other))

    def test_the_octree_is_what_liboctomap_sends(self):
        message = self.messages["octomap_binary"]
        octosurf("export", self.map, "--to", FOLDER / "map.ot", "--force")
        expected = subprocess.run([os.environ["OCTOMAP_BYTES"], FOLDER / "map.ot"], check=True, capture_output=True).stdout
        self.assertGreater(len(expected), 1000)
        self.assertTrue(struct.pack(f"{len(message.data)}b", *message.data) == expected)
        self.assertEqual((message.binary, message.id, message.resolution), (True, "OcTree", 0.02))
        self.assertEqual(message.header.frame_id, "map")

    def test_grid_map(self):
        exported = self.export("grid_map")
        self.assertGreater(len(exported["data"][0]["data"]), 1000)
        self.assert_same(self.messages["grid_map"], exported, "grid_map")
        self.assertEqual(self.messages["grid_map"].info.header.stamp, self.stamp)

    def test_planar_terrain_follows_the_options(self):
        exported = self.export("planar_terrain")
        self.assertGreater(len(exported["planarRegions"]), 0)
        self.assert_same(self.messages["planar_terrain"], exported, "terrain")
        import dynamic_reconfigure.client
        dynamic_reconfigure.client.Client("/octosurf", timeout=60).update_configuration(
            {"foot_radius": 0.02, "max_slope": 10, "cell": 0.05})
        self.topics["planar_terrain"].subscriber.unregister()
        again = Topic("planar_terrain", "convex_plane_decomposition_msgs/PlanarTerrain")
        options = ("--foot-radius", "0.02", "--max-slope", "10", "--cell", "0.05")
        self.assert_same(again.next(), self.export("planar_terrain", *options), "terrain")


if __name__ == "__main__":
    start_ros()
    unittest.main(verbosity=2)
