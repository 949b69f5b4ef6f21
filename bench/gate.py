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
import sys
import time

from bench import KITCHEN, complete, run

BASE = pathlib.Path(__file__).with_name("gate.json")
SETS = {"depth": {}, "depth-real": {"sensors": ["depth-real"]}, "noise x 2": {"noise_scale": 2},
        "drift": {"drift_m": 0.015, "drift_deg": 0.3}, "spinning": {"sensors": ["spinning"]}, "tilting": {"sensors": ["tilting"]}}
DEAREST = ("drift", "spinning")  # first, so that no core waits for one at the end; likewise the scenes
SCENES = ("office", "stones", "stairs", "room")
SEEDS = (1, 2)
# Of 1 cm few scans are mapped, as OctoMap takes seconds for each.
SPEEDS = {"2 cm": {"resolutions": [0.02], "frames": 60, "every": 5, "octomap_every": 3},
          "1 cm": {"resolutions": [0.01], "frames": 30, "every": 10, "octomap_every": 6}}
REPETITIONS = 3
STANDARD_ERRORS = 2
UNSAFE_SHARE = 0.001  # of a set's area: unsafe by so much more is worse whatever the spread
DOUBLE_LAYERS_M2 = 0.05  # the smallest area that counts as a surface, twice over
KITCHEN_AREA = 0.99  # of the area before: outlines move by a share of their rim
SPEED_SHARE = 0.05  # by so much one build differs from another of the same sources (code's layout)


def recording(name, scene, seed):
    row = run("accuracy", complete({"only": ["ours/default"], "scenes": [scene], "seeds": [seed], **SETS[name]}))[0]
    return {"wrong": [f"{seed}:{face['id']}" for face in row["wrong"]], **{key: row[key] for key in ("faces", "noise", "area_m2", "unsafe_m2")}}


def measure_accuracy():
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        kitchen = pool.submit(run, "kitchen", {"frames": 300}) if KITCHEN.is_dir() else None
        tasks = {(name, scene, seed): pool.submit(recording, name, scene, seed)
                 for name in sorted(SETS, key=lambda name: name not in DEAREST) for scene in SCENES for seed in SEEDS}
    figures = {"sets": {name: {f"{scene} {seed}": tasks[name, scene, seed].result() for scene in SCENES for seed in SEEDS} for name in SETS}}
    if kitchen:
        figures["kitchen"] = {key: kitchen.result()[0][key] for key in ("double_layers", "double_layers_m2", "area_m2")}
    return figures


def measure_speed(options):
    runs = [run("kitchen", options)[0] for _ in range(REPETITIONS)]
    stages = {stage: statistics.median(one["stage_ms"][stage] for one in runs) for stage in runs[0]["stage_ms"]}
    return {"stage_ms": stages, **{key: [one[key] for one in runs] for key in ("ms", "octomap_ms")}}


def ratios(speed):
    return [theirs / ours for theirs, ours in zip(speed["octomap_ms"], speed["ms"])]


def beyond_spread(differences):
    """Whether what got worse (positive) outweighs what got better by more than chance would."""
    return sum(differences) > STANDARD_ERRORS * math.sqrt(sum(d * d for d in differences))


def total(recordings, key):
    return sum(len(one[key]) if key == "wrong" else one[key] for one in recordings.values())


def worse_set(base, now):
    """Names of what is worse."""
    if base.keys() != now.keys():
        raise SystemExit("gate: the commit compared with has other recordings; measure it anew (--write)")
    faces = []
    for name, recorded in now.items():
        before, after = set(base[name]["wrong"]), set(recorded["wrong"])
        faces += [1] * len(after - before) + [-1] * len(before - after)
    noise, unsafe = ([recorded[key] - base[name][key] for name, recorded in now.items()] for key in ("noise", "unsafe_m2"))
    return {"faces": beyond_spread(faces), "noise": beyond_spread(noise),
            "unsafe": beyond_spread(unsafe) or sum(unsafe) > UNSAFE_SHARE * total(now, "area_m2")}


def worse_kitchen(base, now):
    return {"double layers": now["double_layers_m2"] > base["double_layers_m2"] + DOUBLE_LAYERS_M2,
            "area": now["area_m2"] < KITCHEN_AREA * base["area_m2"]}


def worse_speed(base, now):
    """Slower beyond the repetitions of both, and beyond what another build of the same sources may be."""
    return {"speed": max(ratios(now)) < (1 - SPEED_SHARE) * min(ratios(base))}


def set_text(recordings):
    faces, wrong = total(recordings, "faces"), total(recordings, "wrong")
    unsafe = total(recordings, "unsafe_m2") / total(recordings, "area_m2")
    return (f"{faces - wrong:4d}/{faces:<4d} {100 * (faces - wrong) / faces:5.1f} %   unsafe {100 * unsafe:5.2f} %   "
            f"noise {total(recordings, 'noise'):3d}")


def kitchen_text(kitchen):
    return "{double_layers} double layers of {double_layers_m2:.3f} m2, {area_m2:.2f} m2".format(**kitchen)


def speed_text(speed):
    stages = " ".join(f"{stage} {ms:.1f}" for stage, ms in speed["stage_ms"].items())
    each = ratios(speed)
    return (f"{statistics.median(each):.2f} times OctoMap's speed ({min(each):.2f} to {max(each):.2f}), "
            f"{statistics.median(speed['ms']):.1f} ms: {stages}")


def compare(base, now):
    """Prints both, the earlier above; whether anything is worse."""
    def show(name, before, after, text, worse):
        failed = ", ".join(what for what, is_worse in worse(before, after).items() if is_worse)
        print(f"{name:<12} {text(before)}\n{'':<12} {text(after)}{'   WORSE: ' + failed if failed else ''}")
        return bool(failed)
    print(f"{base['commit']}, and below each line {now['commit']}\n")
    both = [{f"{name} {key}": one for name, recordings in figures["sets"].items() for key, one in recordings.items()}
            for figures in (base, now)]
    worse = [show(name, base["sets"][name], now["sets"][name], set_text, worse_set) for name in now["sets"]]
    worse.append(show("all", *both, set_text, worse_set))
    if "kitchen" in now and "kitchen" in base:
        worse.append(show("kitchen", base["kitchen"], now["kitchen"], kitchen_text, worse_kitchen))
        worse += [show(name, base["speed"][name], now["speed"][name], speed_text, worse_speed) for name in now["speed"]]
    else:
        print(f"kitchen      skipped: {KITCHEN} is missing")
    return any(worse)


def main(arguments):
    parser = argparse.ArgumentParser(prog="./dev gate", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=pathlib.Path, default=BASE, help="figures to compare with [gate.json]")
    parser.add_argument("--write", type=pathlib.Path, nargs="?", const=BASE, help="keep this checkout's figures there [gate.json]")
    parser.add_argument("--commit", required=True, help="name of this checkout's commit")
    options = parser.parse_args(arguments)
    start = time.monotonic()
    now = {"commit": options.commit, **measure_accuracy()}
    accuracy_s = time.monotonic() - start
    if "kitchen" in now:
        now["speed"] = {name: measure_speed(settings) for name, settings in SPEEDS.items()}
    worse = compare(json.loads(options.against.read_text(encoding="utf-8")) if options.against.exists() else now, now)
    print(f"\n{time.monotonic() - start:.0f} s, of them accuracy {accuracy_s:.0f}")
    if options.write:
        options.write.write_text(json.dumps(now, separators=(",", ":")) + "\n", encoding="utf-8")
    sys.exit(1 if worse else 0)
