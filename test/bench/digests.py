#!/usr/bin/env python3
"""The bytes of maps, as SHA-256: equal before and after a change that is to leave the behaviour alone.

Simulates each scene with each sensor, maps it, maps what of ../shared/data is there, and prints a line a map:
name, digest of .bt, digest of .surfaces. Two outputs are compared with diff.
"""

import argparse
import hashlib
import pathlib
import subprocess
import sys
import tempfile

SCENES = ("room", "office", "stairs", "stones", "corridor", "change")
SENSORS = ("depth", "depth-real", "tilting", "spinning")
DATA = pathlib.Path(__file__).resolve().parents[3] / "shared" / "data"
# name, inputs and arguments of `octosurf map`
RECORDINGS = (
    ("kitchen 2 cm", ["rgbd_7scenes_redkitchen"], ["--resolution", "0.02"]),
    ("kitchen 1 cm", ["rgbd_7scenes_redkitchen"], ["--resolution", "0.01", "--every", "5"]),
    ("hall 5 cm", ["lidar_balm_realworld/scans", "--poses", "lidar_balm_realworld/poses_subset.csv"],
     ["--resolution", "0.05", "--max-range", "50"]),
)


def digest(file):
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16]


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")


def line(octosurf, name, inputs, folder):
    run([octosurf, "map", *inputs, "-o", folder / "map", "--force"])
    print(f"{name:22} {digest(folder / 'map.bt')} {digest(folder / 'map.surfaces')}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("octosurf", help="the program")
    parser.add_argument("--scenes", nargs="*", default=SCENES)
    parser.add_argument("--sensors", nargs="*", default=SENSORS)
    parser.add_argument("--frames", type=int, default=0, help="of each scene; 0: as many as show it")
    arguments = parser.parse_args()
    octosurf = pathlib.Path(arguments.octosurf).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene in arguments.scenes:
            for sensor in arguments.sensors:
                frames = ["--frames", str(arguments.frames)] if arguments.frames else []
                run([octosurf, "simulate", scene, "-o", folder / "scans", "--sensor", sensor, "--force", *frames])
                line(octosurf, f"{scene} {sensor}", [folder / "scans"], folder)
        for title, inputs, options in RECORDINGS:
            inputs = [i if i.startswith("--") else DATA / i for i in inputs]
            if inputs[0].exists():
                line(octosurf, title, [*inputs, *options], folder)
            else:
                print(f"{title:22} skipped: no {inputs[0].name}", flush=True)


if __name__ == "__main__":
    main()
