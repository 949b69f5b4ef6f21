#!/usr/bin/env python3
"""Truth that we did not write: outside.py OPTIONS, as JSON, writes rows for bench.py, as octosurf_bench does.

MuJoCo holds scenes of boxes, moves some, and casts rays; `octosurf-lab simulate` gets the same boxes as a mesh. Both recordings, of
the same poses, are mapped. Scores are by lab/evaluation's definitions 0 to 6, of MuJoCo's geometry, on rasters; they share no code
with it, and stand beside its own.
"""

import itertools
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
BUILD, VENV = ROOT / "build/release", ROOT / "build/outside"
try:
    import mujoco
    import numpy as np
    from scipy import ndimage
except ImportError:
    if sys.prefix == str(VENV):
        raise
    peers = ROOT / "test/peers"
    made = subprocess.run(["/usr/bin/python3", "-B", peers / "environment.py", VENV, peers / "requirements-outside.txt"], check=False)
    if made.returncode != 0:
        sys.exit("MuJoCo cannot be had")
    os.execv(VENV / "bin/python", [VENV / "bin/python", *sys.argv])
sys.path.insert(0, str(BUILD / "python"))
import octosurf  # noqa: E402

CELL, D = 0.01, 0.02  # m: of rasters, of maps
TOLERANCE, GAP, LEAST, SHARE = 0.03, 0.08, 0.05, 0.8  # m, m, m², as lab/evaluation's
COVERS, SUPPORTS, ONE_PLANE = np.cos(np.radians([15, 30, 0.5]))


# Scenes: boxes (x0, y0, z0, x1, y1, z1[, degrees about y]), m; voids (x0, y0, x1, y1, z); m/s at first of those that move.

def stairs():
    up = [(1 + 0.29 * k, 0.8, 0, 2.74, 2.0, 0.17 * (k + 1)) for k in range(6)]
    down = [(3.74, 0.8, 0, 3.74 + 0.25 * (6 - k), 2.0, 0.17 * k) for k in range(1, 6)]
    return {"boxes": [(0, 0, -0.2, 6, 3, 0), *up, (2.74, 0.8, 0, 3.74, 2.0, 1.02), *down, (5.5, 0, 0, 5.6, 0.7, 1)],
            "stairs": {(6, 0.17, 0.29), (6, 0.17, 0.25)}}


def stones():
    tops = [0.0, 0.08, 0.16, 0.04, 0.12]
    boxes = [(0.55 * i, 0.55 * j, -0.5, 0.55 * i + 0.4, 0.55 * j + 0.4, tops[(2 * i + j) % 5]) for i in range(8) for j in range(5)]
    return {"boxes": [(-0.3, -0.3, -0.7, 5.2, 2.9, -0.6), *((*box, 0 if k % 3 else 8 * (-1) ** k) for k, box in enumerate(boxes))],
            "voids": [(0, 0.55 * j + 0.4, 4.25, 0.55 * j + 0.55, z) for j in range(4) for z in tops]}


def office():
    slabs = [(0, 0, 3, 4.5), (3.1, 0, 4.5, 4.5), (5.5, 0, 7, 4.5), (4.5, 0, 5.5, 1.5), (4.5, 3, 5.5, 4.5)]  # a slot, a stairwell
    walls = [(-0.12, -0.12, 7.12, 0), (-0.12, 4.5, 7.12, 4.62), (-0.12, 0, 0, 4.5), (7, 0, 7.12, 4.5)]
    tables = [(0.4, 0.5, 1.8, 1.2), (3.4, 3.5, 4.4, 4.2), (5.7, 0.3, 6.7, 1.0)]
    legs = [(x, y, 0, x + 0.06, y + 0.06, 0.7) for a, b, c, d in tables for x in (a + 0.04, c - 0.1) for y in (b + 0.04, d - 0.1)]
    things = [(2.3, 0.4, 0, 2.7, 0.8, 0.4), (3.3, 1.0, 0, 3.9, 1.3, 0.25), (0.5, 3, 0, 1.1, 3.6, 0.5), (5.9, 3.4, 0, 6.5, 3.9, 0.3),
              (0.7, 0.7, 0.74, 1.0, 1.0, 0.94), (5.8, 1.9, 0, 6.8, 2.2, 0.9), (2.5, 3.3, 0, 2.8, 4.1, 0.12), (2.0, 2.6, 0, 2.1, 4.5, 1.1)]
    return {"boxes": [(0, 0, -1.4, 7, 4.5, -1.2), *legs, *things, *((a, b, -0.2, c, d, 0) for a, b, c, d in slabs),
                      *((a, b, -1.2, c, d, 1.1) for a, b, c, d in walls), *((a, b, 0.7, c, d, 0.74) for a, b, c, d in tables)],
            "voids": [(3, 0, 3.1, 4.5, 0), (4.5, 1.5, 5.5, 3, 0)]}


