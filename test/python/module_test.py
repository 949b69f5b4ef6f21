import gc
import json
import os
import pathlib
import pickle
import shutil
import threading
import time
import unittest

import numpy as np

import octosurf
import world
from world import ABOVE, at, floor, floor_mapper, mapped_floor


def reload(map):
    """Loading checks that octree, points and surfaces agree."""
    octosurf.save_map(map, world.FOLDER / "reload")
    return octosurf.load_map(world.FOLDER / "reload")


class Mapping(unittest.TestCase):
    def test_has_the_projects_version(self):
        self.assertIn(f"project(octosurf VERSION {octosurf.__version__} ", (world.SOURCE / "CMakeLists.txt").read_text())

    def test_a_floor_becomes_a_surface(self):
        mapper = mapped_floor()
        (surface,) = mapper.snapshot().surfaces
        self.assertGreater(surface.plane.normal[2], 0.999)
        self.assertAlmostEqual(surface.plane.offset, 0, delta=0.005)
        self.assertAlmostEqual(surface.area_m2, 1, delta=0.08)
        self.assertEqual(surface.covariance.shape, (3, 3))
        reload(mapper.map())

    def test_a_bt_of_somebody_elses_is_named_and_kept(self):
        theirs = world.FOLDER / "theirs.bt"
        theirs.write_bytes(b"an OctoMap")
        with self.assertWarnsRegex(UserWarning, "theirs.bt: .*theirs.edited.bt"):
            octosurf.save(mapped_floor().map(), world.FOLDER / "theirs")
        self.assertEqual((world.FOLDER / "theirs.edited.bt").read_bytes(), b"an OctoMap")

    def test_a_forked_child_does_not_free_the_map(self):
        lock = octosurf.MapLock(world.FOLDER / "forked")
        child = os.fork()
        if child == 0:
            del lock
            os._exit(0)
        os.waitpid(child, 0)
        self.assertTrue((world.FOLDER / "forked.lock").exists())
        del lock
        self.assertFalse((world.FOLDER / "forked.lock").exists())

    def test_points_of_any_layout_make_the_same_map(self):
        points = floor()
        wanted = self.saved(points.astype(np.float32))
        self.assertEqual(self.saved(points), wanted)
        self.assertEqual(self.saved(np.asfortranarray(points)), wanted)
        self.assertEqual(self.saved(points.reshape(100, 100, 3)), wanted)
        self.assertEqual(self.saved(np.repeat(points, 2, axis=0)[::2]), wanted)

    def saved(self, points):
        mapper = octosurf.Mapper()
        mapper.insert_points(points, ABOVE)
        return mapper.map().digest()

    def test_same_bytes_as_the_command_in_two_parts(self):
        command, whole = world.FOLDER / "command", world.FOLDER / "whole"
        world.command("map", world.recording(), "-o", command)
        scans = list(octosurf.open_scans(world.recording()))
        first = octosurf.Mapper()
        first.remember_scans()
        prepared = first.prepare(scans[0])
        self.assertEqual(prepared.scan.name, scans[0].name)
        first.insert(prepared)
        octosurf.save(self.mapped(first, scans[1:]).map(), whole)
        self.assertEqual(whole.with_suffix(".bt").read_bytes(), command.with_suffix(".bt").read_bytes())
        half = world.FOLDER / "half"
        octosurf.save(self.mapped(octosurf.Mapper(), scans[:3]).map(), half)
        second = octosurf.Mapper(octosurf.load(half), threads=2)
        waiting = [scan for scan in octosurf.open_scans(world.recording()) if not second.map().holds(scan)]
        self.assertEqual([scan.name for scan in waiting], [scan.name for scan in scans[3:]])
        octosurf.save(self.mapped(second, waiting).map(), half)
        self.assertEqual(octosurf.load(half).digest(), octosurf.load(whole).digest())
        self.assertTrue(all(octosurf.load(command).holds(scan) for scan in scans))

    def test_what_poses_mean_is_stated_as_to_the_command(self):
        right, inverse = octosurf.open_scans(world.recording()), octosurf.open_scans(world.recording(), pose_form="inverse")
        for one, other in zip(right, inverse):
            np.testing.assert_allclose(other.T_map_sensor, np.linalg.inv(one.T_map_sensor), atol=1e-9)
        with self.assertRaisesRegex(octosurf.Error, "has a pose already"):
            next(octosurf.open_scans(world.recording(), viewpoint=[0, 0, 1]))

    def mapped(self, mapper, scans):
        """By a Mapper that remembers them, as the command's does."""
        mapper.remember_scans()
        for scan in scans:
            mapper.insert(scan)
        return mapper

    def test_depth_in_units_and_metres_says_the_same(self):
        units = np.full((48, 64), 1500, np.uint16)
        units[0, :3] = (0, 65535, 2000)
        metres = units.astype(np.float32) / 1000
        units[1, :2] = 0
        metres[0, :2] = (np.nan, -1)
        metres[1, :2] = (1e-45, 9e-4)  # nearer than a millimetre
        camera = (50, 50, 31.5, 23.5)
        k = [[50, 0, 31.5], [0, 50, 23.5], [0, 0, 1]]
        of_units = octosurf.Scan.from_depth(units, camera, np.eye(4))
        of_metres = octosurf.Scan.from_depth(metres, k, np.eye(4))
        self.assertEqual(len(of_units), 48 * 64 - 4)
        np.testing.assert_allclose(of_units.points, of_metres.points, rtol=1e-6)
        u, v = 63, 47
        np.testing.assert_allclose(of_units.points[-1], [(u - 31.5) / 50 * 1.5, (v - 23.5) / 50 * 1.5, 1.5], rtol=1e-6)

    def test_scans_that_wait_go_in_together(self):
        scans = list(octosurf.open_scans(world.recording()))
        mapper = octosurf.Mapper()
        reports = mapper.insert_all(scans[:4])
        self.assertEqual(len(reports), 4)
        self.assertEqual(mapper.snapshot().revision, 1)
        self.assertEqual(mapper.map().size().points, sum(r.appeared for r in reports) - sum(r.vanished for r in reports))
        reload(mapper.map())
        self.assertEqual(mapper.insert_all([]), [])
        self.assertFalse(mapper.map().holds(scans[0]), "nothing is remembered unless it is wanted")


