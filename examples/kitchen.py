# %% [markdown]
# # From depth images to footsteps
# Maps a recording (a folder as 7-Scenes has them, or anything that `octosurf map` reads), draws the surfaces seen from
# above and plans steps between two places on the largest floor. Without a recording, `octosurf-lab simulate` makes one:
#
#     python3 examples/kitchen.py                         a simulated office
#     python3 examples/kitchen.py kitchen --picture kitchen.png

# %%
import argparse
import subprocess
import tempfile

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Polygon

import octosurf

arguments = argparse.ArgumentParser()
arguments.add_argument("recording", nargs="?", help="folder of posed scans; default: a simulated office")
arguments.add_argument("--picture", help="file to draw to; default: a window")
chosen = arguments.parse_args()
recording = chosen.recording
if not recording:
    recording = tempfile.mkdtemp() + "/office"
    subprocess.run(["octosurf-lab", "simulate", "office", "--seed", "1", "-o", recording], check=True)

# %% Mapping: scan by scan, as on a robot. With up=None it is found from the surfaces: a camera's frame may lie anyhow.
mapper = octosurf.Mapper(up=None)
for scan in octosurf.open_scans(recording):
    report = mapper.insert(scan)
octosurf_map = mapper.map()
snapshot = octosurf_map.snapshot()
up = snapshot.up()
area = sum(surface.area_m2 for surface in snapshot.surfaces)
print(f"{octosurf_map.size().scans} scans, {len(snapshot.surfaces)} surfaces, {area:.1f} m2")
print(f"the last scan took {report.total_ms:.0f} ms")

# %% Where feet may stand: the largest surface that is level, and on it the two places that lie farthest apart.
robot = octosurf.Biped()
robot.contact.up = up
level = [surface for surface in snapshot.surfaces if surface.slope_rad(up) < robot.contact.max_slope_rad]
floor = max(level, key=lambda surface: surface.area_m2)
octree = octosurf_map.octree()
region = octosurf.contact_region(floor, robot.foot, limits=robot.contact, octree=octree)
places = np.concatenate([floor.to_map(part.outer) for part in region.polygons] or [np.empty((0, 3))])

# %% A plan, and a check of it without the planner's tables.
plan = None
if len(places) > 1:
    distances = np.linalg.norm(places[:, None] - places[None], axis=-1)
    start, goal = places[list(np.unravel_index(distances.argmax(), distances.shape))]
    planner = octosurf.FootstepPlanner(snapshot, octree, robot)
    plan = planner.plan(octosurf.Standing(at=start), octosurf.Standing(at=goal))
    if plan.refusal:
        print(f"no plan: {plan.refusal.sentence}")
    else:
        print(f"{len(plan.steps)} steps, cost {plan.cost:.1f}")
else:
    print(f"no plan: nowhere to stand, because of {', '.join(region.refused)}")

# %% Seen from above: two axes across `up`.
across = np.cross(up, [0, 0, 1] if abs(up[2]) < 0.9 else [1, 0, 0])
across /= np.linalg.norm(across)
axes_of_picture = np.stack([across, np.cross(up, across)])
figure, axes = plt.subplots(figsize=(8, 8))
for surface in sorted(snapshot.surfaces, key=lambda one: float(np.mean(one.boundary @ up))):
    for polygon in surface.polygons:
        ring = surface.to_map(polygon.outer)
        axes.add_patch(Polygon(ring @ axes_of_picture.T, facecolor=surface.color, edgecolor="black", linewidth=0.3))
if plan:
    for step in plan.steps:
        sole = np.c_[robot.foot.outline, np.zeros(len(robot.foot.outline)), np.ones(len(robot.foot.outline))]
        outline = (sole @ step.T_map_foot.T)[:, :3]
        side = "red" if step.foot == "left" else "green"
        axes.add_patch(Polygon(outline @ axes_of_picture.T, facecolor=side, zorder=3))
axes.set_aspect("equal")
axes.autoscale_view()
axes.set_xlabel("m")
axes.set_title(f"{len(snapshot.surfaces)} surfaces from above")
if chosen.picture:
    figure.savefig(chosen.picture, dpi=150)
else:
    plt.show()
