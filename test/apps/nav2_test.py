"""nav2_test.py COMMAND [unittest's arguments]: `octosurf export MAP --to FOLDER/` of a simulated house of two storeys.

The readers here follow nav2_map_server's map_io.cpp and nav2_route's geojson_graph_file_loader.cpp, and refuse what those only
guess at. What is true of the house is read from the simulation's truth.json.
"""

import json
import math
import pathlib
import re
import resource
import sys
import tempfile
import unittest

from serving import command

RADIUS = 0.25
CELL = 0.05
FREE, OCCUPIED, UNKNOWN = 0, 100, -1


class Grid:
    """A map as map_server loads it: cell (x, y) counts from the lower left corner."""

    def __init__(self, file):
        fields = dict(line.split(": ", 1) for line in file.read_text().splitlines())
        assert set(fields) == {"image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"}, fields
        assert fields["mode"] == "trinary" and fields["negate"] == "0"
        assert fields["image"] == file.stem + ".pgm"
        self.cell = float(fields["resolution"])
        x, y, yaw = json.loads(fields["origin"])
        assert all(isinstance(number, float) for number in (x, y, yaw)) and yaw == 0
        self.origin = x, y
        occupied, free = float(fields["occupied_thresh"]), float(fields["free_thresh"])
        data = (file.parent / fields["image"]).read_bytes()
        head = re.match(rb"P5\n(\d+) (\d+)\n255\n", data)
        self.width, self.height = int(head[1]), int(head[2])
        pixels = data[head.end():]
        assert len(pixels) == self.width * self.height
        value = {}
        for pixel in {0, 205, 254}:
            occupancy = 1 - pixel / 255
            value[pixel] = OCCUPIED if occupancy > occupied else FREE if occupancy < free else UNKNOWN
        assert value == {0: OCCUPIED, 205: UNKNOWN, 254: FREE}, value
        self.cells = {(i % self.width, self.height - 1 - i // self.width): value[pixel] for i, pixel in enumerate(pixels)}

    def at(self, x, y):
        return self.cells.get((math.floor((x - self.origin[0]) / self.cell), math.floor((y - self.origin[1]) / self.cell)), UNKNOWN)

    def middle(self, cell):
        return tuple(origin + self.cell * (i + 0.5) for origin, i in zip(self.origin, cell))

    def free(self):
        return [self.middle(cell) for cell, value in self.cells.items() if value == FREE]

    def clear(self, x, y):
        """Whether a robot there touches nothing, to a cell."""
        reach = RADIUS - self.cell
        around = [(x + r * math.cos(a / 8 * math.pi), y + r * math.sin(a / 8 * math.pi)) for a in range(16) for r in (reach / 2, reach)]
        return self.at(x, y) == FREE and all(self.at(*place) != OCCUPIED for place in around)


def is_count(value):
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def check_metadata(metadata):
    """Numbers, booleans, strings, lists of these and objects; the loader throws for null."""
    for value in metadata.values():
        if isinstance(value, dict):
            check_metadata(value)
        else:
            assert all(isinstance(item, (bool, int, float, str)) for item in (value if isinstance(value, list) else [value])), metadata


class Graph:
    def __init__(self, file):
        collection = json.loads(file.read_text())
        assert collection["type"] == "FeatureCollection"
        self.nodes, self.edges, places = {}, [], {}
        for feature in collection["features"]:
            assert feature["type"] == "Feature"
            properties, geometry = feature["properties"], feature["geometry"]
            assert is_count(properties["id"]) and properties["id"] not in places, "ids of nodes and edges are one set"
            check_metadata(properties["metadata"])
            places[properties["id"]] = geometry
            if geometry["type"] == "Point":
                assert set(properties) == {"id", "frame", "metadata"} and properties["frame"] == "map"
                assert len(geometry["coordinates"]) == 2 and all(map(math.isfinite, geometry["coordinates"]))
                self.nodes[properties["id"]] = {"at": geometry["coordinates"], **properties["metadata"]}
                continue
            assert geometry["type"] == "MultiLineString"
            assert set(properties) - {"operations"} == {"id", "startid", "endid", "cost", "overridable", "metadata"}
            assert isinstance(properties["overridable"], bool) and isinstance(properties["cost"], float) and properties["cost"] > 0
            for operation in properties.get("operations", {}).values():
                assert isinstance(operation["type"], str) and operation["trigger"] in ("NODE", "ON_ENTER", "ON_EXIT")
                check_metadata(operation["metadata"])
            (line,) = geometry["coordinates"]
            assert line[0] == places[properties["startid"]]["coordinates"] and line[-1] == places[properties["endid"]]["coordinates"]
            self.edges.append(properties | {"line": line})


class Face:
    """A true face that one can stand on, seen from above."""

    def __init__(self, face):
        self.normal, self.offset = face["normal"], face["offset"]
        rows = [face["T_map_face"][4 * i:4 * i + 4] for i in range(2)]
        project = lambda ring: [(rows[0][0] * u + rows[0][1] * v + rows[0][3], rows[1][0] * u + rows[1][1] * v + rows[1][3]) for u, v in ring]
        self.rings = [project(ring) for polygon in face["polygons"] for ring in [polygon["outer"], *polygon["holes"]]]

    def height(self, x, y):
        return (self.offset - self.normal[0] * x - self.normal[1] * y) / self.normal[2]

    def sides(self):
        return [side for ring in self.rings for side in zip(ring, ring[1:] + ring[:1])]

    def inside(self, x, y):
        crossed = [(y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0) for (x0, y0), (x1, y1) in self.sides()]
        return sum(crossed) % 2 == 1

    def to_edge(self, x, y):
        def to(side):
            (x0, y0), (x1, y1) = side
            dx, dy = x1 - x0, y1 - y0
            t = max(0, min(1, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy)))
            return math.hypot(x - x0 - t * dx, y - y0 - t * dy)
        return min(map(to, self.sides()))


class House(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        root = pathlib.Path(folder.name)
        command("simulate", "storeys", "-o", root / "sim", "--frames", 160)
        command("map", root / "sim", "-o", root / "house", "--resolution", 0.03)
        cls.map, cls.nav2 = root / "house", root / "nav2"
        cls.said = cls.export()
        truth = json.loads((root / "sim/truth.json").read_text())
        cls.faces = {face["name"]: Face(face) for face in truth["faces"] if face["normal"][2] > 0.9}
        cls.ground = [cls.faces["floor/top"], cls.faces["slab/top"]]
        cls.things = [[cls.faces["table/top"]], [cls.faces["cupboard/top"], cls.faces["chest/top"]]]
        (cls.stair,) = truth["stairs"]
        cls.grids = [Grid(cls.nav2 / f"storey_{i}.yaml") for i in range(2)]
        cls.graph = Graph(cls.nav2 / "route.geojson")

    @classmethod
    def export(cls, *options, **how):
        return command("export", cls.map, "--to", f"{cls.nav2}/", "--radius", RADIUS, "--headroom", 1.5, *options, **how)

    def test_there_is_a_grid_for_each_storey_and_a_route(self):
        self.assertEqual(sorted(file.name for file in self.nav2.iterdir()),
                         ["route.geojson", "storey_0.pgm", "storey_0.yaml", "storey_1.pgm", "storey_1.yaml"])
        self.assertRegex(self.said, r"storey_1: \d+ x \d+ cells of 0.05 m at z = .*\nroute.geojson: 2 nodes, 2 edges, 1 stairs")

    def test_free_is_true_ground_away_from_things_and_what_was_seen_of_it(self):
        for storey, (grid, ground, things) in enumerate(zip(self.grids, self.ground, self.things)):
            with self.subTest(storey=storey):
                free = grid.free()
                self.assertGreater(len(free) * CELL * CELL, 10)
                self.assertEqual([p for p in free if not ground.inside(*p) and ground.to_edge(*p) > 1.5 * CELL], [])
                self.assertEqual([p for p in free for thing in things if thing.inside(*p) and thing.to_edge(*p) > CELL], [])
                wide = [cell for cell in map(grid.middle, grid.cells)
                        if ground.inside(*cell) and ground.to_edge(*cell) > 0.15
                        and all(not thing.inside(*cell) and thing.to_edge(*cell) > 0.15 for thing in things)]
                states = [grid.at(*cell) for cell in wide]
                self.assertGreater(states.count(FREE), 0.9 * len(states))
                self.assertLess(states.count(OCCUPIED), 0.01 * len(states))

    def test_the_stairwell_and_the_table_are_occupied(self):
        middles = [tuple((a + b) / 2 for a, b in zip(left, right)) for left, right in self.stair["edges"]]
        well = [self.grids[1].at(x, y) for x, y, _ in middles[1:-1]]
        self.assertNotIn(FREE, well)
        self.assertGreater(well.count(OCCUPIED), 0.8 * len(well))
        self.assertNotIn(FREE, [self.grids[0].at(x, y) for x, y, _ in middles[:8]])
        (table,) = self.things[0]
        under = [self.grids[0].at(*cell) for cell in map(self.grids[0].middle, self.grids[0].cells)
                 if table.inside(*cell) and table.to_edge(*cell) > CELL]
        self.assertGreater(under.count(OCCUPIED), 0.95 * len(under))

    def test_the_stair_is_an_edge_each_way(self):
        edges, count = self.stair["edges"], len(self.stair["edges"])
        self.assertEqual([edge["metadata"]["direction"] for edge in self.graph.edges], ["up", "down"])
        lean = self.ground[0].normal  # the house stands at an angle to z
        upright = lambda v: [a - sum(b * n for b, n in zip(v, lean)) * n for a, n in zip(v, lean)]
        first, last = [[(a + b) / 2 for a, b in zip(*edges[i])] for i in (0, -1)]
        ahead = upright([b - a for a, b in zip(first, last)])
        for edge in self.graph.edges:
            said, start, end = edge["metadata"], self.graph.nodes[edge["startid"]], self.graph.nodes[edge["endid"]]
            up = said["direction"] == "up"
            self.assertEqual((said["class"], said["kind"], said["risers"]), ("stair", "straight", count))
            self.assertAlmostEqual(said["riser_m"], self.stair["riser_m"], delta=0.01)
            self.assertAlmostEqual(said["tread_m"], self.stair["tread_m"], delta=0.015)
            self.assertAlmostEqual(said["width_m"], math.dist(*edges[0]), delta=0.12)
            heading = math.atan2(ahead[1], ahead[0]) + (0 if up else math.pi)
            self.assertLess(abs(math.remainder(math.radians(said["heading_deg"]) - heading, 2 * math.pi)), math.radians(4))
            self.assertEqual((said["from_storey"], said["to_storey"]), (0, 1) if up else (1, 0))
            self.assertEqual((start["storey"], end["storey"]), (said["from_storey"], said["to_storey"]))
            self.assertAlmostEqual(abs(said["rise_m"]), count * self.stair["riser_m"], delta=0.25)  # on leaning floors
            for node in (start, end):
                self.assertEqual(node["class"], "landing")
                self.assertTrue(self.grids[node["storey"]].clear(*node["at"]))
                self.assertAlmostEqual(node["height_m"], self.ground[node["storey"]].height(*node["at"]), delta=0.02)
            self.assertGreater(edge["cost"], math.dist(first, last))
            self.assertLess(edge["cost"], math.dist(first, last) + 4 * (RADIUS + CELL) + 0.5)

    def test_operations_are_written_where_they_are_asked_for(self):
        self.assertNotIn("operations", self.graph.edges[0])
        self.export("--stair-operation", "ClimbStair", "--force")
        for edge in Graph(self.nav2 / "route.geojson").edges:
            self.assertEqual({name: (o["type"], o["trigger"]) for name, o in edge["operations"].items()},
                             {"enter_stair": ("ClimbStair", "ON_ENTER"), "leave_stair": ("ClimbStair", "ON_EXIT")})

    def test_folders_of_others_and_what_a_full_disk_does_not_replace_are_left_alone(self):
        self.assertIn("--force", self.export(code=2))
        (self.nav2 / "mine.txt").write_text("")
        self.assertIn("mine.txt", self.export("--force", code=2))
        (self.nav2 / "mine.txt").unlink()
        files = lambda: {file: file.read_bytes() for file in self.nav2.parent.glob("nav2*/*")}
        before = files()
        full = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        self.assertIn("cannot be written", self.export("--force", code=1, preexec_fn=full, restore_signals=False))
        self.assertEqual(files(), before)
        self.export("--force", "--max-step", 0.07)
        self.assertEqual(len(list(self.nav2.parent.glob("nav2*"))), 1)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
