"""Planar terrain as ocs2's and legged_control's perceptive planners read it: footholds, and heights without gaps."""

import numpy as np

from octosurf_ros import messages

STEEPEST_RAD = np.radians(80)  # readers divide by the normal's z
SMOOTH_M = 0.2  # edge of the squares that smooth_planar is the mean of


def without_gaps(heights):
    """Gaps (NaN) get the lowest height on their rim. Their cells in a row are a run; runs that touch are one gap."""
    padded = np.pad(heights, 1, constant_values=np.inf)
    gap = np.isnan(padded)
    run = np.cumsum(gap & ~np.roll(gap, 1, 1)).reshape(gap.shape) - 1
    both = gap[1:] & gap[:-1]
    one, other = run[1:][both], run[:-1][both]
    first = (np.diff(one, prepend=-1) != 0) | (np.diff(other, prepend=-1) != 0)
    one, other, of = one[first], other[first], np.arange(run[-1, -1] + 1)  # of: a run's gap, by its first run
    while np.any(of[one] != of[other]):
        np.minimum.at(of, np.maximum(of[one], of[other]), np.minimum(of[one], of[other]))
        of = of[of]
    lowest = np.full(len(of), np.inf, heights.dtype)
    for beside in (np.roll(padded, shift, axis) for shift in (1, -1) for axis in (0, 1)):
        rim = gap & ~np.isnan(beside)
        np.minimum.at(lowest, of[run[rim]], beside[rim])
    lowest[np.isinf(lowest)] = np.nan  # nothing but a gap
    padded[gap] = lowest[of[run[gap]]]
    return padded[1:-1, 1:-1]


def mean_over(heights, cells):
    """Means over squares of `cells` to an edge, less at the border."""
    reach = int(cells / 2)
    for _ in range(2):
        sums, at = np.pad(np.cumsum(heights, axis=0, dtype="f8"), ((1, 0), (0, 0))), np.arange(len(heights))
        low, high = np.maximum(at - reach, 0), np.minimum(at + reach + 1, len(at))
        heights = ((sums[high] - sums[low]) / (high - low)[:, None]).astype("f4").T
    return heights


def crossings(polygon, v):
    """Where the line of this v enters and leaves the polygon: u, ascending."""
    rings = polygon.outer, *polygon.holes
    starts, ends = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    crossed = (starts[:, 1] > v) != (ends[:, 1] > v)
    (u, v0), (u1, v1) = starts[crossed].T, ends[crossed].T
    return np.sort(u + (v - v0) / (v1 - v0) * (u1 - u))


def interior_point(polygon):
    """Strictly inside: an inset's corners may lie on the outline."""
    levels = np.unique(polygon.outer[:, 1])
    widest = np.argmax(np.diff(levels))
    v = levels[widest:widest + 2].mean()
    inside = crossings(polygon, v).reshape(-1, 2)
    return inside[np.argmax(inside[:, 1] - inside[:, 0])].mean(), v


def regions(surface):
    """PlanarRegion of each polygon with insets in it: tuples, by the fields' order, as ports name them otherwise."""
    def outlines(polygon):
        return (polygon.outer,), [(hole,) for hole in polygon.holes]

    insets = [(outlines(inset), interior_point(inset)) for inset in surface.insets]
    for polygon in surface.polygons:
        within = [inset for inset, (u, v) in insets if np.sum(crossings(polygon, v) < u) % 2]
        if within:
            box = *polygon.outer.min(axis=0), *polygon.outer.max(axis=0)
            yield messages.pose(surface.T_world_surface), box, outlines(polygon), within


def planar_terrain(surfaces, grid, frame, stamp_ns):
    """convex_plane_decomposition_msgs/PlanarTerrain, a tuple: without regions it is a terrain without footholds."""
    level = [one for one in surfaces if one.T_world_surface[2, 2] >= np.cos(STEEPEST_RAD)]
    elevation = without_gaps(grid.elevation)
    layers = {"elevation": elevation, "smooth_planar": mean_over(elevation, SMOOTH_M / grid.cell)}
    return ([region for one in level for region in regions(one)],
            messages.grid_map(layers, grid.center, grid.cell, frame, stamp_ns))