class Lifetimes(unittest.TestCase):
    def test_arrays_outlive_what_they_are_of(self):
        mapper = floor_mapper()
        surface = mapper.snapshot().surfaces[0]
        views = [surface.boundary, surface.polygons[0].outer, surface.plane.normal, surface.covariance]
        copies = [view.copy() for view in views]
        addresses = [view.__array_interface__["data"][0] for view in views]
        self.assertEqual(addresses[0], surface.boundary.__array_interface__["data"][0])
        del mapper, surface
        gc.collect()
        rubbish = [np.full(view.shape, 7.0) for view in views for _ in range(100)]
        for view, copy, address in zip(views, copies, addresses):
            np.testing.assert_array_equal(view, copy)
            self.assertEqual(view.__array_interface__["data"][0], address)
            self.assertFalse(view.flags.writeable)
        self.assertEqual(len(rubbish), 400)

    def test_a_snapshot_does_not_change(self):
        mapper = floor_mapper()
        before = mapper.snapshot()
        outline = before.surfaces[0].boundary.copy()
        mapper.insert_points(floor(1.5), ABOVE)
        np.testing.assert_array_equal(before.surfaces[0].boundary, outline)
        self.assertGreater(mapper.snapshot().surfaces[0].area_m2, 2)


class Threads(unittest.TestCase):
    def test_others_run_while_a_scan_is_inserted(self):
        scan = octosurf.Scan(floor(3, 0.004), ABOVE)
        counts, done = [], threading.Event()

        def count():
            while not done.wait(0):
                counts.append(time.perf_counter())

        counter = threading.Thread(target=count)
        counter.start()
        for _ in range(20):  # a count in the third quarter of an insertion, by the library's own clock
            total = octosurf.Mapper(resolution=0.005).insert(scan).total_ms / 1e3
            end = time.perf_counter()
            if seen := any(end - total / 2 < counted < end - total / 4 for counted in counts):
                break
        done.set()
        counter.join()
        self.assertTrue(seen, "no other thread ran in the middle of an insertion")

    def test_what_is_asked_of_the_map_waits_for_the_scan(self):
        mapper = octosurf.Mapper()
        scans = list(octosurf.open_scans(world.recording()))
        failures, done = [], threading.Event()

        def ask():
            while not done.is_set():
                try:
                    reload(mapper.map())
                except octosurf.Error as error:
                    failures.append(f"a map between two states was seen: {error}")
                mapper.map().at([0, 0, 0])

        reader = threading.Thread(target=ask)
        reader.start()
        for scan in scans[:4]:
            mapper.insert(scan)
        done.set()
        reader.join()
        self.assertEqual(failures, [])


