"""Maps recordings that are right and others made wrong from them, and prints what `octosurf map` warns of.

  python3 test/bench/agreement.py [--only NAME;…] [--faults FAULT,…] [--times K]

Right: simulated rooms by four sensors, with drift, with things that move, and those of ../shared/data. Each is read, thinned to at
most 60 scans (K times as many), and written as clouds with poses; a fault changes poses, stamps or readings. No warning is to name a right one, and
each wrong one is to be warned of, by its cause.
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("OCTOSURF_BUILD", ROOT / "build/release"))
DATA = pathlib.Path(os.environ.get("OCTOSURF_DATA", ROOT.parent / "shared/data"))
sys.path.insert(0, str(BUILD / "python"))
import octosurf  # noqa: E402

SCANS = 60
SIMULATED = {  # name: arguments of octosurf-lab simulate
    "room, depth camera": "room --sensor depth --seed 21 --frames 60",
    "office, noise x 2": "office --sensor depth --noise-scale 2 --seed 22 --frames 60",
    "room, real camera": "room --sensor depth-real --seed 23 --frames 60",
    "stairs, real camera": "stairs --sensor depth-real --seed 24 --frames 60",
    "office, spinning": "office --sensor spinning --seed 25 --frames 40",
    "stairs, spinning": "stairs --sensor spinning --seed 26 --frames 40",
    "room, tilting": "room --sensor tilting --seed 27 --frames 600",
    "corridor, spinning": "corridor --sensor spinning --seed 28 --frames 60",
    "corridor, drift": "corridor --sensor depth --seed 29 --frames 90 --laps 2 --drift-m 0.1 --drift-deg 1",
    "things move": "change --sensor depth-real --seed 30",
    "storeys": "storeys --sensor depth --seed 31 --frames 90",
    "landing": "landing --sensor depth-real --seed 32 --frames 60",
}
REAL = {"kitchen": ("rgbd_7scenes_redkitchen", 5), "kitchen, fast": ("rgbd_7scenes_redkitchen", 1)}
FAULTS = {  # name: what the warning is to say
    "jump": "jump", "yaw": "jump", "two passes": "two tracks", "late": "after their stamps", "focal": "focal length",
    "unit": "times as long", "left-handed": "axis reversed", "inverse": "taken as inverse",
}
SCALES = {"focal": [1 / 1.15, 1 / 1.15, 1], "unit": 0.8, "left-handed": [1, -1, 1]}  # of readings


def turned(degrees):
    """About z."""
    matrix, c, s = np.eye(4), np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix[:2, :2] = [[c, -s], [s, c]]
    return matrix


def quaternion(matrix):
    """x y z w, by the largest of the four."""
    m = matrix[:3, :3]
    v = np.array([[m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]])
    products = np.block([[m + m.T + (1 - np.trace(m)) * np.eye(3), v.T], [v, np.array([[1 + np.trace(m)]])]])  # 4 q qᵀ
    q = products[np.argmax(np.diag(products))]
    return q / np.linalg.norm(q)


def with_fault(scans, fault):
    """Points, pose and stamp of each scan; the stamps of `late` are those of the poses 0.1 s on."""
    middle, made = len(scans) // 2, []
    pivot = np.eye(4)
    pivot[:3, 3] = scans[middle][1][:3, 3]
    for k, (points, pose, stamp) in enumerate(scans):
        if fault == "jump" and k >= middle:
            pose = np.vstack([np.c_[pose[:3, :3], pose[:3, 3] + [0.24, 0.18, 0]], pose[3]])
        if fault == "yaw" and k >= middle:
            pose = pivot @ turned(5) @ np.linalg.inv(pivot) @ pose
        if fault == "two passes" and k % 2:
            pose = scans[(k + middle) % len(scans)][1]
        if fault == "inverse":
            pose = np.linalg.inv(pose)
        made.append((points * np.float32(SCALES[fault]) if fault in SCALES else points, pose, stamp))
    return made


def write(folder, scans, late_s=0):
    """PCD files called by their stamps, and poses.txt."""
    with open(folder / "poses.txt", "w") as poses:
        for points, pose, stamp in scans:
            (folder / f"{stamp:.6f}.pcd").write_bytes(
                f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA binary\n".encode()
                + np.ascontiguousarray(points, np.float32).tobytes())
            poses.write(" ".join(map(repr, [float(stamp + late_s), *map(float, pose[:3, 3]), *map(float, quaternion(pose))])) + "\n")


def read(folder, every, times):
    """Of a recording: points (a camera's every fourth), T_map_sensor, stamp."""
    scans = []
    for k, scan in enumerate(octosurf.open_scans([str(folder)])):
        if k % every:
            continue
        points = np.asarray(scan.points)
        points = points[np.isfinite(points).all(1)]
        scans.append((points[:: 4 if len(points) > 150_000 else 1].copy(), np.array(scan.T_map_sensor), 100 + scan.stamp_s))
        camera = "camera" in str(scan.sensor)
        if len(scans) >= times * (600 if len(points) < 5000 else SCANS):
            break
    return scans, camera


def outcome(folder, camera):
    """Exit code and what is said of contradictions."""
    command = [str(BUILD / "bin/octosurf"), "map", str(folder), "-o", str(folder / "map"), "--force", "--sensor", "camera" if camera else "lidar",
               "--max-pose-gap", "1"]
    run = subprocess.run(command, capture_output=True, text=True)
    said = [line for line in run.stderr.splitlines() if any(word in line for word in ("contradict", "far better", "jump", "turns", "do not fit each other", "  "))]
    return run.returncode, " | ".join(line.strip() for line in said)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", help="recordings, separated by ;")
    parser.add_argument("--faults", help="faults, separated by commas")
    parser.add_argument("--times", type=int, default=1, help="as many scans on the same way [%(default)s]")
    arguments = parser.parse_args()
    names = arguments.only.split(";") if arguments.only else [*SIMULATED, *REAL]
    faults = arguments.faults.split(",") if arguments.faults else FAULTS
    counts = dict.fromkeys(("right", "silent", "wrong", "warned", "cause"), 0)
    for name in names:
        with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as place:
            source = pathlib.Path(place) / "source"
            if name in SIMULATED:
                words = re.sub(r"--frames (\d+)", lambda found: f"--frames {int(found[1]) * arguments.times}", SIMULATED[name]).split()
                subprocess.run([str(BUILD / "bin/octosurf-lab"), "simulate", *words, "-o", str(source)], check=True, capture_output=True)
                scans, camera = read(source, 1, arguments.times)
            elif (DATA / REAL[name][0]).is_dir():
                scans, camera = read(DATA / REAL[name][0], max(1, REAL[name][1] // arguments.times), arguments.times)
            else:
                print(f"{name}: skipped, {DATA / REAL[name][0]} is not there")
                continue
            for fault in ["", *(fault for fault in faults if camera or fault != "focal")]:
                folder = pathlib.Path(place) / "wrong"
                folder.mkdir()
                write(folder, with_fault(scans, fault), 0.1 if fault == "late" else 0)
                code, said = outcome(folder, camera)
                subprocess.run(["rm", "-rf", str(folder)], check=True)
                warned = bool(said)
                cause = bool(fault) and FAULTS[fault] in said
                counts["wrong" if fault else "right"] += 1
                counts["silent"] += not fault and not warned
                counts["warned"] += bool(fault) and warned
                counts["cause"] += cause
                verdict = ("WARNED" if warned else "silent") if not fault else "cause" if cause else "warned" if warned else "SILENT"
                print(f"{name:20} {fault or 'right':12} {verdict:7} {code} {said}", flush=True)
    print("{silent} of {right} right ones without a warning; of {wrong} wrong ones {warned} warned of, {cause} by their cause".format(**counts))


if __name__ == "__main__":
    main()
