#!/usr/bin/env python3
"""What a learned walking policy reads while the map grows: policy_heights.py SCANS

One thread maps, as scans come at 30 Hz; the other reads at 50 Hz the 17 x 11 heights that such policies are trained on, 10 cm
apart about the base, and clips them as in training.
"""
import sys
import threading
import time

import numpy as np

import octosurf

LAYOUT = octosurf.PatchLayout.grid(1.7, 1.1, 0.1)
LAYOUT.fill = True  # a policy has no word for unknown


def base_of(T_map_camera: "np.ndarray[tuple[int, int], np.dtype[np.float64]]") -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    """x ahead, where the camera looks; z up."""
    ahead = np.array([T_map_camera[0, 2], T_map_camera[1, 2], 0.0])
    ahead /= np.linalg.norm(ahead)
    T_map_base = np.eye(4)
    T_map_base[:3, 0], T_map_base[:3, 1] = ahead, [-ahead[1], ahead[0], 0]
    T_map_base[:3, 3] = T_map_camera[:3, 3]
    return T_map_base


class Mapping(threading.Thread):
    def __init__(self, scans: str) -> None:
        super().__init__()
        self.scans, self.mapper = scans, octosurf.Mapper()
        self.now: "tuple[octosurf.GroundView, np.ndarray[tuple[int, int], np.dtype[np.float64]]] | None" = None

    def run(self) -> None:
        for scan in octosurf.open_scans(self.scans):
            start = time.monotonic()
            self.mapper.insert(scan)
            snapshot, octree = self.mapper.snapshot(), self.mapper.map().octree()
            ground = octosurf.GroundView(snapshot, octree)
            self.now = ground, base_of(scan.T_map_sensor)
            time.sleep(max(0.0, 1 / 30 - (time.monotonic() - start)))


def main() -> None:
    mapping = Mapping(sys.argv[1])
    mapping.start()
    took, heights = [], np.zeros(len(LAYOUT.points))
    while mapping.is_alive():
        if mapping.now is not None:
            ground, T_map_base = mapping.now
            start = time.monotonic()
            patch = ground.patch(T_map_base, LAYOUT)
            heights = np.clip(np.nan_to_num(patch.height), -1, 1)  # the policy's input
            took.append(1000 * (time.monotonic() - start))
        time.sleep(0.02)
    mapping.join()
    print(f"{heights.reshape(17, 11).shape} heights, {len(took)} times: p50 {np.percentile(took, 50):.2f} ms, p99 {np.percentile(took, 99):.2f} ms")


if __name__ == "__main__":
    main()
