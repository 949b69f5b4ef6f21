#!/usr/bin/env python3
"""A path on the ground of several storeys, by OMPL: ompl_storeys.py MAP --from X Y Z --to X Y Z [--seconds S]

A state is the middle of a robot, less than 0.3 m above the map's ground, voids left out, with no occupied voxel about its body. Treads
overlap in that layer, so that storeys are connected by stairs and by nothing else. Prints places on the ground, map frame.
"""
import argparse
import sys
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray
from ompl import base, geometric, util

import octosurf

LAYER = 0.3  # m: more than a riser
STEP = 0.05  # m: between states that are checked


class Ground:
    """Of a map whose z axis points up, for an upright body that clears steps of `step_m`."""

    def __init__(self, loaded: octosurf.Map, radius: float = 0.2, step_m: float = 0.35, height: float = 1.2) -> None:
        self.octree, snapshot = loaded.octree(), loaded.snapshot()
        self.index = octosurf.SurfaceIndex(octosurf.GroundView(snapshot, self.octree).solid())
        every = np.concatenate([surface.boundary for surface in snapshot.surfaces])
        self.low, self.high = every.min(axis=0), every.max(axis=0) + [0, 0, LAYER]
        self.body = np.array([[-radius, -radius, step_m], [radius, radius, height]])

    def under(self, place: Any) -> Optional[NDArray[np.float64]]:
        """The ground less than LAYER below, if there is room for the body over it."""
        found = self.index.below([place[0], place[1], place[2]], max_slope_rad=0.5)
        if found is None or place[2] - found.point[2] > LAYER or self.octree.count(*(found.point + self.body)).occupied:
            return None
        return np.array(found.point)


def path_between(ground: Ground, start: Any, goal: Any, seconds: float, seed: int = 1) -> Optional[NDArray[np.float64]]:
    """Places on the ground, at most STEP apart; None: none was found in that time, which proves nothing."""
    util.RNG.setSeed(seed)
    util.noOutputHandler()
    space = base.RealVectorStateSpace(3)
    bounds = base.RealVectorBounds(3)
    for axis in range(3):
        bounds.setLow(axis, float(ground.low[axis]))
        bounds.setHigh(axis, float(ground.high[axis]))
    space.setBounds(bounds)
    space.setLongestValidSegmentFraction(STEP / space.getMaximumExtent())
    setup = geometric.SimpleSetup(space)
    setup.setStateValidityChecker(lambda state: ground.under(state) is not None)
    ends = [space.allocState() for _ in range(2)]
    for state, place in zip(ends, (start, goal)):
        for axis in range(3):
            state[axis] = float(place[axis]) + (LAYER / 2 if axis == 2 else 0)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    if not setup.solve(seconds) or not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    path.interpolate()
    return np.array([ground.under(state) for state in path.getStates()])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("map")
    arguments.add_argument("--from", dest="start", nargs=3, type=float, required=True)
    arguments.add_argument("--to", nargs=3, type=float, required=True)
    arguments.add_argument("--seconds", type=float, default=30)
    chosen = arguments.parse_args()
    path = path_between(Ground(octosurf.load(chosen.map)), chosen.start, chosen.to, chosen.seconds)
    if path is None:
        sys.exit("no path was found")
    np.savetxt(sys.stdout, path, "%.3f")


if __name__ == "__main__":
    main()
