"""What a user of Python holds: its text, its dict; settings by name, rows of points, and up."""

import functools
import inspect
import json
import unittest

import numpy as np

import octosurf
import world
from world import at, floor, mapped_floor


def classes():
    """All but settings and the exception, with those inside others."""
    named = [getattr(octosurf, name) for name in octosurf.__all__]
    named = [one for one in named if inspect.isclass(one) and not issubclass(one, Exception)]
    return named + [inner for one in named for inner in vars(one).values() if inspect.isclass(inner)]


def properties_of(cls):
    return {name for name, member in vars(cls).items() if isinstance(member, property)}


@functools.cache
def stairwell():
    """A Mapper of four steps with a pillar beside them."""
    steps = world.grid(np.arange(-0.5, 0.5, 0.01), np.arange(-0.8, 1.8, 0.01),
                       lambda x, y: 0.17 * np.clip(np.floor(y / 0.3 + 1e-9) + 1, 0, 4))
    around, up = (axis.ravel() for axis in np.meshgrid(np.arange(-np.pi, 0, 0.06), np.arange(0, 1, 0.01)))
    pillar = np.stack([1 + 0.1 * np.cos(around), 0.1 * np.sin(around) - 0.2, up], axis=-1)
    mapper = octosurf.Mapper()
    mapper.insert_points(np.concatenate([steps, pillar]) - [0, -1, 3], at(0, -1, 3))
    return mapper


@functools.cache
def holed_floor():
    """A Mapper of a floor with a hole in its middle."""
    points = floor()
    mapper = octosurf.Mapper()
    mapper.insert_points(points[np.abs(points[:, :2]).max(axis=1) >= 0.1], at(0, 0, 1))
    return mapper


def judged():
    """Of a floor, seen twice."""
    judge = octosurf.RecordingJudge(octosurf.Parameters(resolution=0.05))
    for x in (0, 0.1):
        scan = octosurf.Scan(floor(), at(x, 0, 0), name=f"from {x}")
        judge.add(scan, scan.T_map_sensor)
    return judge


def results():
    """One at least of every class of results."""
    mapper = mapped_floor()
    whole, snapshot = mapper.map(), mapper.snapshot()
    (surface,) = snapshot.surfaces
    foot = octosurf.ContactShape.rectangle(0.2, 0.1)
    region = octosurf.contact_region(surface, foot)
    octree = whole.octree()
    other = octosurf.Mapper()
    other.insert_points(floor(), np.eye(4))
    scan = next(octosurf.open_scans(world.recording()))
    pieces = octosurf.convex_pieces(surface, surface.polygons)
    planned = octosurf.PlannerSurface(surface, region, pieces)
    grid = octosurf.height_grid(snapshot)
    standing = octosurf.Standing(at=[-0.2, 0, 0])
    merged = other.merge(whole, at(2, 0, 0))
    stairs, limits = octosurf.find_stairs(stairwell().snapshot()), octosurf.StoreyLimits(radius_m=0.1)
    (stair,) = stairs.stairs
    well = octosurf.GroundView(stairwell().snapshot(), stairwell().map().octree())
    storeys = octosurf.find_storeys(well, limits)
    route = octosurf.find_route(well, storeys, limits)
    holed = octosurf.GroundView(holed_floor().snapshot(), holed_floor().map().octree())
    narrow = octosurf.Mapper()
    narrow.insert_points(world.grid(np.arange(0, 0.03, 0.005), np.arange(0, 0.5, 0.005), lambda x, y: -1), at(0, 0, 1))
    too_narrow = octosurf.explain(narrow.map(), [0, 0.2, 0])
    cleared = octosurf.Mapper()
    cleared.insert_points(floor(), at(0, 0, 1))
    cleared.clear(octosurf.SpacePart.box([-1, -1, -1], [1, 1, 1]))
    return [
        *storeys, route, *route.nodes, *route.edges, stairs, stair, stair.riser, *stair.steps,
        *stairwell().snapshot().cylinders, *holed.gaps(1), *cleared.snapshot().removals(), too_narrow, *too_narrow.figures,
        octosurf.Localizer(whole).localize(scan), octosurf.Localizer(whole).find([scan]), octosurf.align_maps(snapshot, other.map()), merged,
        octosurf.changes_since(snapshot, 0), foot, region, octosurf.foothold(surface, foot, [0, 0, 0], 0),
        octosurf.explain(whole, [0, 0, 0]), octosurf.explain(whole, [0, 0, 0.3]),
        octosurf.plan(snapshot, standing, octosurf.Standing(at=[0.2, 0, 0])),
        *octosurf.plan(snapshot, standing, octosurf.Standing(at=[0.2, 0, 0])).steps,
        octosurf.plan(snapshot, standing, octosurf.Standing(at=[9, 0, 0])).refusal,
        mapper.drain(), judged().judge(), whole.at([0, 0, 0]), whole.at([0, 0, 9]), whole.size(), octosurf.up_of(whole),
        octree.at([0, 0, 0]), octree.count([-1, -1, -1], [1, 1, 1]), grid, planned,
        octosurf.SurfaceIndex(snapshot).nearest([0, 0, 1]), octosurf.SurfaceIndex(snapshot).first_on_ray([0, 0, 1], [0, 0, -1]),
        octosurf.ConvexSpace.box([0, 0, 0], [1, 1, 1]), scan, surface,
        octosurf.SpacePart.cylinder([0, 0, 0], 1, 2),
        surface.plane, *surface.polygons, surface.extrude(0.1), *pieces,
    ]