class Errors(unittest.TestCase):
    def refused(self, kind, call, *arguments, **keywords):
        with self.assertRaises(octosurf.Error) as raised:
            call(*arguments, **keywords)
        self.assertEqual(raised.exception.kind, kind)
        self.assertIn(raised.exception.where, str(raised.exception))
        self.assertTrue(str(raised.exception).endswith(raised.exception.hint))
        return raised.exception

    def test_have_kind_place_and_hint(self):
        missing = self.refused("data", octosurf.load, "/nowhere/map")
        self.assertIn("/nowhere/map", missing.where)
        self.assertTrue(missing.hint)
        self.refused("usage", octosurf.Mapper, threads=0)
        self.refused("usage", octosurf.Parameters.from_dict, {"resolutoin": 1})
        self.refused("usage", octosurf.Scan, floor(), np.eye(4), sensor="lidr")
        self.refused("output", octosurf.save, octosurf.Map(), "/nowhere/map")
        for stem in (".", "..", str(world.FOLDER) + "/"):
            self.assertIn("names no map", str(self.refused("usage", octosurf.save, octosurf.Map(), stem)))
        self.refused("data", octosurf.open_scans, "/nowhere")

    def test_bad_input_is_refused_at_the_door(self):
        mapper = mapped_floor()
        revision = mapper.snapshot().revision
        for points, pose in ((np.zeros((5, 2)), np.eye(4)), (floor(), 2 * np.eye(4)),
                             (floor(), np.diag([2.0, 1, 1, 1])), (floor(), np.eye(3))):
            self.refused("data", mapper.insert_points, points, pose)
        for kind in (bool, complex, str):
            self.refused("data", mapper.insert_points, floor().astype(kind), np.eye(4))
            self.refused("data", octosurf.Scan, floor().astype(kind), np.eye(4))
        depth = np.ones((4, 4), np.uint16)
        self.refused("data", mapper.insert_depth, depth, (0, 1, 1, 1), np.eye(4))
        self.refused("data", mapper.insert_depth, depth.astype(np.int32), (1, 1, 1, 1), np.eye(4))
        self.refused("data", mapper.insert_depth, depth, (1, 1, 1, 1), np.eye(4), depth_scale=0)
        self.refused("usage", octosurf.Mapper, mapper.map())
        self.assertEqual(mapper.snapshot().revision, revision)
        self.assertRaises(TypeError, octosurf.ContactLimits, max_slope=1)
        self.assertRaisesRegex(TypeError, "by name: .*max_slope_rad", octosurf.ContactLimits, 1)

    def test_a_name_of_any_bytes(self):
        name = world.FOLDER / "\udcff"
        self.assertIn("\udcff", self.refused("data", octosurf.open_scans, name).where)
        for name in ("a\0b", "\0" * 40, "--" + "a" * 10**6):  # as a message may call a frame
            no_motion = self.refused("data", octosurf.pose_from_transform, [np.nan] * 3, [0, 0, 0, 1], where=name)
            self.assertIn("not finite; ", str(no_motion))

    def test_have_pythons_keywords_where_the_library_has_options_and_names(self):
        snapshot, file = mapped_floor().snapshot(), world.FOLDER / "a --force.json"  # whose name stays
        octosurf.export_surfaces(snapshot, file)
        exists = self.refused("usage", octosurf.export_surfaces, snapshot, file)
        self.assertEqual((exists.where, exists.hint), (str(file), "force=True overwrites it"))
        bare = world.FOLDER / "bare"
        shutil.copytree(world.recording(), bare, ignore=shutil.ignore_patterns("*pose*"))
        self.assertEqual(self.refused("data", octosurf.open_scans, bare).hint, "give poses=FILE")
        saved = self.refused("data", octosurf.open_scans, world.SOURCE / "maps/office.surfaces")
        self.assertEqual(saved.hint, "resume it by octosurf.load_map()")
        square = octosurf.Quadruped(foot=octosurf.ContactShape.rectangle(0.1, 0.1))
        self.assertIn("ContactShape.disc()", self.refused("usage", square.validate).hint)
        self.assertEqual(self.refused("usage", octosurf.Parameters().set, "no", "1").hint, "Parameters.names() has them")


