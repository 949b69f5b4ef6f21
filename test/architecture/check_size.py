"""The fence around the house: how many lines each room may have.

Whoever adds lines takes as many away in the same room, or raises its limit in a commit of its own that says why. A commit
that cuts lowers the limit: one that lies more than SLACK above its room fails, too. Lines are those of `wc -l` over sources.
"""

import pathlib
import sys

# Room: its folders ("-": but for this one), and its most lines.
FENCE = {
    "include": (["include"], 4_161),
    "core": (["src/core"], 22_614),
    "octomap, pcl": (["src/octomap", "src/pcl"], 635),
    "io": (["src/io"], 14_261),
    "planning": (["src/planning"], 7_760),
    "footsteps": (["src/footsteps"], 2_828),
    "apps": (["apps"], 10_138),
    "ros": (["ros"], 3_376),
    "bindings": (["bindings"], 3_246),
    "web": (["web"], 2_849),
    "lab": (["lab", "-lab/test"], 7_048),
    "tests": (["test", "lab/test"], 51_232),
}
PRODUCT = ["include", "core", "octomap, pcl", "io", "planning", "footsteps", "apps", "ros", "bindings", "web"]
SOURCES = {".cpp", ".hpp", ".py", ".js", ".mjs", ".css", ".html", ".proto", ".idl"}
NOT_OURS = {"node_modules", "__pycache__"}  # what npm and Python leave in a checkout
SLACK = 0.03  # of a limit: some commits' cuts


def lines_in(root, folders):
    count = 0
    for folder in folders:
        sign = -1 if folder.startswith("-") else 1
        for file in (root / folder.removeprefix("-")).rglob("*"):
            if file.suffix in SOURCES and not NOT_OURS & set(file.parts):
                count += sign * file.read_bytes().count(b"\n")
    return count


def problems(counts, limits):
    for room, limit in limits.items():
        if counts[room] > limit:
            yield f"{room} has {counts[room] - limit} lines more than its limit: take as many away"
        elif counts[room] < (1 - SLACK) * limit:
            yield f"{room} has shrunk: lower its limit to {counts[room]}"


def table(counts, limits):
    rows = [(room, counts[room], limit) for room, limit in limits.items()]
    rows.append(("product", sum(counts[room] for room in PRODUCT), sum(limits[room] for room in PRODUCT)))
    return "\n".join(f"{room:<14}{count:>8}{limit:>8}" for room, count, limit in [("room", "lines", "most"), *rows])


def main(root):
    limits = {room: limit for room, (_, limit) in FENCE.items()}
    counts = {room: lines_in(root, folders) for room, (folders, _) in FENCE.items()}
    found = list(problems(counts, limits))
    print(table(counts, limits), *found, sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
