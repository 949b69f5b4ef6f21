#!/usr/bin/env python3
"""Runs octosurf_bench, adds up the rows that it writes, and shows them: bench.py NAME [OPTIONS]."""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import terrains

GENERATED = tempfile.TemporaryDirectory(prefix="octosurf-terrains-")
ROOT = pathlib.Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared/data"
KITCHEN = DATA / "rgbd_7scenes_redkitchen"
HALL = DATA / "lidar_hall_live"
OUTSIDE_PROGRAM = pathlib.Path(__file__).with_name("outside.py")
PROGRAM = ROOT / "build/release/bench/octosurf_bench"
APP = ROOT / "build/release/bin/octosurf"


# Cells: each is a function of the rows that a line adds up.

def add(rows, key):
    return sum(row.get(key, 0) for row in rows)


def total(*keys):
    return lambda rows: "/".join(f"{add(rows, key):.0f}" for key in keys)


def most(key, digits):
    return lambda rows: f"{max((row[key] for row in rows if key in row), default=0):.{digits}f}"


def percent(value, digits=1):
    return f"{100 * value:.{digits}f} %"


def ratio(rows, part, whole):
    return add(rows, part) / (add(rows, whole) or 1)


def share(part, whole, digits=1):
    return lambda rows: percent(ratio(rows, part, whole), digits)


def mean(rows, key):
    """Of summaries, over all that they count."""
    return sum(row[key]["mean"] * row[key]["count"] for row in rows) / (sum(row[key]["count"] for row in rows) or 1)


def coverage(rows):
    return sum(row["coverage"] * row["visible_m2"] for row in rows) / (add(rows, "visible_m2") or 1)


ACCURACY = {
    "correct": lambda rows: f'{share("correct", "faces")(rows)} of {add(rows, "faces")}',
    "over/under/missed": total("over_segmented", "under_segmented", "missed"),
    "noise": total("noise"),
    "coverage (worst)": lambda rows: f'{percent(coverage(rows))} ({percent(min(row["coverage"] for row in rows))})',
    "unsafe (worst)": lambda rows: f'{share("unsafe_m2", "area_m2", 2)(rows)} '
                                   f'({percent(max(row["unsafe_share"] for row in rows), 2)})',
    "normal mean/max": lambda rows: f'{mean(rows, "normal_deg"):.2f}°/{max(row["normal_deg"]["max"] for row in rows):.1f}°',
    "offset": lambda rows: f'{1000 * mean(rows, "offset_m"):.2f} mm',
    "seen well": lambda rows: f'{share("seen_well_correct", "seen_well")(rows)} of {add(rows, "seen_well")}',
    "ms a scan": lambda rows: f'{ratio(rows, "ms", "scans"):.1f}',
}

PAPER = {("simple", 0.02): (4900, 1.02, 0.305, 96.0), ("simple", 0.01): (8000, 0.221, 0.468, 93.0),
         ("complex", 0.02): (4100, 1.01, 0.151, 90.4), ("complex", 0.01): (6900, 0.512, 0.399, 91.3),
         ("real", 0.02): (12000, 1.41, 1.59, 78.2), ("real", 0.01): (19000, 1.94, 3.04, 72.3)}


def beside_paper(column, key, form):
    """The paper's Table I (a laser, 8 cores at 3.4 GHz), and the mean of ours; NaN where one is not defined."""
    def cell(rows):
        theirs = PAPER.get((rows[0]["environment"], rows[0]["resolution"]))
        values = [float("nan") if row[key] is None else row[key] for row in rows]
        return f'{form.format(theirs[column]) if theirs else "–"}, {form.format(statistics.fmean(values))}'
    return cell


TABLE1 = {"points per second: paper, here": beside_paper(0, "points_per_second", "{:,.0f}"),
          "first detection": beside_paper(1, "time_to_first_detection_s", "{:.3f} s"),
          "mean lag": beside_paper(2, "detection_lag_s", "{:.3f} s"),
          "categorised": beside_paper(3, "categorized_percent", "{:.1f} %")}

