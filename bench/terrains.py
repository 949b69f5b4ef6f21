"""Writes terrains for `octosurf-lab simulate --mesh` (`--generated`), of the kinds that leggedrobotics' terrain-generator makes: all code is our own.

A terrain is axis-aligned boxes (whole cm, z up), its mesh the closed outer surface of their union. Levels are at least 4 cm apart.
"""

import itertools
import pathlib
import random
import struct


def steps(rng):
    """Square columns, none as high as one of its eight neighbours."""
    side, heights, choices = rng.randrange(35, 61, 5), {}, rng.sample(range(4, 45, 4), 8)
    for i, j in itertools.product(range(560 // side), range(500 // side)):
        heights[i, j] = rng.choice([z for z in choices if all(z != heights.get((i + a, j + b)) for a in (-1, 0, 1) for b in (-1, 0, 1))])
    return [(side * i, side * j, -20, side * (i + 1), side * (j + 1), height) for (i, j), height in heights.items()]


def stairs(rng):
    """Two flights on a floor, up to a platform and down again, the second along a wall at the rim."""
    boxes = [(0, 0, -20, 600, 520, 0)]
    for y0, y1 in [(60, 60 + rng.randint(150, 190)), (510 - rng.randint(150, 190), 510)]:
        count, riser, up, down, platform = (rng.randint(*limits) for limits in [(3, 5), (12, 20), (25, 35), (25, 35), (80, 120)])
        lengths = [up] * (count - 1) + [platform] + [down] * (count - 1)
        stops = list(itertools.accumulate(lengths, initial=(600 - sum(lengths)) // 2))
        boxes += [(a, y0, 0, b, y1, riser * min(k, len(stops) - k)) for k, (a, b) in enumerate(zip(stops, stops[1:]), 1)]
    return boxes + [(stops[0], 510, 0, stops[-1], 520, count * riser + rng.randint(60, 100))]


def gaps(rng):
    """Platforms, beams and stepping stones with voids of 10 to 35 cm between all of them; below is a floor or nothing."""
    platform, beam, stone = (50, 70, 120, 250), (90, 110, 20, 30), (25, 40, 25, 40)  # limits along x, limits along y
    parts, boxes, x, choices = [[platform, beam], [platform, stone, stone], [platform]], [], 0, rng.sample(range(4, 25, 4), 3)
    for shortest, longest, narrowest, widest in itertools.chain(*rng.sample(parts, 3), [platform]):
        x0, x, y = x, x + rng.randint(shortest, longest), 0
        while y + narrowest <= 500:
            y0, y = y, min(500, y + rng.randint(narrowest, widest))
            boxes.append((x0, y0, -60, x, y, rng.choice(choices)))
            y += rng.randint(10, 35)
        x += rng.randint(10, 35)
    return boxes + [(0, 0, -80, boxes[-1][3], 500, -60)] * rng.randrange(2)


def overhangs(rng):
    """A floor with tables on it and with ceilings and boxes that hang over it, at least 30 cm between any two."""
    boxes, things = [(0, 0, -20, 558, 498, 0)], [(70, 120, 60, 80, 8), (90, 130, 120, 200, 12), (40, 80, 60, 120, 40)] * 3
    for i, (shortest, longest, lowest, highest, thick) in enumerate(rng.sample(things, 9)):
        along, across, z = rng.randint(shortest, longest), rng.randint(shortest, longest), rng.randrange(lowest, highest + 1, 4)
        x, y = 186 * (i // 3) + rng.randint(15, 171 - along), 166 * (i % 3) + rng.randint(15, 151 - across)
        boxes.append((x, y, z, x + along, y + across, z + thick))
        if thick == 8:  # a table
            boxes += [(a, b, 0, a + 6, b + 6, z) for a in (x + 4, x + along - 10) for b in (y + 4, y + across - 10)]
    return boxes


def indoor(rng):
    """Three rooms with walls and doors: in one are steps up to a platform, another lies a riser higher."""
    t, top, door, riser, x, y = (rng.randint(*limits) for limits in [(8, 14), (100, 160), (80, 100), (12, 20), (250, 350), (200, 300)])
    boxes = [(0, 0, -20, 600, 520, 0), (0, 0, 0, 600, t, top), (0, 520 - t, 0, 600, 520, top), (0, t, 0, t, 520 - t, top)]
    for wall, low, high in [(x, t, y), (x, y, 520 - t), (600 - t, t, 520 - t)]:  # along y, with a door
        gap = rng.randint(low + 40, high - door - 40)
        boxes += [(wall, low, 0, wall + t, gap, top), (wall, gap + door, 0, wall + t, high, top)]
    gap, (low, high) = rng.randint(x + t + 30, 600 - t - door - 30), rng.choice([(t, y), (y + t, 520 - t)])
    boxes += [(x + t, y, 0, gap, y + t, top), (gap + door, y, 0, 600 - t, y + t, top), (x + t, low, 0, 600 - t, high, riser)]
    y0, end, tread = rng.choice([t, 370 - t]), t + rng.randint(90, 120), rng.randint(25, 35)
    return boxes + [(t if k == 3 else end + (2 - k) * tread, y0, 0, end + (3 - k) * tread, y0 + 150, k * riser) for k in (1, 2, 3)]


KINDS = {"steps": steps, "stairs": stairs, "gaps": gaps, "overhangs": overhangs, "indoor": indoor}


def boxes_of(kind, seed):
    """Boxes (x0, y0, z0, x1, y1, z1), cm; drawn anew until their levels are far enough apart."""
    rng = random.Random(f"{kind}/{seed}")
    while boxes := KINDS[kind](rng):
        heights = sorted({box[k] for box in boxes for k in (2, 5)})
        if all(b - a >= 4 for a, b in zip(heights, heights[1:])):
            return boxes


def surface(boxes):
    """Triangles between solid and empty cells, wound outwards, each after its normal; the cells lie between all the boxes' sides."""
    lines = [sorted({box[k] for box in boxes for k in (axis, axis + 3)}) for axis in range(3)]
    spans = ((range(lines[k].index(box[k]), lines[k].index(box[k + 3])) for k in range(3)) for box in boxes)
    solid = {cell for span in spans for cell in itertools.product(*span)}
    for cell, axis, side in itertools.product(sorted(solid), range(3), (0, 1)):
        normal = [(2 * side - 1) * (k == axis) for k in range(3)]
        if tuple(c + n for c, n in zip(cell, normal)) not in solid:
            quad = [{axis: side, (axis + 1) % 3: a, (axis + 2) % 3: b} for a, b in [(0, 0), (1, 0), (1, 1), (0, 1)][:: 2 * side - 1]]
            a, b, c, d = ([lines[k][cell[k] + corner[k]] / 100 for k in range(3)] for corner in quad)
            yield from ([*normal, *a, *b, *c], [*normal, *a, *c, *d])


def write(folder, seeds):
    """A binary STL (m) of each kind with each of `seeds`; their paths."""
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    names = {pathlib.Path(folder) / f"gen_{kind}_{seed}.stl": (kind, seed) for kind, seed in itertools.product(KINDS, seeds)}
    for path, name in names.items():
        triangles = [struct.pack("<12fH", *triangle, 0) for triangle in surface(boxes_of(*name))]
        path.write_bytes(struct.pack("<80xI", len(triangles)) + b"".join(triangles))
    return list(names)