def moving():
    still = [(0, 0, -0.2, 5, 3, 0), (0, 2.9, 0, 5, 3, 0.8), (2, 1.9, 0, 2.9, 2.5, 0.5)]
    free = {(0.5, 0.5, 0.001, 0.9, 0.9, 0.301): (2.5, 0.4), (3.5, 0.6, 0.001, 4.0, 1.1, 0.401): (-0.4, 2.2), (2.2, 2, 0.9, 2.5, 2.3, 1.2): (0, 0)}
    return {"boxes": still + [*free], "speeds": dict(enumerate(free.values(), len(still))), "laps": 2}


class World:
    """MuJoCo's geoms in the scene's frame."""

    def __init__(self, scene):
        bodies, speeds = "", scene.get("speeds", {})
        for k, (x0, y0, z0, x1, y1, z1, *tilt) in enumerate(scene["boxes"]):
            bodies += (f'<body pos="{(x0 + x1) / 2} {(y0 + y1) / 2} {(z0 + z1) / 2}" euler="0 {tilt[0] if tilt else 0} 0">'
                       f'{"<freejoint/>" if k in speeds else ""}<geom type="box" friction="0.4" '
                       f'size="{(x1 - x0) / 2} {(y1 - y0) / 2} {(z1 - z0) / 2}"/></body>')
        self.model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
        self.data, self.speeds = mujoco.MjData(self.model), np.array([(*speed, 0, 0, 0, 0) for speed in speeds.values()]).ravel()
        self.at(0)

    def at(self, seconds):
        mujoco.mj_resetData(self.model, self.data)
        self.data.qvel[:] = self.speeds
        for _ in range(int(seconds / self.model.opt.timestep)):
            mujoco.mj_step(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        self.place, self.turn, self.half = self.data.geom_xpos, self.data.geom_xmat.reshape(-1, 3, 3), self.model.geom_size
        signs = np.array(np.meshgrid(*[(-1, 1)] * 3, indexing="ij")).reshape(3, -1).T
        self.corners = self.place[:, None] + np.einsum("gij,gkj->gki", self.turn, signs * self.half[:, None])

    def obj(self):
        """A mesh of all; corners in binary order."""
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return "".join([*("v {!r} {!r} {!r}\n".format(*corner) for corner in self.corners.reshape(-1, 3).tolist()),
                        *("f {} {} {} {}\n".format(*(8 * g + k + 1 for k in quad)) for g in range(len(self.half)) for quad in quads)])

    def depth_in(self, points, g):
        """m inside of a geom's nearest side; negative outside."""
        return (self.half[g] - np.abs((points - self.place[g]) @ self.turn[g])).min(axis=-1)

    def solid(self, points):
        return np.any([self.depth_in(points, g) > 0 for g in range(len(self.half))], axis=0)

    def cast(self, T, rays, reach):
        """From a pose: what multiple of each ray is met (0: nothing), and which side of which geom."""
        lengths, n = np.linalg.norm(rays, axis=1), len(rays)
        geoms, away, normals = np.zeros(n, np.int32), np.zeros(n), np.zeros(3 * n)
        mujoco.mj_multiRay(self.model, self.data, T[:3, 3].copy(), (rays / lengths[:, None] @ T[:3, :3].T).ravel(), None, 1, -1, geoms, away,
                           normals, n, reach)
        local = np.einsum("nji,nj->ni", self.turn[geoms], normals.reshape(-1, 3))
        axis = np.abs(local).argmax(axis=1)
        return np.maximum(away, 0) / lengths, geoms, 2 * axis + (local[np.arange(n), axis] > 0)


class Raster:
    """Cells of a plane about some of its points."""

    def __init__(self, axes, origin, points):
        self.axes, self.origin, self.normal = axes, origin, np.cross(*axes)
        flat = (points - origin) @ axes.T / CELL
        self.low = np.floor(flat.min(axis=0)).astype(int) - 8
        self.shape = tuple(np.ceil(flat.max(axis=0)).astype(int) + 8 - self.low)

    def points(self, cells):
        return self.origin + (cells + self.low + 0.5) * CELL @ self.axes

    def find(self, points):
        """Which are within the tolerance of the plane, and in what cells."""
        cells = np.floor((points - self.origin) @ self.axes.T / CELL).astype(int) - self.low
        inside = ((cells >= 0) & (cells < self.shape)).all(axis=1) & (np.abs((points - self.origin) @ self.normal) <= TOLERANCE)
        return inside, *np.where(inside[:, None], cells, 0).T


def true_planes(world):
    """Rasters with `away`, cells to what is solid behind and free before, and `part`, what hangs together; and that of each geom's side."""
    found, of_side, planes = [], [], []
    for corners, turn in zip(world.corners, world.turn):
        for side in range(6):
            normal = turn[:, side // 2] * (1 if side % 2 else -1)
            own = corners[corners @ normal > (corners @ normal).max() - 1e-6]
            same = (k for k, (n, points) in enumerate(found) if n @ normal > ONE_PLANE and abs((points[0] - own[0]) @ n) < D / 4)
            of_side.append(k := next(same, len(found)))
            found[k:k + 1] = [(found[k][0], [*found[k][1], *own]) if k < len(found) else (normal, [*own])]
    for normal, points in found:
        u = np.cross(normal, [0, 1, 0] if abs(normal[1]) < 0.7 else [0, 0, 1])
        u /= np.linalg.norm(u)
        planes.append(plane := Raster(np.stack([u, np.cross(normal, u)]), points[0], np.array(points)))
        cells = plane.points(np.indices(plane.shape).reshape(2, -1).T)
        true = (world.solid(cells - 1e-3 * normal) & ~world.solid(cells + 1e-3 * normal)).reshape(plane.shape)
        plane.away, nearest = ndimage.distance_transform_edt(~true, return_indices=True)
        plane.part, plane.seen = parts(true, GAP)[tuple(nearest)], np.zeros(plane.shape, bool)
    return planes, np.array(of_side)


def parts(mask, gap):
    """Numbers of what lies no farther apart."""
    return ndimage.label(ndimage.distance_transform_edt(~mask) <= gap / 2 / CELL)[0]


def raster_of(surface, T_scene_map):
    """With `mask` and `cells`, the points inside."""
    T = T_scene_map @ surface.T_map_surface
    rings = [ring for one in surface.polygons for ring in (one.outer, *one.holes)]
    raster = Raster(T[:3, :2].T, T[:3, 3], np.concatenate(rings) @ T[:3, :2].T + T[:3, 3])
    a, b = (np.concatenate([np.roll(ring, k, axis=0) for ring in rings]) / CELL - raster.low - 0.5 for k in (0, -1))
    raster.mask = np.zeros(raster.shape, bool)
    for k in range(raster.shape[1]):
        cut = (a[:, 1] > k) != (b[:, 1] > k)
        across = np.sort(a[cut, 0] + (k - a[cut, 1]) * (b[cut, 0] - a[cut, 0]) / (b[cut, 1] - a[cut, 1]))
        raster.mask[:, k] = np.searchsorted(across, np.arange(raster.shape[0])) % 2
    raster.cells = raster.points(np.argwhere(raster.mask))
    return raster


def supported(surface, planes, margin):
    """Of its cells, which have a true face under them, or no farther beside; how many lie on each."""
    holds, lying = np.zeros(len(surface.cells), bool), {}
    for p, plane in enumerate(planes):
        if surface.normal @ plane.normal >= SUPPORTS:
            near, i, j = plane.find(surface.cells)
            holds |= (here := near & (plane.away[i, j] <= margin / CELL))
            if surface.normal @ plane.normal >= COVERS:
                lying.update(((p, part), count) for part, count in enumerate(np.bincount(plane.part[i, j][here])))
    return holds, lying


def score(planes, mapped, ground, voids, apart):
    """By lab/evaluation's definitions 0 to 6; of the ground what is off by more than a cell, and of voids what is covered."""
    faces, pairs, unsafe = {}, [], 0
    for p, plane in enumerate(planes):
        seen = plane.seen & (plane.away == 0)
        pieces = parts(seen, apart)
        for part, piece in {*zip(plane.part[seen], pieces[seen])}:
            at = np.argwhere(seen & (plane.part == part) & (pieces == piece))
            if len(at) * CELL ** 2 >= LEAST:
                faces[p, part, piece] = plane.points(at)
    covered = {face: np.zeros(len(points), bool) for face, points in faces.items()}
    for s, surface in enumerate(mapped):
        holds, lying = supported(surface, planes, D)
        unsafe += (~holds).sum()
        wide = ndimage.distance_transform_edt(~surface.mask) <= D / 2 / CELL
        for face, points in faces.items():
            if surface.normal @ planes[face[0]].normal >= COVERS:
                near, i, j = surface.find(points)
                covered[face] |= (own := near & wide[i, j])
                pairs.append((min(own.mean(), lying.get(face[:2], 0) / max(len(surface.cells), 1)), face, s))
    correct, used = set(), set()
    for share, face, s in sorted(pairs, reverse=True):
        if share >= SHARE and face not in correct and s not in used:
            correct.add(face)
            used.add(s)
    level = [surface for surface in ground if surface.normal[2] > SUPPORTS]
    holes = [np.array([(x, y, z) for x in np.arange(x0, x1, CELL) + CELL / 2 for y in np.arange(y0, y1, CELL) + CELL / 2])
             for x0, y0, x1, y1, z in voids]
    filled = [sum(np.any([near & one.mask[i, j] for one in surfaces if one.normal[2] > SUPPORTS for near, i, j in [one.find(hole)]],
                         axis=0).sum() for hole in holes) for surfaces in (mapped, level)]
    areas = {"seen": sum(map(len, faces.values())), "covered": sum(map(np.sum, covered.values())), "area": sum(len(s.cells) for s in mapped),
             "unsafe": unsafe, "ground": sum(len(s.cells) for s in level), "off": sum((~supported(s, planes, CELL)[0]).sum() for s in level),
             "void": sum(map(len, holes)), "void_mapped": filled[0], "void_ground": filled[1]}
    return {"faces": len(faces), "correct": len(correct), **{f"{name}_m2": cells * CELL ** 2 for name, cells in areas.items()}}


def place_of(world, truth):
    """T_scene_map, of what the simulator has turned: its vertices fill the same box in both, and lie on sides of geoms."""
    rings = [(np.reshape(face["T_map_face"], (4, 4)), np.array(one["outer"])) for face in truth["faces"] for one in face["polygons"]]
    vertices = np.concatenate([ring @ T[:3, :2].T + T[:3, 3] for T, ring in rings])
    up, wall = (np.array(next(one["normal"] for one in truth["faces"] if one["name"] == name)) for name in ("terrain/level", "terrain/wall"))
    tried = []
    for x in (wall, np.cross(up, wall), -wall, -np.cross(up, wall)):
        T = np.eye(4)
        T[:3, :3] = x, np.cross(up, x), up
        T[:3, 3] = world.corners.min(axis=(0, 1)) - (vertices @ T[:3, :3].T).min(axis=0)
        moved = vertices @ T[:3, :3].T + T[:3, 3]
        tried.append((np.min([np.abs(world.depth_in(moved, g)) for g in range(len(world.half))], axis=0).max(), T))
    off, T = min(tried, key=lambda one: one[0])
    assert off < 1e-4, f"the two scenes differ by {off} m"
    return T


def lidar_rays():
    azimuth, elevation = np.radians(0.3 * np.arange(1200))[:, None], np.radians(-35 + 50 * np.arange(32) / 31)
    rays = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation) + 0 * azimuth
    return np.stack(rays, axis=-1).reshape(-1, 3)


def noise_of(sensor, t):
    return 0.008 + 0 * t if sensor == "spinning" else 0.0008 + 0.0016 * (t - 0.4) ** 2


def record(world, recording, sensor, seed, T_scene_map, planes, of_side):
    """Maps what MuJoCo sees from the recording's poses, marks it, and compares rays: how many, off by more than 6 sigma, sigma's ratio."""
    lidar, mapper, rng, off = sensor == "spinning", octosurf.Mapper(resolution=D), np.random.default_rng(seed), []
    least, most, near = (0.3, 50, 50) if lidar else (0.4, 5, 4)  # m
    v, u = np.mgrid[:480, :640]
    rays = lidar_rays() if lidar else np.stack([(u - 319.5) / 525, (v - 239.5) / 525, 1 + 0 * u], axis=-1).reshape(-1, 3)
    scans = list(octosurf.open_scans(recording))
    for k, scan in enumerate(scans):
        moves, T = len(world.speeds) > 0 and k < 25, T_scene_map @ scan.T_map_sensor
        if len(world.speeds):
            world.at(0.04 * k if moves else 5)  # they come to rest within a second
        else:
            points = scan.points.astype(float)
            t = np.linalg.norm(points, axis=1) if lidar else points[:, 2]
            off.append((world.cast(T, points, 60)[0] - 1) * t / noise_of(sensor, t))
        t, geoms, side = world.cast(T, rays, 60)
        t[(t < least) | (t > most)] = 0
        seen = (t > 0) & (t * np.linalg.norm(rays, axis=1) < near) & (not moves)
        for p in np.unique(of_side[6 * geoms + side][seen]):
            _, i, j = planes[p].find((t[:, None] * rays)[seen & (of_side[6 * geoms + side] == p)] @ T[:3, :3].T + T[:3, 3])
            planes[p].seen[i, j] = True
        t = np.where(t > 0, t + noise_of(sensor, t) * rng.normal(size=len(t)), 0)
        t[(t < least) | (t > most)] = 0
        if lidar:
            mapper.insert_points((t[:, None] * rays)[t > 0], scan.T_map_sensor, sensor="lidar")
        else:
            mapper.insert_depth(np.round(1000 * t).astype(np.uint16).reshape(480, 640), [525, 525, 319.5, 239.5], scan.T_map_sensor)
    for plane in planes:  # between readings: a lidar's cells are of 5 cm
        plane.seen = ndimage.maximum_filter(plane.seen, 5) if lidar else ndimage.binary_closing(plane.seen)
    off = np.abs(np.concatenate(off)) if off else np.zeros(1)
    return mapper, {"rays": len(off), "rays_off": int((off > 6).sum()), "noise": 1.4826 * np.median(off)}


def measure(sensor, name, seed, frames):
    with tempfile.TemporaryDirectory(prefix="octosurf-outside-") as folder:
        scene = globals()[name]()
        world, recording, truth = World(scene), f"{folder}/recording", f"{folder}/recording/truth.json"
        world.at(5)
        pathlib.Path(f"{folder}/scene.obj").write_text(world.obj())
        laboratory = BUILD / "bin/octosurf-lab"
        subprocess.run([laboratory, "simulate", "--mesh", f"{folder}/scene.obj", "--sensor", sensor, "--seed", str(seed), "--frames",
                        str(frames), "--laps", str(scene.get("laps", 1)), "-o", recording], check=True, capture_output=True)
        T_scene_map, (planes, of_side) = place_of(world, json.loads(pathlib.Path(truth).read_text())), true_planes(world)
        theirs, rays = record(world, recording, sensor, seed, T_scene_map, planes, of_side)
        ours = octosurf.Mapper(resolution=D)
        for scan in octosurf.open_scans(recording):
            ours.insert(scan)
        for by, mapper in (("octosurf-lab", ours), ("mujoco", theirs)):
            octosurf.save(mapper.map(), f"{folder}/{by}")
            subprocess.run([laboratory, "evaluate", f"{folder}/{by}", "--truth", truth, "--json", f"{folder}/{by}.json"], check=True,
                           capture_output=True)
            lab, snapshot = json.loads(pathlib.Path(f"{folder}/{by}.json").read_text()), mapper.snapshot()
            ground = octosurf.GroundView(snapshot, mapper.map().octree()).supported()
            rasters = [[raster_of(one, T_scene_map) for one in of.surfaces if one.polygons] for of in (snapshot, ground)]
            found = {(len(one.steps), one.riser.mean_m, one.tread.mean_m) for one in octosurf.find_stairs(snapshot).stairs}
            errors = [max(abs(riser - r), abs(tread - t)) for n, riser, tread in found for m, r, t in scene.get("stairs", ()) if m == n
                      and abs(tread - t) < 0.02]
            row = {"sensor": sensor, "scene": name, "seed": seed, "by": by, **rays,
                   **score(planes, *rasters, scene.get("voids", ()), GAP + (0.05 if sensor == "spinning" else CELL)),
                   "stairs": len(errors), "stairs_true": len(scene.get("stairs", ())), "stair_error_mm": 1000 * max(errors, default=0),
                   **{f"lab_{key}": lab[key] for key in ("faces", "correct", "unsafe_m2")}}
            print(json.dumps(row, default=float), flush=True)


if __name__ == "__main__":
    asked = json.loads(sys.argv[1])
    for case in itertools.product(asked["sensors"], asked["scenes"], asked["seeds"]):
        measure(*case, asked["frames"])
