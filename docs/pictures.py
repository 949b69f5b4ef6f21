#!/usr/bin/env python3
"""Draws docs/pictures: what each of the main parameters does, and the tutorial's. `./dev docs pictures [NAME…]`.

Each picture is the same recording mapped with several values, as `octosurf view --png` draws the maps.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
matplotlib.use("Agg")
import matplotlib.image
import matplotlib.pyplot as plt
from PIL import Image

OCTOSURF = os.environ.get("OCTOSURF", "octosurf")
OUT = pathlib.Path(__file__).resolve().parent / "pictures"
WIDTH, HEIGHT = 480, 360  # pixels of a panel

OFFICE = ("office", "--frames", "40")
STAIR = ("stairs", "--frames", "40")
NOISY = ("stairs", "--frames", "40", "--noise-scale", "3")
STONES = ("stones", "--frames", "40")
DRIFT = ("corridor", "--length", "12", "--laps", "2", "--frames", "48", "--drift-m", "0.1")

# name: recording, view, [(caption, flags of map)]
PICTURES = {
    "resolution": (OFFICE, (), [(f"--resolution {d}", ("--resolution", d)) for d in ("0.01", "0.02", "0.05")]),
    "surface_tolerance": (NOISY, (), [(f"--surface-tolerance {s}", ("--surface-tolerance", s))
                                          for s in ("0.004", "0.015", "0.1")]),
    "sensor_noise": (NOISY, (), [(f"--sensor-noise {s}", ("--sensor-noise", s)) for s in ("0.001", "0.005", "0.03")]),
    "max_hole_size": (STONES, (), [(f"--max-hole-size {h}", ("--max-hole-size", h)) for h in ("0.03", "0.08", "0.4")]),
    "min_surface_points": (OFFICE, (), [(f"--min-surface-points {n}", ("--min-surface-points", n))
                                          for n in ("10", "50", "1000")]),
    "min_surface_width": (OFFICE, (), [(f"--min-surface-width {w}", ("--min-surface-width", w))
                                         for w in ("0", "0.03", "0.25")]),
    "max_range": (STAIR, ("--from", "top"), [(f"--max-range {r}", ("--max-range", r)) for r in ("1.5", "2.5", "4")]),
    "align": (DRIFT, ("--from", "top"), [(f"--align {a}", ("--align", a, "--resolution", "0.03")) for a in ("auto", "off")]),
}


def octosurf(*arguments, program=OCTOSURF):
    subprocess.run([program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def recording(scene, folder):
    path = folder / "-".join(scene)
    if not path.exists():
        octosurf("simulate", *scene, "-o", path, program=f"{OCTOSURF}-lab")
    return path


def save(figure, name):
    """With 128 colours: a fifth of the size, and not to be seen."""
    raw = OUT / f"{name}.png"
    figure.savefig(raw, dpi=100)
    plt.close(figure)
    Image.open(raw).convert("RGB").quantize(128).save(raw, optimize=True)


def draw(name, folder):
    scene, view, panels = PICTURES[name]
    scans = recording(scene, folder)
    figure, axes = plt.subplots(1, len(panels), figsize=(WIDTH * len(panels) / 100, (HEIGHT + 30) / 100))
    figure.subplots_adjust(left=0, right=1, bottom=0, top=HEIGHT / (HEIGHT + 30), wspace=0.01)
    for panel, (caption, flags) in zip(axes, panels):
        octosurf("map", scans, "-o", folder / "map", "--force", *flags)
        octosurf("view", folder / "map", "--png", folder / "map.png", "--width", WIDTH, "--height", HEIGHT, "--force", *view)
        panel.imshow(matplotlib.image.imread(folder / "map.png"))
        panel.set_title(caption, family="monospace", fontsize=11)
        panel.axis("off")
    save(figure, name)


def tutorial(folder):
    """The map and the plan of docs/tutorial.md."""
    octosurf("map", recording(STAIR, folder), "-o", folder / "map", "--force")
    octosurf("view", folder / "map", "--png", folder / "map.png", "--width", 900, "--height", 600, "--force")
    octosurf("plan", folder / "map", "--from", -3.45, 0.74, 0.57, -133, "--to", -5.6, -1.55, 1.7, -133,
             "--png", folder / "plan.png", "--force")
    for name, box in (("map", (0, 0, 900, 600)), ("plan", (300, 330, 930, 780))):
        picture = Image.open(folder / f"{name}.png").convert("RGB").crop(box)
        picture.quantize(128).save(OUT / f"tutorial-{name}.png", optimize=True)


def main():
    OUT.mkdir(exist_ok=True)
    names = sys.argv[1:] or [*PICTURES, "tutorial"]
    with tempfile.TemporaryDirectory(prefix="octosurf-pictures-") as folder:
        for name in names:
            if name == "tutorial":
                tutorial(pathlib.Path(folder))
            else:
                draw(name, pathlib.Path(folder))
            print(name, flush=True)


main()