FOOTHOLDS = {"accepted": total("accepted"), "off > 1 cm": total("off_1cm"), "of it": share("off_1cm", "accepted", 2),
             "off > 2 cm": total("off_2cm"), "false": total("false"), "room unseen": total("room_unseen"), "good ones": total("good"),
             "of them accepted": share("good_accepted", "good"), "p50 µs": most("p50_us", 1), "p99 µs": most("p99_us", 1)}


# By name: what names a line, its cells (none: all that a row has), defaults, and what is to be said.
OUTSIDE = {
    "correct": ACCURACY["correct"],
    "covered": share("covered_m2", "seen_m2"),
    "unsafe": share("unsafe_m2", "area_m2", 2),
    "voids covered: as mapped, ground": lambda rows: f'{share("void_mapped_m2", "void_m2")(rows)}, {share("void_ground_m2", "void_m2", 2)(rows)}',
    "ground off": share("off_m2", "ground_m2", 2),
    "stairs": lambda rows: f'{add(rows, "stairs")} of {add(rows, "stairs_true")}, {most("stair_error_mm", 1)(rows)} mm',
    "rays off": total("rays_off"),
    "our evaluation": lambda rows: f'{share("lab_correct", "lab_faces")(rows)} of {add(rows, "lab_faces")}, {share("lab_unsafe_m2", "area_m2", 2)(rows)}',
}

BENCHES = {
    "accuracy": (("sensor", "scene", "method"), ACCURACY, {"seeds": [1, 2, 3, 4, 5]},
                 "Faces with at least 0.05 m² visible. Unsafe is off what is there; errors are of correct faces."),
    "departures": (("method",), ACCURACY, {}, "As accuracy, each without one thing that the paper does not do, or does otherwise."),
    "footholds": (("scene", "foot", "margin_m"), FOOTHOLDS, {"count": 10000},
                  "Accepted of random ones in the surfaces' hulls; off: a part lies over what is no true surface, by more than that "
                  "(false: 5 cm). Good ones: on true faces, with 1 cm to spare and room over them, and seen; room unseen: not those because of "
                  "what is low over them."),
    "ground": ((), None, {"scenes": ["office", "corridor"], "every": 3, "frames": 120},
               "Medians over scans: ground kept up (next), a foothold in a new snapshot and once more, a region within 2 m of the sensor, "
               "all ground read."),
    "kitchen": ((), None, {}, "A real recording without truth: double layers must not be in its map."),
    "labelled": ((), None, {"resolutions": [0.02, 0.01]},
                 "The others have the best of several settings, octosurf and the paper's detector their own."),
    "outside": (("sensor", "scene", "by"), OUTSIDE,
                {"scenes": ["stairs", "stones", "office", "moving"], "sensors": ["depth", "spinning"], "seeds": [1], "frames": 60},
                "Scores by MuJoCo's geometry, of maps of our simulator's recordings and of what MuJoCo sees from the same poses. Ground off: "
                "by more than 1 cm; rays off: of both by more than 6 sigma; ours: correct and unsafe by lab/evaluation."),
    "repeatability": ((), None, {"scenes": ["kitchen"]},
                      "Maps of every second scan, and of the others, of kitchen or hall (or folders): of what both have seen, the share "
                      "of the surfaces' area where the other has one within d, across and along it; where it has points only, where nothing."),
    "life": ((), None, {"count": 100000, "resolutions": [0.04]},
             "A month of a robot's rounds through an office, killed once a day: what a day, and by its end."),
    "steadiness": ((), None, {"scenes": ["office", "room", "change", "stairs", "stones"], "every": 4, "frames": 60},
                   "Of the area of polygons about which the octree did not change from one scan to the next: what came or went, and "
                   "what got another id."),
    "table1": (("environment", "resolution", "detector"), TABLE1,
               {"scenes": ["simple", "complex", "real"], "sensors": ["tilting"], "seeds": [1, 2, 3, 4, 5],
                "resolutions": [0.02, 0.01], "only": ["likelihood", "paper"]},
               "The paper: a laser and 8 cores. Here: the paper's parameters, increments of one second."),
}


