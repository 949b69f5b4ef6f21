#!/usr/bin/env python3
"""A path on the ground of several storeys, by OMPL: ompl_storeys.py MAP --from X Y Z --to X Y Z [--seed N]

A state is the middle of a robot, 0 to 0.3 m above ground as GroundView has it for a disc of the robot's radius: supported, clear of
what stands beside and over it. Treads overlap in that layer, so that storeys are connected by their stairs and by nothing else.
Prints the places on the ground, map frame.
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
    def __init__(self, loaded: octosurf.Map, radius: float, height: float = 1.2) -> None:
        """`radius` of what stands on each place; nothing is as near to it from 0.25 m (legs step over that) to `height`."""
        snapshot, d = loaded.snapshot(), loaded.snapshot().resolution
        limits = octosurf.ContactLimits(max_slope_rad=0.5, edge_margin_m=d, clearance_m=height, obstacle_from_m=0.25,
                                        obstacle_margin_m=d, up=snapshot.up())
        self.view = octosurf.GroundView(snapshot, loaded.octree(), octosurf.GroundRules(foot=octosurf.ContactShape.disc(radius),
                                                                                        limits=limits))
        self.index = octosurf.SurfaceIndex(self.view.solid())
        every = np.concatenate([surface.boundary for surface in snapshot.surfaces])
        self.low, self.high = every.min(axis=0), every.max(axis=0)

    def under(self, place: NDArray[np.float64]) -> Optional[NDArray[np.float64]]:
        """The ground less than LAYER below, if the disc may stand there."""
        found = self.index.below(place, max_slope_rad=0.5)
        if found is None or place[2] - found.point[2] > LAYER or not self.view.foothold(found.id, found.point, 0).accepted:
            return None
        return np.array(found.point)


def path_between(ground: Ground, start: Any, goal: Any, seed: int = 1, seconds: float = 60) -> Optional[NDArray[np.float64]]:
    """Places on the ground, at most STEP apart along the way; None: none was found in that time, which proves nothing."""
    util.RNG.setSeed(seed)
    util.noOutputHandler()
    space = base.RealVectorStateSpace(3)
    bounds = base.RealVectorBounds(3)
    for axis in range(3):
        bounds.setLow(axis, float(ground.low[axis]))
        bounds.setHigh(axis, float(ground.high[axis]) + LAYER)
    space.setBounds(bounds)
    space.setLongestValidSegmentFraction(STEP / space.getMaximumExtent())
    setup = geometric.SimpleSetup(space)
    setup.setStateValidityChecker(lambda state: ground.under(np.array([state[0], state[1], state[2]])) is not None)
    ends = [space.allocState() for _ in range(2)]
    for state, place in zip(ends, (start, goal)):
        for axis in range(3):
            state[axis] = float(place[axis]) + (LAYER / 2 if axis == 2 else 0)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    if not setup.solve(seconds) or not setup.haveExactSolutionPath():
        return None
    setup.simplifySolution(1.0)
    path = setup.getSolutionPath()
    path.interpolate()
    places = [ground.under(np.array([state[0], state[1], state[2]])) for state in path.getStates()]
    return np.array([place for place in places if place is not None])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("map")
    arguments.add_argument("--from", dest="start", nargs=3, type=float, required=True)
    arguments.add_argument("--to", nargs=3, type=float, required=True)
    arguments.add_argument("--seed", type=int, default=1)
    chosen = arguments.parse_args()
    path = path_between(Ground(octosurf.load(chosen.map), 0.1), chosen.start, chosen.to, chosen.seed)
    if path is None:
        sys.exit("no path was found")
    np.savetxt(sys.stdout, path, "%.3f")


if __name__ == "__main__":
    main()
