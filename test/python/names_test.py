"""Python is the headers, name by name: every public type and function of include/octosurf has a Python name, or a reason."""

import os
import pathlib
import re
import unittest

import octosurf

HEADERS = pathlib.Path(os.environ["OCTOSURF_SOURCE"], "include/octosurf")
OTHERWISE = {
    **dict.fromkeys(["KeptScans", "LoadedMap", "octomap_note"], "load_map() and save_map()"),
    **dict.fromkeys(["NamedMesh", "ExportOptions", "PictureOptions", "PageMap", "PageOptions", "make_page",
                     "HeightGridOptions", "footprints", "PlannerContact", "export_nav2", "turned"],
                    "export()'s keywords"),
    **dict.fromkeys(["ParameterInfo", "get_parameter", "set_parameter", "parameter_value", "set_parameter_value"],
                    "attributes of Parameters"),
    **dict.fromkeys(["BagOptions", "SelfBox", "ScanSourceOptions"], "open_scans()'s keywords"),
    **dict.fromkeys(["SlopeLimit"], "up and max_slope_rad of each query"),
    **dict.fromkeys(["sensor_of_frame", "require_rigid"], "the module checks itself"),
    **dict.fromkeys(["up_from_surfaces", "estimate_up", "upright"], "Snapshot.up() and Mapper's up"),
    "AlignmentReach": "Parameters",
    "StampedPose": "pairs that deskew() takes",
    "RemovalLog": "Snapshot.removals",
    "digest_of": "Map.digest",
    "is_occupancy_map": "open_scans() says so",
}
TYPE = re.compile(r"^(?:struct|class) (\w+)(?: final)?(?: :[^{;]*)?\s*\{", re.MULTILINE)
FUNCTION = re.compile(r"^(?!using|return|template|#|namespace|struct|class|enum|inline constexpr|static_assert)"
                      r"(?:inline |constexpr )*[\w:]+(?:<[^;(){}]*>)?[ &*]+(\w+)\(", re.MULTILINE)


def public_names():
    for header in sorted(HEADERS.glob("*.hpp")):
        text = re.sub(r"//[^\n]*", "", header.read_text(encoding="utf-8"))
        for name in TYPE.findall(text) + FUNCTION.findall(text):
            if not name.startswith("operator") and not name.endswith("_name"):  # an enumeration's values are strings
                yield header.name, name


class Names(unittest.TestCase):
    def test_every_public_name_has_one_in_python_or_a_reason(self):
        names = dict((name, header) for header, name in public_names())
        known = set(dir(octosurf)).union(*(dir(one) for one in vars(octosurf).values() if isinstance(one, type)))
        self.assertGreater(len(names), 120)
        self.assertEqual({name: header for name, header in names.items() if name not in known and name not in OTHERWISE}, {})
        self.assertEqual([name for name in OTHERWISE if hasattr(octosurf, name) or name not in names], [], "is no reason any more")
