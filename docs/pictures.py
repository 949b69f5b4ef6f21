#!/usr/bin/env python3
"""Draws docs/pictures, all that README and docs show, and maps/office with its page. `./dev docs pictures [NAME…]`.

digests.json says of which maps each was drawn: surfaces, their m², metres of outline. (Bytes would not do: their last
digits differ from processor to processor.)
"""
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
OCTOSURF = os.environ.get("OCTOSURF", "octosurf")
OUT = ROOT / "docs/pictures"
DIGESTS = OUT / "digests.json"
SIZE = (480, 360)  # of a panel
NEAR = 0.005  # by which share a figure may differ, as another processor rounds otherwise

DEMO = ("office", "--seed", "1")
OFFICE = ("office", "--frames", "10")
FLIGHT = ("stairs", "--frames", "16", "--seed", "7")  # seen from its foot
STONES = ("stones", "--frames", "12")
WALK = ("stairs", "--frames", "40")  # the tutorial's
DRIFT = ("corridor", "--length", "8", "--laps", "2", "--frames", "32", "--drift-m", "0.1")
KITCHEN = pathlib.Path(os.environ.get("OCTOSURF_DATA", ROOT.parent / "shared/data")) / "rgbd_7scenes_redkitchen"

VIEW = ("view",)
PLAN = ("plan", "--from", "-3.45", "0.74", "0.57", "-133", "--to", "-5.6", "-1.55", "1.7", "-133")
TABLE = ((1600, 1200), (640, 440, 1120, 800))  # size, and what is shown of it
WHOLE = (SIZE, (0, 0, *SIZE))


def flag(name, *values, of):
    """Panels of a parameter, whose default is `of`."""
    return [(f"--{name} {value}", () if value == of else (f"--{name}", value)) for value in values]


# name: recording, what draws it, how large, [(caption, flags of map)]
PICTURES = {
    "office": (DEMO, VIEW, ((1280, 960), None), [(None, ("--resolution", "0.04"))]),
    "demo": (DEMO, VIEW, ((1280, 960), None), [(None, ())]),
    "kitchen": (KITCHEN, (*VIEW, "--up", "auto"), ((1280, 800), None), [(None, ())]),
    "tutorial-map": (WALK, VIEW, ((1280, 960), None), [(None, ())]),
    "tutorial-plan": (WALK, PLAN, ((1280, 960), (640, 320, 1200, 740)), [(None, ())]),
    "resolution": (OFFICE, VIEW, TABLE, flag("resolution", "0.01", "0.02", "0.05", of="0.02")),
    "surface_tolerance": (FLIGHT, VIEW, WHOLE, flag("surface-tolerance", "0.015", "0.004", of="0.015")),
    "max_hole_size": (STONES, VIEW, WHOLE, flag("max-hole-size", "0.03", "0.08", "0.2", of="0.08")),
    "min_surface_points": (OFFICE, VIEW, TABLE, flag("min-surface-points", "50", "1000", of="50")),
    "min_surface_width": (OFFICE, VIEW, TABLE, flag("min-surface-width", "0.03", "0.25", of="0.03")),
    "max_range": (FLIGHT, VIEW, WHOLE, flag("max-range", "4", "2.5", of="4")),
    "align": (DRIFT, VIEW, WHOLE, [(f"--align {a}", ("--align", a, "--resolution", "0.04")) for a in ("auto", "off")]),
}


def octosurf(*arguments, program=OCTOSURF):
    subprocess.run([program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def mapped(recording, flags, folder):
    """Each map is made once, as is each recording."""
    scans = recording if recording == KITCHEN else folder / "-".join(recording)
    if not scans.exists():
        octosurf("simulate", *recording, "-o", scans, program=f"{OCTOSURF}-lab")
    stem = folder / "-".join([scans.name, "map", *flags])
    if not stem.with_name(stem.name + ".surfaces").exists():
        octosurf("map", scans, "-o", stem, *flags)
    return stem


def maps_of(name, folder):
    recording, *_, panels = PICTURES[name]
    return [mapped(recording, flags, folder) for _, flags in panels]


def digest(stem, folder):
    octosurf("export", stem, "--to", folder / "map.json", "--as-mapped", "--force")
    surfaces = json.loads((folder / "map.json").read_text())["surfaces"]
    rings = [ring for surface in surfaces for polygon in surface["polygons"] for ring in (polygon["outer"], *polygon["holes"])]
    return [len(surfaces), round(sum(surface["area_m2"] for surface in surfaces), 3),
            round(sum(math.dist(a, b) for ring in rings for a, b in zip(ring, ring[1:] + ring[:1])), 2)]


def draw(name, folder):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from PIL import Image
    _, (verb, *view), ((width, height), box), panels = PICTURES[name]
    size = ("--width", width, "--height", height) if verb == "view" else ()
    drawn = []
    for stem in maps_of(name, folder):
        octosurf(verb, stem, *view, "--png", folder / "map.png", *size, "--force")
        drawn.append(Image.open(folder / "map.png").convert("RGB").crop(box))
    if len(panels) > 1:
        figure, axes = plt.subplots(1, len(panels), figsize=(SIZE[0] * len(panels) / 100, (SIZE[1] + 30) / 100))
        figure.subplots_adjust(left=0, right=1, bottom=0, top=SIZE[1] / (SIZE[1] + 30), wspace=0.01)
        for axis, picture, (caption, _) in zip(axes, drawn, panels):
            axis.imshow(picture)
            axis.set_title(caption, family="monospace", fontsize=11)
            axis.axis("off")
        figure.savefig(folder / "map.png", dpi=100)
        plt.close(figure)
        drawn = [Image.open(folder / "map.png").convert("RGB")]
    drawn[0].quantize(128).save(OUT / f"{name}.png", optimize=True)  # a fifth of the size, and not to be seen


def keep_office(folder):
    """The map of README's picture and the page behind it."""
    stem, kept = *maps_of("office", folder), ROOT / "maps/office"
    for ending in (".bt", ".surfaces"):
        kept.with_suffix(ending).write_bytes(stem.with_name(stem.name + ending).read_bytes())
    octosurf("view", kept, "--html", kept.with_suffix(".html"), "--force")


def main():
    digests = json.loads(DIGESTS.read_text()) if DIGESTS.exists() else {}
    with tempfile.TemporaryDirectory(prefix="octosurf-pictures-") as folder:
        folder = pathlib.Path(folder)
        for name in sys.argv[1:] or PICTURES:
            if name == "kitchen" and not KITCHEN.is_dir():
                print(f"{name}: left as it is, {KITCHEN} is missing")
                continue
            draw(name, folder)
            digests[name] = [digest(stem, folder) for stem in maps_of(name, folder)]
            if name == "office":
                keep_office(folder)
            print(name, *digests[name], flush=True)
    DIGESTS.write_text("{\n" + ",\n".join(f'  "{name}": {json.dumps(digests[name])}' for name in sorted(digests)) + "\n}\n")


if __name__ == "__main__":
    main()