class Results(unittest.TestCase):
    def test_have_text_and_dict(self):
        seen = set()
        for value in results():
            cls = type(value)
            seen.add(cls)
            fields = value.to_dict()
            self.assertEqual(set(fields), properties_of(cls) - {"found"}, cls)
            json.dumps(fields)
            self.assertNotIn("\n", repr(value))
            self.assertLess(len(repr(value)), 700, cls)
            self.assertIn(cls.__name__, repr(value))
        with_fields = {cls for cls in classes() if hasattr(cls, "to_dict") and not hasattr(cls, "from_dict")}
        self.assertEqual(with_fields - seen, set(), "nothing of these classes was looked at")

    def test_every_class_says_what_it_is(self):
        self.assertEqual([cls.__name__ for cls in classes() if cls.__repr__ is object.__repr__], [])
        documented = [(cls, "__doc__") for cls in classes()] + [(cls, name) for cls in classes() for name in properties_of(cls)]
        self.assertEqual([(cls, name) for cls, name in documented if not inspect.getdoc(getattr(cls, name))], [])
        mapper = mapped_floor()
        self.assertEqual(repr(mapper), "<Mapper at revision 1: 1 surfaces>")
        self.assertRegex(repr(mapper.map()), r"<Map: 1 scans, \d+ points, 1 surfaces>")

    def test_text_is_short_and_dict_is_rows(self):
        nearest = octosurf.SurfaceIndex(mapped_floor().snapshot()).nearest([0, 0.25, 1])
        self.assertRegex(repr(nearest), r"^Nearest\(id=1, point=\[.*, 0\.25, .*\], distance=1\)$")
        (polygon,) = holed_floor().snapshot().surfaces[0].polygons
        self.assertRegex(repr(polygon), r"^Polygon\(outer=array\(\d+, 2\), holes=\[.*\]\)$")
        self.assertEqual(polygon.to_dict(), {"outer": polygon.outer.tolist(), "holes": [hole.tolist() for hole in polygon.holes]})


class Keywords(unittest.TestCase):
    def test_are_the_fields_of_the_groups(self):
        for group in ("occupancy", "surfaces", "detection"):
            for name, value in getattr(octosurf.Parameters.paper(resolution=0.05), group).to_dict().items():
                flat = octosurf.Parameters(**{name: value})
                self.assertEqual(flat, octosurf.Parameters(**{group: {name: value}}), name)
        self.assertFalse(octosurf.Parameters(align=False).align)

    def test_begin_maps_and_win_over_the_parameters(self):
        mapper = octosurf.Mapper(resolution=0.05, up=None, threads=2)
        self.assertEqual(mapper.map().parameters(), octosurf.Parameters(occupancy={"resolution": 0.05}, up=None))
        self.assertEqual(octosurf.Map(resolution=0.05).snapshot().resolution, 0.05)
        parameters = octosurf.Parameters(resolution=0.05, max_range=3)
        given = octosurf.Mapper(parameters, resolution=0.1).map().parameters().occupancy
        self.assertEqual((given.resolution, given.max_range), (0.1, 3))
        self.assertEqual(parameters.occupancy.resolution, 0.05)
        self.assertEqual(parameters.replaced(occupancy={"hit": 0.8}, resolution=0.2).occupancy.resolution, 0.2)

    def test_unknown_ones_name_the_likeliest(self):
        for call in (octosurf.Mapper, octosurf.Map, octosurf.Parameters):
            self.assertRaisesRegex(TypeError, "'resolutoin'; did you mean 'resolution'", call, resolutoin=0.05)
        self.assertRaisesRegex(octosurf.Error, "did you mean 'max_turn_rad'", octosurf.Biped.from_dict, {"max_turn": 1})