class Settings(unittest.TestCase):
    def test_every_parameter_of_the_command_is_there(self):
        # Each, set by its text, changes what to_dict() says, and comes back from there.
        unlike = {"preserve_surfaces": "false", "detect_cylinders": "false", "align": "off", "up_x": "1", "up_y": "1",
                  "up_z": "0.5", "hit": "0.8", "miss": "0.3", "occupied": "0.6", "clamp_min": "0.2", "clamp_max": "0.9",
                  "min_surface_points": "77", "detection_budget": "9", "detector": "paper"}
        for name in octosurf.Parameters.names():
            changed = octosurf.Parameters()
            changed.set(name, unlike.get(name, "0.031"))
            self.assertNotEqual(changed, octosurf.Parameters(), name)
            again = octosurf.Parameters.from_dict(json.loads(json.dumps(changed.to_dict())))
            self.assertEqual(again, changed, name)
            self.assertEqual(again.get(name), changed.get(name))

    def test_the_papers_detector_maps_a_floor_and_explains(self):
        self.assertAlmostEqual(octosurf.Parameters.paper(0.05, sensor_noise=0.01).surface_tolerance(), 0.01 + 0.05 * 3 ** 0.5)
        parameters = octosurf.Parameters.paper()
        try:
            mapper = octosurf.Mapper(parameters)
        except octosurf.Error as error:
            self.assertIn("likelihood", str(error))
            self.skipTest("built without PCL")
        mapper.insert(octosurf.Scan(floor(), ABOVE))
        (surface,) = mapper.snapshot().surfaces
        np.testing.assert_allclose(surface.plane.normal, [0, 0, 1], atol=1e-3)
        self.assertAlmostEqual(surface.area_m2, 1, delta=0.05)
        self.assertEqual(octosurf.explain(mapper.map(), [0, 0, 0]).reason, "on_surface")

    def test_validation_and_pickling(self):
        parameters = octosurf.Parameters()
        parameters.surfaces.sensor_noise = 9
        with self.assertRaises(octosurf.Error) as raised:
            parameters.validate()
        self.assertEqual(raised.exception.where, "sensor_noise")
        for kind, field in ((octosurf.Biped, "max_up_m"), (octosurf.ContactLimits, "clearance_m")):
            for number in (float("nan"), float("inf"), np.float32("nan")):
                with self.assertRaises(octosurf.Error) as raised:
                    kind(**{field: number})
                self.assertEqual(raised.exception.where, field)
        for settings in (octosurf.Parameters.paper(), octosurf.Biped(max_up_m=0.1), octosurf.Quadruped(),
                         octosurf.ContactLimits(clearance_m=0.3)):
            self.assertEqual(pickle.loads(pickle.dumps(settings)), settings)


