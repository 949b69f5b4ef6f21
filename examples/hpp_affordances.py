#!/usr/bin/env python3
"""Support affordances for hpp-affordance, of `sl1m_pieces.py MAP pieces.json --foot 0.06`.

  hpp_affordances.py pieces.json FOLDER

Writes surface_<ID>_<NUMBER>.stl, binary, one for each convex piece, because hpp makes an affordance of an object and SL1M
takes convex ones. hpp joins faces whose vertices are within 3e-8 m: those of a piece are equal to the bit, those of two
surfaces are moved inward until they are 1 um apart.
"""
import collections
import itertools
import json
import pathlib
import sys

import numpy as np

GAP = 1e-6


def without_flat_corners(ring, least):
    """Without vertices that near to the line between their neighbours: as 32-bit floats they would tilt triangles."""
    i, seen = 0, 0
    while seen < len(ring) > 2:
        a, b, vertex = ring[i - 1], ring[(i + 1) % len(ring)], ring[i]
        if np.linalg.norm(np.cross(b - a, vertex - a)) < least * np.linalg.norm(b - a):
            ring = np.delete(ring, i, axis=0)
            i, seen = (i - 1) % len(ring), 0  # its neighbours have new neighbours: back to the one before
        else:
            i, seen = (i + 1) % len(ring), seen + 1
    return ring


class Places:
    """The vertices written so far, and of which surface."""

    def __init__(self):
        self.cells = collections.defaultdict(list)

    def taken(self, surface, vertex):
        cell = np.floor(vertex / GAP).astype(int)
        return any(other != surface and np.linalg.norm(place - vertex) < GAP
                   for step in itertools.product((-1, 0, 1), repeat=3)
                   for other, place in self.cells.get(tuple(cell + step), ()))

    def take(self, surface, vertex):
        self.cells[tuple(np.floor(vertex / GAP).astype(int))].append((surface, vertex))


def main():
    pieces, folder = json.loads(pathlib.Path(sys.argv[1]).read_text()), pathlib.Path(sys.argv[2])
    spacing = max(np.abs(piece["vertices"]).max() for piece in pieces) * np.finfo(np.float32).eps
    folder.mkdir()
    places, numbers = Places(), collections.Counter()
    for piece in pieces:
        surface = piece["id"]
        ring = without_flat_corners(np.array(piece["vertices"]), 100 * spacing)
        if len(ring) < 3:
            continue
        middle, corners = ring.mean(axis=0), []
        for vertex in ring:
            inward = (middle - vertex) / np.linalg.norm(middle - vertex)
            # A step that rounding to floats does not undo.
            steps = (vertex + k * (8 * spacing + GAP) * inward for k in itertools.count())
            rounded = (step.astype(np.float32).astype(float) for step in steps)
            corners.append(next(place for place in rounded if not places.taken(surface, place)))
            places.take(surface, corners[-1])
        triangles = np.zeros(len(corners) - 2, [("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
        triangles["normal"] = piece["normal"]
        triangles["vertices"] = [(corners[0], a, b) for a, b in zip(corners[1:], corners[2:])]
        numbers[surface] += 1
        (folder / f"surface_{surface}_{numbers[surface]}.stl").write_bytes(
            bytes(80) + np.uint32(len(triangles)).tobytes() + triangles.tobytes())
    print(f"{folder}: {sum(numbers.values())} convex pieces on {len(numbers)} surfaces")


main()
