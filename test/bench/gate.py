#!/usr/bin/env python3
"""Is the map of this checkout better or worse, faster or slower, than that of the commit in gate.json?

Accuracy: six sets of simulated recordings, each of four scenes and two seeds; a process a recording, as many at once
as there are cores. Then, alone, the kitchen's stages at 2 and 1 cm beside OctoMap's insertion in the same run.

Worse is what differs by more than its spread. Maps are deterministic, so the spread is that of what changed: n faces,
or recordings, that each became better or worse by d_i would sum up to sqrt(sum d_i^2) if the change meant nothing
(McNemar's test, for faces). Beyond two of those it does. A speed's spread is that of its repetitions.
"""

import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "build/release/test/bench"
KITCHEN = ROOT.parent / "shared/data/rgbd_7scenes_redkitchen"
BASE = pathlib.Path(__file__).with_name("gate.json")

SETS = {
    "depth": [],
    "depth-real": ["--sensor", "depth-real"],
    "noise x 2": ["--noise-scale", "2"],
    "drift": ["--drift-m", "0.015", "--drift-deg", "0.3"],
    "spinning": ["--sensor", "spinning"],
    "tilting": ["--sensor", "tilting"],
}
# The dearest first, so that no core waits for one at the end.
SCENES = ["office", "stones", "stairs", "room"]
SEEDS = [1, 2]
# Arguments: those of 1 cm map few scans, as OctoMap takes seconds for each.
SPEEDS = {"2 cm": ["--resolution", "0.02", "--frames", "60", "--every", "5", "--octomap-every", "3"],
          "1 cm": ["--resolution", "0.01", "--frames", "30", "--every", "10", "--octomap-every", "6"]}
REPETITIONS = 3
STANDARD_ERRORS = 2
UNSAFE_SHARE = 0.001  # of a set's area: unsafe by so much more is worse whatever the spread
DOUBLE_LAYERS_M2 = 0.05  # the smallest area that counts as a surface, twice over
KITCHEN_AREA = 0.99  # of the area before: outlines move by a share of their rim
SPEED_SHARE = 0.05  # by so much one build differs from another of the same sources (code's layout)


def run(program, arguments):
    """What `program` writes as JSON, and how long it ran."""
    with tempfile.NamedTemporaryFile(suffix=".json") as output:
        command = [PROGRAMS / program, *arguments, "--json", output.name]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SystemExit(f"gate: {' '.join(map(str, command))}\n{done.stderr}")
        return json.loads(pathlib.Path(output.name).read_text(encoding="utf-8"))


def recording(sensor, scene, seed):
    rows = run("bench_accuracy", ["--only", "ours/default", "--scenes", scene, "--seeds", str(seed), *SETS[sensor]])
    keep = ("faces", "wrong", "noise", "area_m2", "unsafe_m2")
    return {key: rows[0][key] for key in keep}


def measure_accuracy():
    sets = {name: {} for name in SETS}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        kitchen = pool.submit(run, "bench_kitchen", ["--frames", "300"]) if KITCHEN.is_dir() else None
        # With drift the way is walked twice.
        order = sorted(SETS, key=lambda name: name not in ("drift", "spinning"))
        tasks = {(name, scene, seed): pool.submit(recording, name, scene, seed)
                 for name in order for scene in SCENES for seed in SEEDS}
        for (name, scene, seed), task in tasks.items():
            sets[name][f"{scene} {seed}"] = task.result()
        mapped = kitchen.result() if kitchen else None
    figures = {"sets": sets}
    if mapped:
        figures["kitchen"] = {key: mapped[key] for key in ("double_layers", "double_layers_m2", "area_m2")}
    return figures


def measure_speed():
    speeds = {}
    for name, arguments in SPEEDS.items():
        runs = [run("bench_kitchen", arguments) for _ in range(REPETITIONS)]
        stages = runs[0]["stage_ms"]
        speeds[name] = {
            "stage_ms": {stage: statistics.median(one["stage_ms"][stage] for one in runs) for stage in stages},
            "ms": [one["ms"] for one in runs],
            "octomap_ms": [one["octomap_ms"] for one in runs],
        }
    return speeds


def ratios(speed):
    return [theirs / ours for theirs, ours in zip(speed["octomap_ms"], speed["ms"])]


def beyond_spread(differences):
    """Whether what got worse (positive) outweighs what got better by more than chance would."""
    return sum(differences) > STANDARD_ERRORS * math.sqrt(sum(d * d for d in differences))


def total(recordings, key):
    return sum(len(one[key]) if key == "wrong" else one[key] for one in recordings.values())