class Rows(unittest.TestCase):
    def test_go_in_and_come_out(self):
        (surface,) = mapped_floor().snapshot().surfaces
        uv = surface.polygons[0].outer
        points = surface.to_map(uv)
        self.assertEqual(points.shape, (len(uv), 3))
        in_map = (surface.T_map_surface @ np.c_[uv, np.zeros(len(uv)), np.ones(len(uv))].T).T[:, :3]
        np.testing.assert_allclose(points, in_map, atol=1e-12)
        np.testing.assert_allclose(surface.to_map([0.1, 0.2]), surface.to_map([[0.1, 0.2]])[0])
        self.assertRaises(octosurf.Error, surface.to_map, np.zeros((2, 3)))

    def test_columns_are_named(self):
        self.assertRaisesRegex(octosurf.Error, "points.T", octosurf.Scan, floor().T, np.eye(4))
        self.assertEqual(octosurf.Scan([[0, 0, 1], [0, 1, 1]], np.eye(4)).points.shape, (2, 3))
        self.assertRaisesRegex(octosurf.Error, r"give \(N, 2\)", octosurf.ContactShape.polygon, [[0, 1, 0], [0, 0, 1]])
        self.assertEqual(octosurf.ContactShape.polygon([[0, 0], [1, 0], [0, 1]]).outline.shape, (3, 2))


class MotionWithinAScan(unittest.TestCase):
    def test_is_undone(self):
        # 1 m/s along x: one place 5 m ahead, seen nearer and nearer.
        times = np.array([0, 0.05, 0.1])
        points = np.c_[5 - times, np.ones(3), np.zeros(3)]
        scan = octosurf.Scan(points, np.eye(4), stamp_s=100.0, sensor="lidar")
        poses = [at(0, 0, 0), at(0.1, 0, 0)]
        undone = scan.deskewed(times, [100.0, 100.1], poses)
        by_pairs = octosurf.deskew(scan, list(zip([100.0, 100.1], poses)), times_s=times)
        np.testing.assert_array_equal(by_pairs.points, undone.points)
        np.testing.assert_allclose(undone.points, [[5, 1, 0]] * 3, atol=1e-5)
        np.testing.assert_allclose(undone.origins, np.c_[times, np.zeros((3, 2))], atol=1e-5)
        self.assertEqual(len(undone.times_s), 0)
        self.assertEqual(len(scan.origins), 0)
        with self.assertRaisesRegex(octosurf.Error, "2 times for 3 readings"):
            scan.deskewed(times[:2], [100.0, 100.1], poses)


class WhichWayIsUp(unittest.TestCase):
    def map_of_y_up(self, **keywords):
        mapper = octosurf.Mapper(**keywords)
        pose = at(0, 1, 0)
        pose[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # the sensor's z is the map's y
        mapper.insert_points(floor(), pose)
        return mapper

    def test_is_the_maps_where_it_is_not_given(self):
        snapshot = self.map_of_y_up(up=[0, 1, 0]).snapshot()
        (surface,) = snapshot.surfaces
        np.testing.assert_array_equal(snapshot.up(), [0, 1, 0])
        self.assertAlmostEqual(surface.slope_rad(), 0, delta=0.01)
        self.assertAlmostEqual(surface.slope_rad([0, 0, 1]), np.pi / 2, delta=0.01)
        index = octosurf.SurfaceIndex(snapshot)
        for below in (index.below([0, 0.5, 0]), index.nearest([0, 0.5, 0], max_slope_rad=0.1)):
            self.assertAlmostEqual(below.distance, 0.5, delta=0.01)
        self.assertIsNone(index.below([0, 0.5, 0], up=[0, 0, 1]))
        self.assertAlmostEqual(float(np.nanmean(octosurf.height_grid(snapshot).elevation)), 0, delta=0.01)
        self.assertGreater(octosurf.contact_region(surface, octosurf.ContactShape.disc(0.05)).area_m2, 0.5)

    def test_is_estimated_where_the_parameters_leave_it_open(self):
        mapper = self.map_of_y_up(up=None)
        snapshot = mapper.snapshot()
        np.testing.assert_allclose(snapshot.up(), [0, 1, 0], atol=0.01)
        np.testing.assert_array_equal(snapshot.up(), octosurf.up_of(mapper.map()).direction)
        self.assertIsNotNone(octosurf.SurfaceIndex(snapshot).below([0, 0.5, 0]))
        (surface,) = snapshot.surfaces
        self.assertRaisesRegex(octosurf.Error, r"snapshot\.up\(\)", surface.slope_rad)
        self.assertAlmostEqual(surface.slope_rad(snapshot.up()), 0, delta=0.01)

    def test_is_z_as_ever(self):
        (surface,) = mapped_floor().snapshot().surfaces
        self.assertEqual(surface.slope_rad(), surface.slope_rad([0, 0, 1]))
