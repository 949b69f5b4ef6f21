#!/usr/bin/env python3
"""How near a walking body comes to the meshes of a map's surfaces, by Coal: coal_body.py MESHES.json STEPS.json

  octosurf export maps/office --to meshes.json --what meshes --as-mapped
  octosurf plan maps/office --from X Y Z YAW --to X Y Z YAW -o steps.json

Prints the distance from the body's box to the nearest surface at the start and after each step; fails where they meet.
"""
import json
import pathlib
import sys

import coal
import numpy as np

BODY = {"length_m": 0.3, "width_m": 0.5, "from_m": 0.45, "to_m": 1.6}  # octosurf.Biped's


class Surfaces:
    """Their meshes in Coal's tree of boxes."""

    def __init__(self, file):
        self.manager, self.kept = coal.DynamicAABBTreeCollisionManager(), []  # which refers to them only
        for surface in json.loads(pathlib.Path(file).read_text())["surfaces"]:
            vertices, triangles = (np.array(surface["mesh"][name]) for name in ("vertices", "triangles"))
            model = coal.BVHModelOBBRSS()
            model.beginModel(len(triangles), len(vertices))
            model.addVertices(vertices)
            model.addTriangles(triangles.astype(np.uint32))
            model.endModel()
            self.kept.append(coal.CollisionObject(model))
            self.manager.registerObject(self.kept[-1])
        self.manager.setup()

    def distance(self, sides, T):
        """m from a box to the nearest; zero or less: they meet."""
        callback = coal.DistanceCallBackDefault()
        self.manager.distance(coal.CollisionObject(coal.Box(*sides), T[:3, :3], T[:3, 3]), callback)
        return callback.data.result.min_distance


def body_at(standing, body):
    """The sides of its box, and where it is in a map whose z axis is up."""
    yaw, T = np.radians(standing["yaw_deg"]), np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:3, 3] = standing["at"] + np.array([0, 0, (body["from_m"] + body["to_m"]) / 2])
    return np.array([body["length_m"], body["width_m"], body["to_m"] - body["from_m"]]), T


def main():
    surfaces, plan = Surfaces(sys.argv[1]), json.loads(pathlib.Path(sys.argv[2]).read_text())
    distances = [surfaces.distance(*body_at(standing, BODY)) for standing in plan["body"]]
    for standing, distance in zip(plan["body"], distances):
        print("{:.2f} {:.2f} {:.2f}".format(*standing["at"]), f"{distance:.3f} m")
    sys.exit(min(distances) <= 0 and "the body meets a surface")


if __name__ == "__main__":
    main()
