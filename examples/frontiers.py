#!/usr/bin/env python3
"""Edges of a map's surfaces beyond which nothing has been seen: where to look next. frontiers.py MAP EDGES.json

Within three voxels of such an edge nothing stands on the plane, and the space behind it was seen neither free nor occupied.
Writes a list of {"surface", "edge": [[x, y, z], [x, y, z]]} in the map frame, metres, and prints the length of each surface's.
"""
import json
import sys

import numpy as np
import octosurf
from numpy.typing import NDArray

UNKNOWN, OCCUPIED = 0, 2


def is_frontier(octree: octosurf.OccupancyView, surface: octosurf.Surface, start: NDArray[np.float64],
                end: NDArray[np.float64], voxel: float) -> bool:
    """Of an edge from `start` to `end`, (2,) in the surface's frame, with the surface on its left."""
    length = max(float(np.linalg.norm(end - start)), 1e-9)
    outward = np.array([end[1] - start[1], start[0] - end[0]]) / length
    steps = voxel * np.arange(0, 3.5, 0.5)
    count = 1 + int(length / voxel)
    shares = (np.arange(count) + 0.5) / count

    def states(height: float) -> NDArray[np.uint8]:
        places = [np.append(start + share * (end - start) + step * outward, height) for share in shares for step in steps]
        T = surface.T_map_surface
        return octree.states(places @ T[:3, :3].T + T[:3, 3]).reshape(count, len(steps))

    wall = (states(2.5 * voxel) == OCCUPIED).any(axis=1)
    unseen = (states(-1.5 * voxel)[:, 1:] == UNKNOWN).all(axis=1)
    return bool(np.mean(unseen & ~wall) > 0.5)


def main() -> None:
    loaded = octosurf.load(sys.argv[1])
    octree, voxel = loaded.octree(), loaded.parameters().occupancy.resolution
    edges = []
    for surface in loaded.snapshot().surfaces:
        length = 0.0
        for polygon in surface.polygons:
            for ring in [polygon.outer, *polygon.holes]:
                for start, end in zip(ring, np.roll(ring, -1, axis=0)):
                    if is_frontier(octree, surface, start, end, voxel):
                        edge = [surface.to_map(start).tolist(), surface.to_map(end).tolist()]
                        edges.append({"surface": surface.id, "edge": edge})
                        length += float(np.linalg.norm(end - start))
        print(f"surface {surface.id}: {length:.2f} m of its edges end in unseen space")
    with open(sys.argv[2], "w") as file:
        json.dump(edges, file)


main()
