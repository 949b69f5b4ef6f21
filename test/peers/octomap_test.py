"""OctoMap's own code, in Python, on octosurf's octrees: .bt and .ot there, changed, and back. test/octomap has their values."""
import unittest

import numpy as np
import pyoctomap

import octosurf
import world

OFFICE = world.SOURCE / "maps/office"


class PyOctoMap(unittest.TestCase):
    def test_a_bt_comes_back_to_the_byte(self):
        tree = pyoctomap.OcTree(0.1)
        self.assertTrue(tree.readBinary(str(OFFICE) + ".bt"))
        tree.writeBinary(str(world.FOLDER / "back.bt"))
        self.assertEqual((world.FOLDER / "back.bt").read_bytes(), OFFICE.with_suffix(".bt").read_bytes())

    def test_what_it_frees_is_no_ground_and_the_rest_keeps_its_ids(self):
        before = octosurf.load(OFFICE)
        floor = max(before.snapshot().surfaces, key=lambda surface: surface.area_m2)
        hole, inliers = 0.25, [point for point in before.points() if point["surface"] == floor.id]
        places = np.array([point["point"] for point in inliers])
        middle = places[np.argmin(np.linalg.norm(places - np.median(places, axis=0), axis=1))]
        freed = places[np.abs(places - middle).max(axis=1) < hole]
        tree = self.exported()
        for _ in range(20):
            for point in freed:
                tree.updateNode(point.tolist(), False)
        tree.updateInnerOccupancy()
        tree.writeBinary(str(world.FOLDER / "edited.bt"))
        tree.write(str(world.FOLDER / "edited.ot"))
        for ending in (".bt", ".ot"):
            with self.subTest(ending=ending):
                world.command("map", world.FOLDER / ("edited" + ending), "--resume", OFFICE, "-o", world.FOLDER / "taken",
                              "--force")
                after = octosurf.load(world.FOLDER / "taken").snapshot()
                self.assertEqual({surface.id for surface in before.snapshot().surfaces}, {s.id for s in after.surfaces})
                (found,) = [surface for surface in after.surfaces if surface.id == floor.id]
                self.assertAlmostEqual(floor.area_m2 - found.area_m2, (2 * hole) ** 2, delta=0.08)
                self.assertFalse(octosurf.SurfaceIndex(after).below(middle + [0, 0, 0.1]), middle)

    def exported(self):
        world.command("export", OFFICE, "--to", world.FOLDER / "office.ot", "--force")
        return pyoctomap.OcTree(0.1).read(str(world.FOLDER / "office.ot"))
