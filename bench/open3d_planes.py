"""Open3D's planar patches of voxels' centroids: open3d_planes.py XYZ VOXEL LEAST, a line of JSON for each setting."""
import itertools
import json
import sys
import time

import numpy as np
import open3d

NEIGHBOURS = open3d.geometry.KDTreeSearchParamKNN(12)  # of 12 and 24 what finds more

cloud, voxel, least = open3d.io.read_point_cloud(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
points = np.asarray(cloud.points)
for spread, coplanarity, outliers, leaf in itertools.product((10, 30, 60), (45, 75), (0.25, 0.75), (least // 2, least)):
    began = time.perf_counter()
    cloud.estimate_normals(NEIGHBOURS)
    patches = cloud.detect_planar_patches(spread, coplanarity, outliers, 0, leaf, NEIGHBOURS)
    ms = 1000 * (time.perf_counter() - began)
    # A patch lists no points, but is a box: a point within a voxel of some is of the one whose plane is nearest.
    nearest, patch_of = np.full(len(points), np.inf), np.full(len(points), -1)
    for k, patch in enumerate(patches):
        local = np.abs((points - patch.center) @ patch.R)
        height = np.where((local <= patch.extent / 2 + voxel).all(axis=1), local[:, 2], np.inf)
        patch_of[height < nearest] = k
        nearest = np.minimum(nearest, height)
    regions = [np.flatnonzero(patch_of == k).tolist() for k in range(len(patches))]
    print(json.dumps({"settings": f"{spread}°, {coplanarity}°, {outliers:.0%} outliers, leaves of {leaf}", "ms": ms,
                      "regions": [region for region in regions if len(region) >= least]}))
