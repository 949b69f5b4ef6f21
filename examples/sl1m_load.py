"""What SL1M and its kin take, out of `octosurf export MAP --to pieces.json --format sl1m --foot 0.22x0.12`."""

import json
import sys

import numpy as np

with open(sys.argv[1]) as file:
    pieces = json.load(file)
surfaces = [np.array(p["vertices"]).T for p in pieces]  # 3 x n each: surfaces[phase] = [surfaces] for each moving foot
inequalities = [(np.array(p["A"]), np.array(p["b"])) for p in pieces]  # A p <= b, world frame

print(f"{len(surfaces)} convex pieces, {sum(s.shape[1] for s in surfaces)} vertices")
