"""What planners that others wrote make of a map: examples/ over Coal, OMPL and Pinocchio."""

import json
import subprocess
import sys
import unittest

import numpy as np
import octosurf
import world

sys.path.append(str(world.SOURCE / "examples"))
import coal_body  # noqa: E402

OFFICE = world.SOURCE / "maps/office"


def run(name, *arguments):
    return subprocess.run([sys.executable, world.SOURCE / "examples" / name, *map(str, arguments)], capture_output=True, text=True)


def planned(file, **limits):
    """Steps in the office, from its floor up two steps."""
    robot = world.FOLDER / "robot.json"
    robot.write_text(json.dumps({"robot": "biped", **limits}))
    world.command("plan", OFFICE, "--from", -4.4, -0.43, 0.58, -133, "--to", -5.83, -1.99, 1.15, -133, "--robot", robot,
                  "-o", file, "--force")
    return json.loads(file.read_text())


class Planners(unittest.TestCase):
    def test_coal_meets_what_the_octree_holds(self):
        """Boxes at random: one that is 2 d clear of all meshes holds no voxel of a surface; one that meets a mesh, 2 d larger, does."""
        meshes, steps = world.FOLDER / "meshes.json", world.FOLDER / "steps.json"
        world.command("export", OFFICE, "--to", meshes, "--what", "meshes", "--as-mapped")
        surfaces, loaded = coal_body.Surfaces(meshes), octosurf.load(OFFICE)
        octree, d, rng = loaded.octree(), loaded.snapshot().resolution, np.random.default_rng(1)
        every = np.concatenate([surface.boundary for surface in loaded.snapshot().surfaces])
        counts = {True: 0, False: 0}
        for _ in range(2000):
            half, T = rng.uniform(0.05, 0.4, 3), np.eye(4)
            T[:3, 3] = middle = rng.uniform(every.min(axis=0), every.max(axis=0))
            distance = surfaces.distance(2 * half, T)
            if 0 < distance <= 2 * d:
                continue
            grown = half if distance > 0 else half + 2 * d
            held = (octree.occupied(middle - grown, middle + grown)["surface"] > 0).any()
            self.assertEqual(held, distance <= 0, (middle, half, distance))
            counts[bool(held)] += 1
        self.assertGreater(min(counts.values()), 200)

        plan = planned(steps)
        told = run("coal_body.py", meshes, steps)
        self.assertEqual((told.returncode, len(told.stdout.splitlines())), (0, len(plan["steps"]) + 1), told.stderr)
        for standing in plan["body"]:
            standing["at"][2] -= 0.6
        steps.write_text(json.dumps(plan))
        self.assertEqual(run("coal_body.py", meshes, steps).returncode, 1)

    def test_ompl_takes_the_stair(self):
        recording, stem = world.FOLDER / "storeys", world.FOLDER / "storeys-map"
        world.command("simulate", "storeys", "--frames", 160, "-o", recording)
        world.command("map", recording, "-o", stem, "--resolution", 0.04)
        loaded = octosurf.load(stem)
        snapshot = loaded.snapshot()
        (stair,) = octosurf.find_stairs(snapshot).stairs
        rules = octosurf.GroundRules(foot=octosurf.ContactShape.disc(0.3))
        ground, ends = octosurf.GroundView(snapshot, loaded.octree(), rules), []
        for storey in (stair.landing_below, stair.landing_above):
            places = [snapshot.find(storey).to_map(uv) for part in ground.region(storey).polygons for uv in part.outer]
            ends.append(max(places, key=lambda place: np.linalg.norm(place - stair.steps[0].edge[0])))
        ways = ["--from", *ends[0], "--to", *ends[1]]
        told = run("ompl_storeys.py", stem, *ways)
        self.assertEqual(told.returncode, 0, told.stderr)
        path = np.array([line.split() for line in told.stdout.splitlines()], float)
        np.testing.assert_allclose(path[[0, -1]], ends, atol=0.01)
        steps = np.diff(path, axis=0)
        self.assertLess(np.linalg.norm(steps[:, :2], axis=1).max(), 0.06)
        self.assertLess(np.abs(steps[:, 2]).max(), 1.5 * stair.riser.mean_m)
        index = octosurf.SurfaceIndex(snapshot)
        passed = {index.nearest(place).id for place in path}
        self.assertGreaterEqual(len(passed & set(stair.treads)), len(stair.treads) - 1, "one may be passed by between two places")

        low, high = (function([step.edge for step in stair.steps], axis=(0, 1)) for function in (np.min, np.max))
        world.command("clear", stem, "--box", *low + [0, 0, 0.1], *high - [0, 0, 0.3], "--force")
        self.assertIn("no path", run("ompl_storeys.py", stem, *ways, "--seconds", 5).stderr)

    def test_talos_reaches_steps_of_a_quarter_metre(self):
        steps = world.FOLDER / "talos.json"
        plan = planned(steps, max_forward_m=0.25, max_width_m=0.3)
        told = run("pinocchio_steps.py", steps)
        self.assertEqual(told.stdout, f"all {len(plan['steps'])} steps are within reach\n", told.stderr)
        plan["steps"][8]["T_map_foot"][11] += 0.8  # as high as a leg is long
        steps.write_text(json.dumps(plan))
        self.assertIn("step 9: no posture", run("pinocchio_steps.py", steps).stdout)