def markdown(header, rows, padded=False):
    cells = [list(header), *([str(cell) for cell in row] for row in rows)]
    if padded:
        widths = [max(map(len, column)) for column in zip(*cells)]
        cells = [[cell.ljust(width) for cell, width in zip(row, widths)] for row in cells]
    lines = ["| " + " | ".join(row) + " |" for row in cells]
    return "\n".join([lines[0], "|" + "---|" * len(header), *lines[1:]]) + "\n"


def groups(rows, by):
    """Rows by what names their line, and of all scenes together last."""
    found = {}
    for row in rows:
        found.setdefault(tuple(row.get(key, "") for key in by), []).append(row)
    if "scene" in by and len({row["scene"] for row in rows}) > 1:
        for row in rows:
            found.setdefault(tuple("all" if key == "scene" else row.get(key, "") for key in by), []).append(row)
    return found


def plain(value):
    if isinstance(value, dict):
        return ", ".join(f"{key} {plain(one)}" for key, one in value.items())
    return f"{value:,.4g}" if isinstance(value, float) and value < 1000 else f"{value:.0f}" if isinstance(value, float) else str(value)


def table_of(name, rows):
    by, columns, _, _ = BENCHES[name]
    if not columns:
        keys = list(dict.fromkeys(key for row in rows for key in row))
        return keys, [[plain(row.get(key, "")) for key in keys] for row in rows]
    return [*by, *columns], [[*name, *(cell(lines) for cell in columns.values())] for name, lines in groups(rows, by).items()]


# Measuring.