class Questions(unittest.TestCase):
    def setUp(self):
        self.mapper = mapped_floor()
        self.snapshot = self.mapper.snapshot()
        (self.surface,) = self.snapshot.surfaces

    def test_places(self):
        index = octosurf.SurfaceIndex(self.snapshot)
        for asked in (index.nearest([0, 0, 0.3]), index.below([0, 0, 0.3])):
            self.assertEqual(asked.id, self.surface.id)
            self.assertAlmostEqual(asked.distance, 0.3, delta=0.01)
        self.assertIsNone(index.nearest([0, 0, 0.3], within=0.1))
        self.assertIsNone(index.below([5, 5, 1]))
        hit = index.first_on_ray([0, 0, 2], [0, 0, -1])
        self.assertTrue(hit.front)
        self.assertEqual(index.inside(octosurf.ConvexSpace.box([-1, -1, -1], [1, 1, 1])), [self.surface.id])
        self.assertEqual(index.in_sphere([0, 0, 2], 1), [])

    def test_octree(self):
        octree = self.snapshot.octree
        voxels = octree.occupied([-1, -1, -0.1], [1, 1, 0.1])
        self.assertEqual(octree.count([-1, -1, -0.1], [1, 1, 0.1]).occupied, len(voxels))
        self.assertTrue((octree.states(voxels["center"]) == 2).all())
        self.assertEqual(octree.at([0, 0, 0.5]).state, "free")
        self.assertEqual(octree.first_on_way([0, 0, 0.5], [0, 0, -0.5]).state, "occupied")
        self.assertLess(np.linalg.norm(octree.nearest_occupied([0, 0, 0.1], 1).center - [0, 0, 0.1]), 0.13)
        again = octosurf.map_from_leaves(octree.leaves()).octree()
        self.assertEqual(again.changes(octree), [])
        self.assertTrue(again.changes(octosurf.Map().octree()))

    def test_contacts(self):
        foot = octosurf.ContactShape.rectangle(0.2, 0.1)
        region = octosurf.contact_region(self.surface, foot, 0.0)
        self.assertLess(region.area_m2, self.surface.area_m2)
        self.assertTrue(octosurf.foothold(self.surface, foot, [0, 0, 0], 0).accepted)
        self.assertEqual(octosurf.foothold(self.surface, foot, [0.5, 0, 0], 0).refused, "support")
        (piece, *_) = octosurf.convex_pieces(self.surface, region.polygons, 3)
        local = np.linalg.inv(self.surface.T_map_surface) @ np.c_[piece.vertices, np.ones(len(piece.vertices))].T
        self.assertTrue((piece.A @ local[:2] <= piece.b[:, None] + 1e-9).all())

    def test_plans(self):
        here, there = octosurf.Standing(at=[-0.2, 0, 0]), octosurf.Standing(at=[0.2, 0, 0])
        robot = octosurf.Biped()
        octree = self.mapper.map().octree()
        plan = octosurf.plan(self.snapshot, octree, robot, here, there)
        self.assertTrue(plan.found)
        of_before = octosurf.plan(self.snapshot, here, there, robot, octree=octree)
        self.assertEqual([step.to_dict() for step in of_before.steps], [step.to_dict() for step in plan.steps])
        self.assertEqual(json.loads(plan.to_json(robot))["format"], "octosurf-plan")
        away = octosurf.plan(self.snapshot, here, octosurf.Standing(at=[9, 0, 0]), robot)
        self.assertEqual((away.found, away.refusal.why), (False, "goal"))
        self.assertRaisesRegex(TypeError, "by name: at, yaw_rad", octosurf.Standing, [0, 0, 0], 0)
        self.assertRaisesRegex(TypeError, "Standing.at cannot be 'here': .*Map frame", octosurf.Standing, at="here")

    def test_alignment_and_explanations(self):
        scan = octosurf.Scan(floor(), ABOVE)
        localizer = octosurf.Localizer(self.mapper.map())
        found = localizer.localize(scan.with_pose(at(0, 0, 1.03)))
        self.assertEqual(found.outcome, "corrected")
        self.assertAlmostEqual(found.T_map_sensor[2, 3], 1, delta=0.003)
        again = localizer.localize(scan)
        self.assertAlmostEqual(again.T_map_sensor[2, 3], 1, delta=0.003)
        self.assertEqual((again.explained_share(), again.determined), (1, 3))
        self.assertEqual(octosurf.explain(self.mapper.map(), [0, 0, 0]).reason, "on_surface")

    def test_merging(self):
        other, whole = mapped_floor(), floor_mapper()
        report = whole.merge(other.map(), at(1.1, 0, 0))
        self.assertEqual(report.points_raw, other.map().size().points)
        reload(whole.map())
        self.assertRaises(octosurf.Error, whole.merge, whole.map())
        found = octosurf.align_maps(self.snapshot, other.map(), at(0, 0, 0.05))
        self.assertEqual(found.scan.outcome, "corrected")
        self.assertAlmostEqual(found.T_map_other[2, 3], 0, delta=0.003)

    def test_changes(self):
        self.assertEqual(octosurf.changes_since(self.snapshot, 0).appeared, [self.surface.id])

    def test_gaps(self):
        mapper = octosurf.Mapper()
        axis = np.arange(-0.5, 0.5, 0.01)
        points = world.grid(axis, axis, lambda x, y: np.where((np.abs(x - 0.2) < 0.045) & (np.abs(y) < 0.3), -0.4, 0.0))
        for height in (2.0, 2.5, 3.0):
            mapper.insert_points(points - [0.2, 0, height], at(0.2, 0, height))
        snapshot, octree = mapper.snapshot(), mapper.map().octree()
        surface = snapshot.find(octosurf.SurfaceIndex(snapshot).nearest([-0.3, 0, 0]).id)
        ground = octosurf.GroundView(snapshot, octree, octosurf.GroundRules(widest_unseen_m=1))
        found, gaps = ground.solid().find(surface.id), ground.gaps(surface.id)
        # No ray passes near the slot's ends: those that meet its bottom lean inwards.
        self.assertEqual({(gap.kind, gap.bridged) for gap in gaps}, {("void", False), ("unseen", False)})
        self.assertAlmostEqual(found.area_m2, 1 - 0.6 * 0.1, delta=0.02)
        sole = octosurf.ContactShape.rectangle(0.12, 0.06)
        self.assertAlmostEqual(octosurf.widest_unseen_of(sole), 0.015)
        stood = octosurf.foothold(found, sole, [0.2, 0, 0], 0, octosurf.ContactLimits(up=[0, 0, 1]))
        ground = octosurf.GroundView(snapshot, octree, octosurf.GroundRules(foot=sole))
        self.assertEqual(ground.ground_at(surface.id, [0.2, 0, 0]), "void")
        shares = ground.ground_under(surface.id, stood.T_map_contact)
        self.assertAlmostEqual(sum(shares.values()), 1)
        self.assertGreater(shares["void"], 0.4)
        ground = octosurf.GroundView(snapshot, octree)
        kept = ground.next(snapshot, octree)
        self.assertEqual(kept.solid().find(surface.id).area_m2, ground.solid().find(surface.id).area_m2)
        part = kept.region_about(surface.id, [-0.2, 0, 0], 0.05, yaw_rad=0)
        self.assertAlmostEqual(part.area_m2, 0.01, delta=1e-5)
        cleared = octosurf.Mapper()
        cleared.insert_points(world.floor(), world.ABOVE)
        report = cleared.clear(octosurf.SpacePart.box([-1, -1, -1], [0, 1, 1]))
        self.assertGreater(report.vanished, 500)
        self.assertAlmostEqual(cleared.snapshot().surfaces[0].area_m2, 0.5, delta=0.05)
        patch = octosurf.ground_patch(ground, at(-0.2, 0, 0.5), octosurf.PatchLayout([[0, 0], [0.4, 0]]))
        np.testing.assert_array_equal(ground.patch(at(-0.2, 0, 0.5), octosurf.PatchLayout([[0, 0], [0.4, 0]])).height, patch.height)
        self.assertEqual(patch.cell.tolist(), [1, 3])
        self.assertAlmostEqual(patch.height[0], -0.5, delta=0.005)
        self.assertEqual(octosurf.PatchLayout.grid(1.7, 1.1, 0.1).points.shape, (187, 2))

    def test_stairs(self):
        points = world.grid(np.arange(-0.5, 0.5, 0.01), np.arange(-0.8, 1.8, 0.01),
                            lambda x, y: 0.17 * np.clip(np.floor(y / 0.3 + 1e-9) + 1, 0, 4))
        mapper = octosurf.Mapper()
        mapper.insert_points(points - [0, -1, 3], at(0, -1, 3))
        snapshot = mapper.snapshot()
        found, none = octosurf.find_stairs(snapshot), octosurf.find_stairs(self.snapshot)
        (stair,) = found.stairs
        self.assertEqual((len(found), stair.kind, len(stair.steps), found.single_steps), (1, "straight", 4, []))
        self.assertAlmostEqual(stair.riser.mean_m, 0.17, delta=0.003)
        self.assertGreater(stair.steps[0].edge[1][0], stair.steps[0].edge[0][0])
        self.assertEqual(octosurf.nearest_stair(snapshot, found, [0, 0, 1]).id, stair.id)
        self.assertIsNone(octosurf.nearest_stair(self.snapshot, none, [0, 0, 1]))
        self.assertRaises(octosurf.Error, octosurf.find_stairs, snapshot, up=[0, 0, 0])
        ground, limits = octosurf.GroundView(snapshot, mapper.map().octree()), octosurf.StoreyLimits(radius_m=0.1)
        below, above = octosurf.find_storeys(ground, limits)
        self.assertAlmostEqual(above.height_m - below.height_m, 4 * 0.17, delta=0.01)
        self.assertEqual(below.cells.size, below.rows * below.columns)
        route = octosurf.find_route(ground, [below, above], limits)
        self.assertIn((0, True), {(edge.stair, edge.up) for edge in route.edges})

    def test_files(self):
        file = world.FOLDER / "floor.json"
        octosurf.export_surfaces(self.snapshot, file, force=True)
        self.assertEqual(json.loads(file.read_text())["surfaces"][0]["id"], self.surface.id)
        octosurf.export_surfaces(self.snapshot, world.FOLDER / "floor.ply", parts=["points"],
                                 points=self.mapper.map().points(), force=True)
        octosurf.render_png(self.snapshot, world.FOLDER / "floor.png", view="top", force=True)
        grid = octosurf.height_grid(self.snapshot)
        self.assertAlmostEqual(float(np.nanmean(grid.elevation)), 0, delta=0.01)
        for name in ("floor.ply", "floor.png"):
            self.assertGreater(pathlib.Path(world.FOLDER / name).stat().st_size, 100)
