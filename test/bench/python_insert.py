#!/usr/bin/env python3
"""Mapper.insert from Python beside C++: ./dev bench python [RECORDING].

Both map the same scans in lockstep, scan by scan and in changing order, so that whatever else the machine does slows
both alike. Compared are insert(Scan) and insert_points(array, pose), which copies the points, with C++'s insert(Scan):
the processor's seconds for all scans, and the median over the scans of the one time over the other.
"""

import itertools
import pathlib
import statistics
import subprocess
import sys
import time

import octosurf

KITCHEN = pathlib.Path(__file__).resolve().parents[3] / "shared/data/rgbd_7scenes_redkitchen"


class Cpp:
    """bench_python_insert, which inserts its next scan when it is told to."""

    def __init__(self, program, recording):
        self.process = subprocess.Popen([program, recording], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def insert(self, _scan):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return tuple(float(word) for word in self.process.stdout.readline().split())


class Python:
    """A mapper of this process."""

    def __init__(self, copies):
        self.mapper, self.copies = octosurf.Mapper(), copies

    def insert(self, scan):
        points, pose = scan.points.copy() if self.copies else None, scan.T_map_sensor
        begin, begin_busy = time.perf_counter(), time.thread_time()
        if self.copies:
            self.mapper.insert_points(points, pose)
        else:
            self.mapper.insert(scan)
        return time.perf_counter() - begin, time.thread_time() - begin_busy


def main():
    program, recording = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else str(KITCHEN)
    if not pathlib.Path(recording).exists():
        sys.exit(f"skipped: no recording {recording}")
    mappers = {"C++": Cpp(program, recording), "insert": Python(False), "insert_points": Python(True)}
    taken = {name: [] for name in mappers}
    orders = itertools.cycle(itertools.permutations(mappers))
    for scan in octosurf.open_scans(recording):
        for name in next(orders):
            taken[name].append(mappers[name].insert(scan))
    print(f"{len(taken['C++'])} scans; s on the processor (on the clock), of C++'s in all, of each scan's median")
    for name, times in taken.items():
        wall, busy = (sum(column) for column in zip(*times))
        base = sum(cpp for _, cpp in taken["C++"])
        median = statistics.median(mine / cpp for (_, mine), (_, cpp) in zip(times, taken["C++"]))
        print(f"{name:14}{busy:8.3f} ({wall:.3f}) {busy / base:8.3f} {median:8.3f}")


if __name__ == "__main__":
    main()