def compare_set(base, now):
    """Names of what is worse."""
    if base.keys() != now.keys():
        raise SystemExit("gate: the commit compared with has other recordings; measure it anew (--write)")
    faces, noise, unsafe = [], [], []
    for name, recorded in now.items():
        before, after = set(base[name]["wrong"]), set(recorded["wrong"])
        faces += [1] * len(after - before) + [-1] * len(before - after)
        noise.append(recorded["noise"] - base[name]["noise"])
        unsafe.append(recorded["unsafe_m2"] - base[name]["unsafe_m2"])
    worse = []
    if beyond_spread(faces):
        worse.append("faces")
    if beyond_spread(noise):
        worse.append("noise")
    if beyond_spread(unsafe) or sum(unsafe) > UNSAFE_SHARE * total(now, "area_m2"):
        worse.append("unsafe")
    return worse


def set_text(recordings):
    faces, wrong = total(recordings, "faces"), total(recordings, "wrong")
    unsafe = total(recordings, "unsafe_m2") / total(recordings, "area_m2")
    return (f"{faces - wrong:4d}/{faces:<4d} {100 * (faces - wrong) / faces:5.1f} %   unsafe {100 * unsafe:5.2f} %   "
            f"noise {total(recordings, 'noise'):3d}")


def print_row(name, before, after, worse):
    print(f"{name:<12} {before}\n{'':<12} {after}{'   WORSE: ' + ', '.join(worse) if worse else ''}")
    return bool(worse)


def kitchen_text(kitchen):
    return (f"{kitchen['double_layers']} double layers of {kitchen['double_layers_m2']:.3f} m2, "
            f"{kitchen['area_m2']:.2f} m2")


def speed_text(speed):
    stages = " ".join(f"{stage} {ms:.1f}" for stage, ms in speed["stage_ms"].items())
    each = ratios(speed)
    return (f"{statistics.median(each):.2f} times OctoMap's speed ({min(each):.2f} to {max(each):.2f}), "
            f"{statistics.median(speed['ms']):.1f} ms: {stages}")


def compare_speed(base, now):
    """Slower beyond the repetitions of both, and beyond what another build of the same sources may be."""
    return ["speed"] if max(ratios(now)) < (1 - SPEED_SHARE) * min(ratios(base)) else []


def compare(base, now):
    """Prints both, the earlier above; whether anything is worse."""
    print(f"{base['commit']}, and below each line {now['commit']}\n")
    worse = [print_row(name, set_text(base["sets"][name]), set_text(now["sets"][name]),
                       compare_set(base["sets"][name], now["sets"][name])) for name in now["sets"]]
    both = [{f"{name} {key}": one for name, recordings in figures["sets"].items() for key, one in recordings.items()}
            for figures in (base, now)]
    worse.append(print_row("all", *map(set_text, both), compare_set(*both)))
    if "kitchen" in now and "kitchen" in base:
        before, after = base["kitchen"], now["kitchen"]
        failed = []
        if after["double_layers_m2"] > before["double_layers_m2"] + DOUBLE_LAYERS_M2:
            failed.append("double layers")
        if after["area_m2"] < KITCHEN_AREA * before["area_m2"]:
            failed.append("area")
        worse.append(print_row("kitchen", kitchen_text(before), kitchen_text(after), failed))
        for name in now["speed"]:
            before, after = base["speed"][name], now["speed"][name]
            worse.append(print_row(name, speed_text(before), speed_text(after), compare_speed(before, after)))
    else:
        print(f"kitchen      skipped: {KITCHEN} is missing")
    return any(worse)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=pathlib.Path, default=BASE, help="figures to compare with [gate.json]")
    parser.add_argument("--write", type=pathlib.Path, nargs="?", const=BASE,
                        help="keep this checkout's figures there [gate.json]")
    parser.add_argument("--commit", required=True, help="name of this checkout's commit")
    arguments = parser.parse_args()
    start = time.monotonic()
    now = {"commit": arguments.commit, **measure_accuracy()}
    accuracy_s = time.monotonic() - start
    if "kitchen" in now:
        now["speed"] = measure_speed()
    base = json.loads(arguments.against.read_text(encoding="utf-8")) if arguments.against.exists() else now
    worse = compare(base, now)
    print(f"\n{time.monotonic() - start:.0f} s, of them accuracy {accuracy_s:.0f}")
    if arguments.write:
        arguments.write.write_text(json.dumps(now, indent=None, separators=(",", ":")) + "\n", encoding="utf-8")
    sys.exit(1 if worse else 0)


if __name__ == "__main__":
    main()
