#!/usr/bin/env python3
"""Mapper.insert from Python beside C++ on the same scans, in turns.

    ninja bench_python_insert octosurf_python
    PYTHONPATH=build/release/python python3 test/bench/python_insert.py RECORDING build/release/test/bench/bench_python_insert

Prints the seconds of all insertions: C++, insert(Scan) and insert_points(array, pose), which copies the points; medians over
the rounds, and the median of Python's share over C++'s of the same round.
"""

import statistics
import subprocess
import sys
import time

import octosurf

ROUNDS = 7


def python(recording, insert):
    mapper, seconds = octosurf.Mapper(), 0.0
    for scan in octosurf.open_scans(recording):
        given = insert(mapper, scan)
        begin = time.perf_counter()
        given()
        seconds += time.perf_counter() - begin
    return seconds


def of_scan(mapper, scan):
    return lambda: mapper.insert(scan)


def of_points(mapper, scan):
    points, pose = scan.points.copy(), scan.T_map_sensor
    return lambda: mapper.insert_points(points, pose)


def main():
    recording, program = sys.argv[1:3]
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else ROUNDS
    turns = {
        "C++": lambda: float(subprocess.run([program, recording], check=True, capture_output=True, text=True).stdout),
        "insert": lambda: python(recording, of_scan),
        "insert_points": lambda: python(recording, of_points),
    }
    seconds = {name: [] for name in turns}
    for _ in range(rounds):
        for name, turn in turns.items():
            seconds[name].append(turn())
    for name, all_rounds in seconds.items():
        shares = [mine / cpp for mine, cpp in zip(all_rounds, seconds["C++"])]
        print(f"{name:14}{statistics.median(all_rounds):8.3f} s  {min(all_rounds):8.3f} s at least  "
              f"{statistics.median(shares):6.3f} of C++ ({min(shares):.3f} to {max(shares):.3f})")


if __name__ == "__main__":
    main()
