"""What the node's services answer against what `octosurf query` and `plan` say of the same map."""

import json
import math
import shutil
import unittest

from ros_world import FOLDER, SOURCE, Node, octosurf, start_ros

from geometry_msgs.msg import Point, Vector3

UNKNOWN, FREE, OCCUPIED = range(3)
STATES = ["unknown", "free", "occupied"]


def numbers(message):
    return [message.x, message.y, message.z]


class Services(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.map = FOLDER / "office"
        for ending in ("surfaces", "bt"):
            shutil.copy(SOURCE / f"maps/office.{ending}", FOLDER)
        cls.node = Node(cloud_topics="/cloud", map=cls.map, save_at_end="false").wait_until_ready()
        cls.addClassCleanup(cls.node.end)
        cls.revision = cls.node.status().revision
        octosurf("export", cls.map, "--to", FOLDER / "office.json")
        cls.surfaces = {s["id"]: s for s in json.loads((FOLDER / "office.json").read_text())["surfaces"]}
        level = [s for s in cls.surfaces.values() if s["plane"]["normal"][2] > 0.99]
        cls.floor = max(level, key=lambda s: s["area_m2"])

    def offline(self, *question):
        return json.loads(octosurf("query", self.map, *question, "--json"))

    def query(self, kind, *place, **more):
        answer = self.node.call("query", "Query", kind=kind, point=Point(*place), **more)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.revision, self.revision)
        return answer

    def over_the_floor(self, height=0.5):
        """Some points over the middle of what was seen of it."""
        ring = max((p["outer"] for p in self.floor["polygons"]), key=len)
        middle = [sum(v[i] for v in ring) / len(ring) for i in range(3)]
        return [[middle[0] + dx, middle[1] + dy, middle[2] + height] for dx in (0, 0.3) for dy in (0, 0.4)]

    def assert_place(self, answer, expected):
        self.assertTrue(answer.found)
        self.assertEqual(list(answer.surfaces), [expected["surface"]])
        self.assertAlmostEqual(answer.distance, expected["distance_m"], delta=1e-8)
        for one, other in zip(numbers(answer.point), expected["point"]):
            self.assertAlmostEqual(one, other, delta=1e-8)

    def test_places(self):
        for place in self.over_the_floor():
            self.assert_place(self.query(0, *place), self.offline("--nearest", *place))
            self.assert_place(self.query(0, *place, max_slope=math.radians(20)),
                              self.offline("--nearest", *place, "--max-slope", 20))
            self.assert_place(self.query(1, *place), self.offline("--below", *place))
            for direction in ((0, 0, -1), (1, 0.3, -0.2), (-1, 0.1, 0)):
                expected = self.offline("--ray", *place, *direction)
                answer = self.query(2, *place, direction=Vector3(*direction))
                self.assertEqual(answer.found, expected["surface"] is not None)
                if answer.found:
                    self.assert_place(answer, expected)
                    self.assertEqual(answer.front, expected["side"] == "front")
        self.assertFalse(self.query(0, *self.over_the_floor()[0], distance=1e-3).found)

    def test_surfaces_in_a_space(self):
        x, y, z = self.over_the_floor()[0]
        answer = self.query(3, x, y, z, distance=1.5)
        self.assertGreater(len(answer.surfaces), 1)
        self.assertEqual(list(answer.surfaces), self.offline("--sphere", x, y, z, 1.5)["surfaces"])
        answer = self.query(4, x, y, z, corner=Point(x - 2, y + 1, z - 1))
        self.assertEqual(list(answer.surfaces), self.offline("--box", x - 2, y, z - 1, x, y + 1, z)["surfaces"])

    def test_voxels(self):
        seen = set()
        for x, y, z in self.over_the_floor():
            for height in (0, 0.5, 0.51, 3):
                place = (x, y, z - height)
                expected, answer = self.offline("--voxel", *place), self.query(5, *place)
                self.assertEqual(STATES[answer.state], expected["state"])
                self.assertEqual(list(answer.surfaces), [expected["surface"]] if expected["surface"] else [])
                if answer.state != UNKNOWN:
                    self.assertAlmostEqual(answer.log_odds, expected["log_odds"], places=5)
                seen.add(answer.state)
        self.assertIn(FREE, seen)
        self.assertIn(UNKNOWN, seen)

    def test_contact_regions(self):
        id = self.floor["id"]
        expected = self.offline("--regions", id, "--foot", "0.22x0.11", "--yaw", 30, "--clearance", 0.15,
                                "--edge-margin", 0.02, "--pieces", 4, "--max-slope", 30)
        answer = self.node.call("contact_regions", "ContactRegions", surface=id, length=0.22, width=0.11,
                                yaw=math.radians(30), clearance=0.15, edge_margin=0.02, pieces=4)
        self.assertTrue(answer.success, answer.message)
        (region,) = answer.regions
        self.assertEqual((region.surface, region.revision), (id, expected["revision"]))
        self.assertAlmostEqual(region.area, expected["area_m2"], delta=1e-8)
        self.assertGreater(region.area, 0.1)
        for polygon, rings in zip(region.polygons, expected["polygons"], strict=True):
            for ring, exported in zip([polygon.outer, *polygon.holes], [rings["outer"], *rings["holes"]], strict=True):
                for vertex, other in zip(ring.points, exported, strict=True):
                    for one, value in zip(numbers(vertex), other):
                        self.assertAlmostEqual(one, value, delta=1e-8)
        self.assertEqual(len(region.pieces), len(expected["pieces"]))
        everywhere = self.node.call("contact_regions", "ContactRegions", radius=0.03, any_heading=True)
        self.assertEqual([r.surface for r in everywhere.regions], sorted(self.surfaces))
        steep = [r for r in everywhere.regions if abs(self.surfaces[r.surface]["plane"]["normal"][2]) < 0.1]
        self.assertGreater(len(steep), 0)
        for region in steep:
            self.assertIn("slope", region.refused)

    def standings(self):
        """Two places that stand on the floor, some steps apart: a quadruped's feet stand within 0.4 m of its middle."""
        region = self.node.call("contact_regions", "ContactRegions", surface=self.floor["id"], radius=0.4,
                                any_heading=True, clearance=0.4, pieces=1).regions[0]
        self.assertGreater(len(region.pieces), 0, "nowhere to stand")
        corners = [numbers(v) for v in region.pieces[0].points]
        return max(((a, b) for a in corners for b in corners), key=lambda pair: math.dist(*pair))

    def test_plans(self):
        start, goal = self.standings()
        yaw = math.atan2(goal[1] - start[1], goal[0] - start[0])
        for robot in ("biped", "quadruped"):
            answer = self.node.call("plan", "Plan", robot=robot, start=Point(*start), start_yaw=yaw, goal=Point(*goal),
                                    goal_yaw=yaw, expansions=2000, time_limit=600)
            self.assertTrue(answer.success, answer.message)
            expected = json.loads(octosurf("plan", self.map, "--from", *start, repr(math.degrees(yaw)), "--to", *goal,
                                           repr(math.degrees(yaw)), "--robot", robot, "--budget", 2000, "--json"))
            self.assertEqual(answer.found, expected["found"], answer.message)
            self.assertEqual(len(answer.steps), len(expected["steps"]))
            if robot == "biped":
                self.assertTrue(answer.found, answer.message)
                self.assertGreater(len(answer.steps), 1)
            self.assertAlmostEqual(answer.cost, expected["cost"], places=6)
            for step, other in zip([*answer.start, *answer.steps], [*expected["start"], *expected["steps"]]):
                self.assertEqual((step.foot, step.surface), (other["foot"], other["surface"]))
                for one, value in zip(numbers(step.pose.position), other["at"]):
                    self.assertAlmostEqual(one, value, delta=1e-6)
        nowhere = self.node.call("plan", "Plan", start=Point(*start), goal=Point(start[0], start[1], start[2] + 50))
        self.assertTrue(nowhere.success)
        self.assertFalse(nowhere.found)
        self.assertNotEqual(nowhere.message, "")

    def test_questions_that_make_no_sense(self):
        for name, kind, request in (
                ("query", "Query", {"kind": 77}), ("query", "Query", {"point": Point(math.nan, 0, 0)}),
                ("query", "Query", {"kind": 5, "point": Point(math.inf, 0, 0)}),
                ("query", "Query", {"kind": 2}), ("contact_regions", "ContactRegions", {}),
                ("contact_regions", "ContactRegions", {"radius": -1}),
                ("contact_regions", "ContactRegions", {"radius": 0.05, "surface": 999999}),
                ("contact_regions", "ContactRegions", {"radius": 0.05, "length": 0.2, "width": 0.1}),
                ("plan", "Plan", {"robot": "snake"}), ("plan", "Plan", {"start": Point(math.nan, 0, 0)})):
            answer = self.node.call(name, kind, **request)
            self.assertFalse(answer.success, (name, request))
            self.assertNotEqual(answer.message, "", (name, request))

    def test_saving_and_loading(self):
        """Another map, back again: the same bytes."""
        self.assertTrue(self.node.call("save", "Save", file=str(FOLDER / "copy")).success)
        octosurf("simulate", "room", "--frames", 2, "-o", FOLDER / "room")
        octosurf("map", FOLDER / "room", "-o", FOLDER / "other")
        loaded = self.node.call("load", "Load", file=str(FOLDER / "other"))
        self.assertTrue(loaded.success, loaded.message)
        self.assertTrue(self.node.call("save", "Save", file=str(FOLDER / "other_copy")).success)
        self.assertTrue(self.node.call("load", "Load", file=str(FOLDER / "copy")).success)
        self.assertTrue(self.node.call("save", "Save", file=str(FOLDER / "again")).success)
        for one, other in (("other", "other_copy"), ("copy", "again")):
            for ending in ("surfaces", "bt"):
                self.assertTrue((FOLDER / f"{one}.{ending}").read_bytes() ==
                                (FOLDER / f"{other}.{ending}").read_bytes(), one)
        revert = self.node.call("load", "Load")  # what was loaded last is the node's own
        self.assertIn("copy", revert.message)


if __name__ == "__main__":
    start_ros()
    unittest.main(verbosity=2)