def run(name, options=None, quiet=True):
    """The rows that octosurf_bench writes; what goes wrong is a ChildProcessError."""
    options = {**(BENCHES[name][2] if name in BENCHES else {}), **(options or {})}
    program = [sys.executable, OUTSIDE_PROGRAM] if name == "outside" else [PROGRAM, name]
    done = subprocess.run([*program, json.dumps(options)], stdout=subprocess.PIPE, text=True, check=False,
                          stderr=subprocess.PIPE if quiet else None)
    if done.returncode != 0:
        lines = (done.stderr or "").strip().splitlines() or ["no message"]
        raise ChildProcessError(f"{name} {json.dumps(options)}: exit code {done.returncode}: {lines[-1]}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def run_app(options):
    """`octosurf map` with two threads, from files to files and live at 30 Hz, as rows of speed."""
    rows = []
    first = ["--threads", "2", "--first", "30" if options.get("brief") else "120"]
    hall = ["--poses", HALL / "poses.txt", "--realtime", "--threads"]
    runs = {f"{name}/d:{d}": [KITCHEN, "--resolution", str(d), *first, *more] for d in (0.02, 0.01)
            for name, more in (("app", []), ("realtime", ["--realtime"]))}
    if HALL.exists():
        runs |= {f"lidar live/{n}": [HALL / "scans", "--resolution", "0.05", *hall, str(n)] for n in (1, 2)}
    for name, arguments in runs.items():
        with tempfile.TemporaryDirectory() as folder:
            report = f"{folder}/report.json"
            subprocess.run([APP, "map", *arguments, "-o", f"{folder}/map", "--report", report], check=True, stdout=subprocess.DEVNULL)
            rows.append({"name": name, **json.loads(pathlib.Path(report).read_text(encoding="utf-8"))})
    return rows


# Speed beside OctoMap: sides whose names have the same path do the same work on the same scans.

OURS = ("occupancy", "plain", "mapper", "load_map")
SPEED_NOTE = ("Means over scans, in one process on the same scans read before; of three passes in random order the median ± coefficient of "
              "variation. OctoMap's insertion: `insertPointCloud`, lazy and discretised, then `updateInnerOccupancy`.\n")


def sides_of(rows):
    """The first row of each side, with the median of its passes and their coefficient of variation."""
    passes = {}
    for row in rows:
        passes.setdefault(row["name"], []).append(row)
    for name, found in passes.items():
        ms = [row["ms"] for row in found if "ms" in row]
        passes[name] = dict(found[0])
        if ms:
            passes[name]["ms"] = statistics.median(ms)
        if len(ms) > 1:
            passes[name]["cv"] = statistics.stdev(ms) / statistics.fmean(ms)
    return passes


def short(value):
    """Three significant digits, at most two decimals, thousands separated."""
    return f"{value:,.{max(0, 3 - len(str(int(abs(value)))))}f}"


def heap_per_leaf(ours, theirs):
    """Bytes. The same occupancy, so the same leaves: OctoMap's count is both sides' divisor."""
    return ours["heap_bytes"] / theirs["leaves"], theirs["heap_bytes"] / theirs["leaves"]


def speed_table(sides):
    """Header and lines."""
    lines = []
    for name, ours in sorted(sides.items()):
        path, _, side = name.rpartition("/")
        if path == "app":
            rate = ours["scans"] / ours["wall_s"]
            lines.append([f"`octosurf map`, kitchen, {side}", "the camera", f"{rate:.1f} frames/s", "30 frames/s",
                          f"{short(rate / 30)}×", f'p50 {short(ours["scan_ms"]["p50"])} ms, p95 {short(ours["scan_ms"]["p95"])} ms; '
                          f'at most {ours["peak_rss_mb"]:,.0f} MB'])
        elif path == "lidar live":
            lines.append([f"`octosurf map --realtime`, a real lidar's 40 scans, 5 cm, {side} threads", "the lidar",
                          f'{ours["wall_s"]:.1f} s', "19.5 s", f'{short(19.5 / ours["wall_s"])}×', lag(ours)])
        elif path == "realtime":
            paper = PAPER["real", float(side[2:])]
            lines.append([f"`octosurf map --realtime`, kitchen, {side}", "the paper's Table I",
                          f'{1000 * ours["time_to_first_detection_s"]:.0f} ms, {1000 * ours["detection_lag_s"]["mean"]:.0f} ms',
                          f"{1000 * paper[1]:,.0f} ms, {1000 * paper[2]:,.0f} ms", "", lag(ours)])
        if side not in OURS:
            continue
        for other, theirs in sides.items():
            if other.rpartition("/")[0] != path or other.rpartition("/")[2] in OURS:
                continue
            times = [f'{short(one["ms"])} ms' + (f' ± {100 * one["cv"]:.0f} %' if "cv" in one else "") for one in (ours, theirs)]
            lines.append([ours["label"], theirs["label"], *times, f'{short(theirs["ms"] / ours["ms"])}×',
                          f'p95 {short(ours["p95_ms"])} ms' if "stage_ms" in ours else ""])
            if "tree_bytes" in ours:
                mine, least = heap_per_leaf(ours, theirs)
                lines.append([ours["label"].replace("occupancy insertion", "heap per octree leaf"), "OctoMap's pruned tree",
                              f"{mine:.1f} B", f"{least:.1f} B", f"{short(least / mine)}×",
                              f'the tree alone {ours["tree_bytes"] / theirs["leaves"]:.1f} B'])
    return ["what", "against", "octosurf", "the other", "times better", "beside it"], lines


def lag(report):
    return f'lag p50 {1000 * report["detection_lag_s"]["p50"]:.0f} ms, p95 {1000 * report["detection_lag_s"]["p95"]:.0f} ms; ' \
        f'{report["categorized_percent"]:.1f} % of points categorised'


# The command line.

# Each option's kind, in a list where there may be several; and what it says.
OPTIONS = {
    "scenes": ([str], "names; also of meshes of ../shared/data/terrain_meshes, or files of meshes; rows of table1"),
    "sensors": ([str], "depth, depth-real, tilting, spinning"), "seeds": ([int], ""), "resolutions": ([float], "d, m"),
    "only": ([str], "methods by how they begin (ours/default, ours/paper, cgal); of labelled: growing, pcl, ransac, open3d, paper, none; "
                    "of table1: likelihood, paper; of speed: regular expressions"),
    "inputs": ([str], "recordings or labelled clouds in place of those of ../shared/data"),
    "set": ([str], "NAME=VALUE, parameters of ours"), "count": (int, "of footholds"),
    "frames": (int, "scans at most"), "every": (int, "every k-th scan of a real recording"),
    "octomap_every": (int, "OctoMap inserts every k-th of kitchen's scans, in turn with ours"),
    "noise_scale": (float, "times the sensor's noise"), "drift_m": (float, "m a lap by which the poses slide away, in two laps"),
    "drift_deg": (float, "degrees a lap by which they turn"), "laps": (int, "times the path is walked"), "threads": (int, ""),
    "terrain": (bool, "the meshes of ../shared/data/terrain_meshes as scenes"), "generated": (bool, "those of terrains.py, seeds 1 and 2"),
    "brief": (bool, "few scans each"),
    "mosd": (bool, "labelled: the supporting table of mOSD's frames"),
    "json": (pathlib.Path, "write the rows there")}


def options_of(name, arguments):
    what, defaults = (BENCHES[name][3], BENCHES[name][2]) if name in BENCHES else (SPEED_NOTE, {})
    parser = argparse.ArgumentParser(prog=f"./dev bench {name}", description=what)
    for option, (kind, text) in OPTIONS.items():
        given = {"action": "store_true"} if kind is bool else {"type": kind}
        if isinstance(kind, list):
            given = {"type": lambda values, kind=kind[0]: [kind(one) for one in values.split(",")]}
        parser.add_argument("--" + option.replace("_", "-"), help=f"{text} [{defaults[option]}]" if option in defaults else text, **given)
    return {key: value for key, value in vars(parser.parse_args(arguments)).items() if value not in (None, False)}


def complete(options):
    """What follows from the other options: drift shows in what is visited again only."""
    if options.pop("terrain", False):
        options = {"seeds": [1], **options, "scenes": terrain()}
    if options.pop("generated", False):
        options = {"frames": 200, "seeds": [1], **options, "scenes": list(map(str, terrains.write(GENERATED.name, (1, 2))))}
    if options.get("drift_m") or options.get("drift_deg"):
        options = {"laps": 2, **options}
    return options


def terrain():
    return sorted(mesh.stem for mesh in (DATA / "terrain_meshes").glob("*.stl"))


def bench(name, options):
    """Prints a table."""
    file = options.pop("json", None)
    options = complete(options)
    if name in ("speed", "app"):
        rows = ([] if name == "app" else run("speed", options, quiet=False)) + run_app(options)
        text = markdown(*speed_table(sides_of(rows)), padded=True) + "\n" + SPEED_NOTE
    else:
        rows = run(name, options, quiet=False)
        text = f"{BENCHES[name][3]}\n\n{markdown(*table_of(name, rows), padded=True)}" if rows else "Nothing was measured."
    if file:
        file.write_text(json.dumps(rows) + "\n", encoding="utf-8")
    print(text)


def main():
    name, arguments = (sys.argv[1] if len(sys.argv) > 1 else ""), sys.argv[2:]
    if name == "gate":
        import gate
        gate.main(arguments)
    elif name == "results":
        import results
        results.main(arguments)
    elif name == "":
        if KITCHEN.is_dir():
            bench("speed", {"brief": True})
        bench("table1", {"seeds": [1], **({} if KITCHEN.is_dir() else {"scenes": ["simple", "complex"]})})
        bench("accuracy", {"seeds": [1], "frames": 20})
    elif name in (*BENCHES, "speed", "app"):
        bench(name, options_of(name, arguments))
    else:
        sys.exit(f"no benchmark {name!r}; there are {', '.join([*BENCHES, 'speed', 'app', 'results'])}")


if __name__ == "__main__":
    try:
        main()
    except ChildProcessError as error:
        sys.exit(str(error))
