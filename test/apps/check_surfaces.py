"""Reads an exported .json as a foreign program would: every key, every shape."""
import json
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    data = json.load(file)
assert data["format"] == "octosurf-surfaces" and data["version"] == 1
assert data["resolution"] > 0 and data["revision"] > 0
assert len(data["surfaces"]) == int(sys.argv[2])


def is_point(point, size=3):
    return len(point) == size and all(isinstance(x, (int, float)) for x in point)


for surface in data["surfaces"]:
    assert surface["id"] > 0 and surface["inliers"] > 0 and surface["area_m2"] >= 0
    assert surface["rms_m"] >= 0 and 0 < surface["revision"] <= data["revision"]
    assert is_point(surface["color"]) and all(0 <= c <= 1 for c in surface["color"])
    normal, offset = surface["plane"]["normal"], surface["plane"]["offset"]
    assert is_point(normal) and abs(sum(x * x for x in normal) - 1) < 1e-9
    assert is_point(surface["T_map_surface"], 16) and surface["T_map_surface"][12:] == [0, 0, 0, 1]
    covariance = surface["covariance"]
    assert is_point(covariance, 9) and covariance[1] == covariance[3] and min(covariance[::4]) > 0
    assert abs(surface["offset_std_m"] ** 2 - covariance[8]) < 1e-12 and 0 < surface["normal_std_deg"] < 90
    assert isinstance(surface["parents"], list)
    rings = [ring for p in surface["polygons"] for ring in [p["outer"], *p["holes"]]]
    assert bool(rings) == (surface["area_m2"] > 0) and all(len(ring) >= 3 for ring in rings)
    for point in [p for ring in rings for p in ring] + surface["boundary"]:
        assert is_point(point)
        assert abs(sum(n * x for n, x in zip(normal, point)) - offset) < 1e-6
    for polygon in surface["polygons"]:
        labels = [polygon["outer_edges"], *polygon["hole_edges"]]
        assert [len(r) for r in labels] == [len(r) for r in [polygon["outer"], *polygon["holes"]]]
        assert {kind for ring in labels for kind in ring} <= {"real", "occluded", "sensor_limit", "frontier"}
