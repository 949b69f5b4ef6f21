#!/usr/bin/env python3
"""Planar regions of a map for IHMC's footstep planners.

  ihmc_regions.py MAP FOLDER

Writes header.txt and region<ID>_<INDEX> as PlanarRegionFileTools.java reads them (version 2): a region for each polygon of
a surface, whole, because these planners look for support themselves, in a world whose z is up. Rings are clockwise, in the
region's frame. There are no holes: the convex polygons, at most 20, leave them out, and some narrow corners.
"""
import pathlib
import sys
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

import octosurf

Array = npt.NDArray[np.float64]


def axis_angle(R: Array) -> tuple[Array, float]:
    """The turn's axis and angle; the axis is the eigenvector of eigenvalue 1, which (R - R^T) gives its sign."""
    twice_sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    values, vectors = np.linalg.eigh(R + R.T)
    axis = vectors[:, -1] if vectors[:, -1] @ twice_sine >= 0 else -vectors[:, -1]
    return axis, float(np.arctan2(np.linalg.norm(twice_sine), np.trace(R) - 1))


def clockwise(ring: Array) -> Array:
    x, y = ring.T
    return ring[::-1] if x @ np.roll(y, -1) > y @ np.roll(x, -1) else ring


def contains(polygon: octosurf.Polygon, point: Array) -> bool:
    """Even-odd rule over the outer ring and the holes."""
    inside = False
    for ring in [polygon.outer, *polygon.holes]:
        for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0)):
            inside ^= (ay <= point[1]) != (by <= point[1]) and ax + (point[1] - ay) / (by - ay) * (bx - ax) > point[0]
    return inside


def text(numbers: Iterable[float]) -> str:
    return ", ".join(repr(float(number)) for number in numbers)


def main() -> None:
    snapshot, folder = octosurf.load(sys.argv[1]).snapshot(), pathlib.Path(sys.argv[2])
    folder.mkdir()
    header = []
    for surface in snapshot.surfaces:
        simplified = surface.simplified()
        planned = octosurf.PlannerSurface(surface, pieces=octosurf.convex_pieces(surface, simplified), up=snapshot.up())
        R, origin = planned.T_world_surface[:3, :3], planned.T_world_surface[:3, 3]
        axis, angle = axis_angle(R)
        pieces = [((piece.vertices - origin) @ R)[:, :2] for piece in planned.pieces]
        for index, polygon in enumerate(simplified, 1):
            rings = [polygon.outer, *(piece for piece in pieces if contains(polygon, piece.mean(axis=0)))]
            sizes = [len(ring) for ring in rings]
            header.append(
                f"regionId: {surface.id}, index: {index}, origin: {text(origin)}, orientation: {text([*axis, angle])}, "
                f"concave hull size: {sizes[0]}, number of convex polygons: {len(sizes) - 1}, {sizes[1:]}\n")
            (folder / f"region{surface.id}_{index}").write_text(
                "".join(text(vertex) + "\n" for ring in rings for vertex in clockwise(ring)))
    (folder / "header.txt").write_text("".join(header))
    print(f"{folder}: {len(header)} regions")


main()
