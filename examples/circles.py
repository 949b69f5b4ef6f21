#!/usr/bin/env python3
"""The largest circle in each convex piece of a map's surfaces, of `octosurf export MAP --to surfaces.json --what convex`.

  circles.py surfaces.json CIRCLES.json [SMALLEST RADIUS]

Writes a list of {"surface", "center", "radius"}, the largest first: map frame, metres, a foot of that radius fits anywhere in it.
"""
import itertools
import json
import sys

import numpy as np


def incircle(A, b):
    """(u, v, r) of the largest r with A (u, v) + r <= b, for rows of unit length: the piece's Chebyshev centre.

    This linear programme of three unknowns has a solution where three of the inequalities are equations."""
    rows = np.c_[A, np.ones(len(A))]
    triples = np.array(list(itertools.combinations(range(len(A)), 3)))
    triples = triples[np.abs(np.linalg.det(rows[triples])) > 1e-9]
    solutions = np.linalg.solve(rows[triples], b[triples][..., np.newaxis])[..., 0]
    inside = (solutions @ rows.T <= b + 1e-9).all(axis=1)
    return max(solutions[inside], key=lambda solution: solution[2])


def main():
    with open(sys.argv[1]) as file:
        surfaces = json.load(file)["surfaces"]
    smallest = float(sys.argv[3]) if len(sys.argv) > 3 else 0.0
    circles = []
    for surface in surfaces:
        T = np.reshape(surface["T_map_surface"], (4, 4))
        for piece in surface["convex"]:
            u, v, radius = incircle(np.array(piece["A"]), np.array(piece["b"]))
            if radius >= smallest:
                center = T[:3] @ [u, v, 0, 1]
                circles.append({"surface": surface["id"], "center": center.tolist(), "radius": radius})
    circles.sort(key=lambda circle: -circle["radius"])
    with open(sys.argv[2], "w") as file:
        json.dump(circles, file)
    print(f"{sys.argv[2]}: {len(circles)} circles on {len({circle['surface'] for circle in circles})} surfaces")


main()
