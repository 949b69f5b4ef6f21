#!/usr/bin/env python3
"""Convex pieces of where a foot's middle may be, for SL1M and other mixed-integer planners.

  sl1m_pieces.py MAP PIECES.json --foot 0.22x0.11 [--yaw DEGREES]      or --foot RADIUS

A list of {"id", "vertices", "normal", "A", "b"}, in the map turned so that up is +z. Vertices are counter-clockwise seen
from the normal's tip, and begin where three in a row make the largest triangle, of which SL1M computes the normal. A p <= b
holds in the piece, rows of unit length: one for each edge, from the first vertex on, then the normal and its opposite.
"""
import argparse
import json
import math
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

import octosurf


def sl1m_piece(identity: int, normal: NDArray[np.float64], vertices: NDArray[np.float64]) -> dict[str, Any]:
    sides = np.roll(vertices, -1, axis=0) - vertices
    doubled_areas = np.linalg.norm(np.cross(sides, np.roll(sides, -1, axis=0)), axis=1)
    ring = np.roll(vertices, -int(doubled_areas.argmax()), axis=0)
    outward = np.cross(np.roll(ring, -1, axis=0) - ring, normal)
    A = np.vstack([outward / np.linalg.norm(outward, axis=1, keepdims=True), normal, -normal])
    return {"id": identity, "vertices": ring.tolist(), "normal": normal.tolist(), "A": A.tolist(),
            "b": (A @ ring.T).max(axis=1).tolist()}


def sl1m_pieces(loaded: octosurf.Map, foot: octosurf.ContactShape, yaw_rad: Optional[float] = None, most: int = 12,
                **limits: Any) -> list[dict[str, Any]]:
    """At most `most` pieces a surface, the largest first; `limits` are ContactLimits' fields."""
    octree, up = loaded.octree(), loaded.snapshot().up()
    snapshot = octosurf.GroundView(loaded.snapshot(), octree, octosurf.GroundRules(foot=foot)).solid()
    within, pieces = octosurf.ContactLimits(up=up, **limits), list[dict[str, Any]]()
    for surface in snapshot.surfaces:
        region = octosurf.contact_region(surface, foot, yaw_rad, within, octree=octree, others=snapshot)
        planned = octosurf.PlannerSurface(surface, region, octosurf.convex_pieces(surface, region.polygons, most), up)
        pieces += [sl1m_piece(surface.id, planned.T_world_surface[:3, 2], piece.vertices) for piece in planned.pieces]
    return pieces


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("map")
    arguments.add_argument("pieces")
    arguments.add_argument("--foot", required=True)
    arguments.add_argument("--yaw", type=float)
    chosen = arguments.parse_args()
    sizes = [float(size) for size in chosen.foot.split("x")]
    foot = octosurf.ContactShape.rectangle(*sizes) if len(sizes) == 2 else octosurf.ContactShape.disc(*sizes)
    pieces = sl1m_pieces(octosurf.load(chosen.map), foot, None if chosen.yaw is None else math.radians(chosen.yaw))
    with open(chosen.pieces, "w") as file:
        json.dump(pieces, file)
    print(f"{chosen.pieces}: {len(pieces)} convex pieces on {len({piece['id'] for piece in pieces})} surfaces")


if __name__ == "__main__":
    main()
