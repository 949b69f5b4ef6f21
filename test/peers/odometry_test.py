"""Poses of odometry that others wrote: their output files go into `octosurf map` as they are."""
import json
import os
import pathlib
import subprocess
import sys
import unittest

import numpy as np
import octosurf

import world
import write_bag

KISS_ICP = pathlib.Path(sys.executable).parent / "kiss_icp_pipeline"


def moved(truth, T):
    """The faces of a truth.json in another frame."""
    for face in truth["faces"]:
        normal = T[:3, :3] @ face["normal"]
        face |= {"normal": normal.tolist(), "offset": face["offset"] + float(normal @ T[:3, 3]),
                 "T_map_face": (T @ np.reshape(face["T_map_face"], (4, 4))).ravel().tolist()}
    return truth | {"stairs": []}


class KissIcp(unittest.TestCase):
    def test_its_poses_give_the_faces_of_exact_ones(self):
        walk, bag, poses = world.FOLDER / "walk", world.FOLDER / "walk.bag", world.FOLDER / "latest/walk_poses_tum.txt"
        world.command("simulate", "room", "--sensor", "spinning", "--frames", 100, "-o", walk)
        write_bag.write_bag(walk, bag, ["poses=none"])
        subprocess.run([KISS_ICP, bag], check=True, capture_output=True,
                       env=os.environ | {"kiss_icp_out_dir": str(world.FOLDER), "kiss_icp_data": '{"max_range": 30}'})
        exact = self.faces_of(walk, walk / "truth.json")
        # Its map's frame is that of the first scan.
        first = np.linalg.inv(np.array(next(iter(octosurf.open_scans(walk))).T_map_sensor))
        truth = json.loads((walk / "truth.json").read_text())
        (world.FOLDER / "truth.json").write_text(json.dumps(moved(truth, first)))
        found = self.faces_of(bag, world.FOLDER / "truth.json", "--poses", poses)
        self.assertGreater(exact, 10)
        self.assertGreaterEqual(found, 0.9 * exact)

    def faces_of(self, scans, truth, *options):
        world.command("map", scans, *options, "-o", world.FOLDER / "map", "--force")
        world.command("evaluate", world.FOLDER / "map", "--truth", truth, "--json", world.FOLDER / "scores.json", "--force")
        return json.loads((world.FOLDER / "scores.json").read_text())["correct"]
