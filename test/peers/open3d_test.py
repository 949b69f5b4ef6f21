"""Clouds and meshes as Open3D writes and reads them."""
import json
import unittest

import numpy as np
import open3d

import world
import write_bag

io = open3d.io


class Open3D(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scans, cls.poses = world.FOLDER / "scans", world.FOLDER / "scans/poses.txt"
        world.command("simulate", "room", "--sensor", "spinning", "--frames", 3, "-o", cls.scans)
        world.command("map", cls.scans, "-o", world.FOLDER / "map", "--resolution", 0.1, "--keep-scans", world.FOLDER / "kept")

    def test_clouds_that_it_writes_give_the_same_map(self):
        wanted = (world.FOLDER / "map.bt").read_bytes()
        for ending, options in [("pcd", {}), ("pcd", {"write_ascii": True}), ("pcd", {"compressed": True}), ("ply", {}),
                                ("ply", {"write_ascii": True})]:
            folder = world.FOLDER / "-".join(["clouds", ending, *options])
            folder.mkdir()
            for file in sorted(self.scans.glob("*.pcd")):
                points = open3d.utility.Vector3dVector(write_bag.read_pcd(file).astype(float))
                self.assertTrue(io.write_point_cloud(str(folder / file.with_suffix("." + ending).name),
                                                     open3d.geometry.PointCloud(points), **options))
            with self.subTest(folder=folder.name):
                world.command("map", folder, "--poses", self.poses, "-o", world.FOLDER / "same", "--resolution", 0.1, "--force")
                self.assertEqual((world.FOLDER / "same.bt").read_bytes(), wanted)

    def test_kept_scans_and_exported_points_are_read(self):
        for kept, scan in zip(sorted((world.FOLDER / "kept").glob("*.pcd")), sorted(self.scans.glob("*.pcd"))):
            found = np.asarray(io.read_point_cloud(str(kept), remove_nan_points=True).points)
            np.testing.assert_array_equal(found.astype(np.float32), write_bag.read_pcd(scan))
        points, surfaces = self.exported("points.ply", "points"), self.surfaces()
        cloud = open3d.t.io.read_point_cloud(points)
        self.assertEqual(len(cloud.point.positions), sum(surface["inliers"] for surface in surfaces))

    def test_exported_solids_are_closed(self):
        for name in ("solids.ply", "solids.glb"):
            mesh = io.read_triangle_mesh(self.exported(name, "meshes"))
            mesh.merge_close_vertices(1e-7)
            with self.subTest(name=name):
                self.assertTrue(mesh.is_edge_manifold(allow_boundary_edges=False))
                self.assertGreaterEqual(mesh.get_surface_area(), 2 * sum(surface["area_m2"] for surface in self.surfaces()))

    def surfaces(self):
        with open(self.exported("map.json", "polygons")) as file:
            return json.load(file)["surfaces"]

    def exported(self, name, what):
        world.command("export", world.FOLDER / "map", "--as-mapped", "--what", what, "--to", world.FOLDER / name, "--force")
        return str(world.FOLDER / name)
