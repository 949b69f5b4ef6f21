"""./dev bench results: measures what the documents show, and writes it there.

Without an option every task that has not been measured at the present commit is run, in some 30 minutes. What is no matter
of time runs two at a time. docs/results.md and the README's table are then written from what was measured at this commit.
What was not is listed as such: no row of another commit is ever shown. A row's commit is the last one that touched code
(src, include, apps, lab, test, cmake), so that writing the documents does not outdate them.
"""

import argparse
import concurrent.futures
import dataclasses
import datetime
import hashlib
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import time

import bench
from bench import markdown, percent

ROOT = bench.ROOT
STORE = ROOT / "out/bench/results"
DATA = bench.DATA
CODE = ["src", "include", "apps", "lab", "test", "cmake", "CMakeLists.txt", "CMakePresets.json"]
NONE = "not measured at this commit"


@dataclasses.dataclass(frozen=True)
class Task:
    """Of a group; a timed one runs alone."""
    group: str
    title: str
    bench: str
    options: dict = dataclasses.field(default_factory=dict)
    needs: str = ""  # in ../shared/data
    seeds: bool = False  # takes --seeds
    timed: bool = False

    def measure(self, seeds):
        if self.bench == "app":
            return bench.run_app({})
        return bench.run(self.bench, bench.complete({**self.options, **({"seeds": seeds} if self.seeds else {})}))


def accuracy(title, **options):
    return Task("accuracy", title, "accuracy", {"only": ["ours/default"], **options}, seeds=True)


RED = "rgbd_7scenes_redkitchen"
SETS = {"depth": ("depth camera", {}), "depth-real": ("depth camera with a real one's faults", {"sensors": ["depth-real"]}),
        "spinning": ("spinning lidar", {"sensors": ["spinning"]}), "tilting": ("tilting laser", {"sensors": ["tilting"]}),
        "noise": ("depth camera, noise × 2", {"noise_scale": 2}),
        "drift": ("depth camera, drift of 15 mm and 0.3° a lap, two laps", {"drift_m": 0.015, "drift_deg": 0.3})}
# By name, the most telling first.
TASKS = {
    **{name: accuracy(title, **options) for name, (title, options) in SETS.items()},
    # Seed 1 as it is stands in the rows of accuracy.
    **{f"departures-{name}": Task("departures", f"departures, {title}", "departures",
                                  {"seeds": [1], "only": ["no ", "s, not"], **options}) for name, (title, options) in SETS.items()},
    "departures-1cm": Task("departures", "departures, depth camera, d = 1 cm", "departures",
                           {"seeds": [1], "resolutions": [0.01], "only": ["as it is", "no coarse"]}),
    # The paper's detector takes a third of a second a scan and more.
    "paper": Task("paper", "the paper's detector from PCL's parts and CGAL, 20 scans each", "accuracy",
                  {"only": ["ours", "cgal"], "frames": 20, "seeds": [1]}, timed=True),
    "terrain": Task("terrain", "terrain meshes, depth camera", "accuracy", {"only": ["ours/default"], "terrain": True}, "terrain_meshes"),
    "generated": Task("terrain", "generated terrains, depth camera", "accuracy", {"only": ["ours/default"], "generated": True}),
    "repeat-kitchen": Task("repeatability", "kitchen, twice", "repeatability", needs=RED),
    "repeat-hall": Task("repeatability", "hall, twice", "repeatability", {"scenes": ["hall"], "resolutions": [0.05, 0.1]},
                        "lidar_balm_realworld"),
    "kitchen-2cm": Task("kitchen", "the kitchen", "kitchen", needs=RED),
    "kitchen-1cm": Task("kitchen", "the kitchen, d = 1 cm, every third frame", "kitchen", {"resolutions": [0.01], "every": 3}, RED),
    "steadiness": Task("ground", "surfaces where nothing changed", "steadiness", needs=RED),
    "ground": Task("ground", "ground kept up", "ground", needs=RED, timed=True),
    "life": Task("life", "a month in an office", "life", timed=True),
    "table1": Task("table1", "the paper's Table I by both detectors", "table1", {"seeds": [1, 2, 3, 4, 5], "threads": os.cpu_count()}, RED,
                   timed=True),
    "speed-sides": Task("speed", "insertion, whole scans, memory and loading", "speed", needs=RED, timed=True),
    "speed-app": Task("speed", "`octosurf map`", "app", needs=RED, timed=True),
    "labelled": Task("labelled", "labelled clouds beside CGAL, PCL, Open3D and the paper's detector", "labelled", {"resolutions": [0.02]},
                     "labelled_synpeb_sample", timed=True),
    "mosd": Task("labelled", "a real table with things on it", "labelled", {"mosd": True}, "labelled_mosd"),
}
GROUPS = list(dict.fromkeys(task.group for task in TASKS.values()))


def tasks_of(names):
    """Of these groups or tasks, in the order above."""
    return {name: task for name, task in TASKS.items() if name in names or task.group in names}


# Measuring.

def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], check=True, capture_output=True, text=True).stdout.strip()


def commit_of_code():
    """`git describe` of the last commit that touched code; where the checkout differs, with how in brief."""
    name = git("describe", "--always", git("log", "-1", "--format=%H", "--", *CODE))
    changes = git("diff", "HEAD", "--", *CODE) + git("status", "--porcelain", "--", *CODE)
    return f"{name}-dirty-{hashlib.sha1(changes.encode()).hexdigest()[:7]}" if changes else name


def machine():
    found = re.search(r"^model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.MULTILINE)
    return f"{found[1] if found else platform.machine()}, {os.cpu_count()} cores"


def stored(name):
    """What was measured last; none if nothing was, or the file is damaged."""
    try:
        return json.loads((STORE / f"{name}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def is_present(record, commit):
    return record is not None and record["commit"] == commit


def busy_cores():
    """Processors that other work takes."""
    def ticks():
        spent = [int(one) for one in pathlib.Path("/proc/stat").read_text(encoding="utf-8").splitlines()[0].split()[1:9]]
        return sum(spent), spent[3] + spent[4]
    before = ticks()
    time.sleep(2)
    spent, idle = (after - earlier for after, earlier in zip(ticks(), before))
    return os.cpu_count() * (1 - idle / spent)


def wait_until_idle():
    """For a minute at most; then a time is taken nevertheless, and the documents say beside what."""
    for _ in range(30):
        if (busy := busy_cores()) < 0.2:
            break
    return busy


def run_one(name, task, seeds, commit, again):
    """Measures a task if that is missing. Returns why it was not; only a whole record is ever stored."""
    if task.needs and not (DATA / task.needs).exists():
        return f"no ../shared/data/{task.needs}"
    if is_present(stored(name), commit) and not again:
        return None
    busy = wait_until_idle() if task.timed else 0
    print(f"{name}: {task.title}" + f", beside {busy:.1f} busy cores" * (busy >= 0.2), flush=True)
    started = time.monotonic()
    try:
        content = task.measure(list(range(1, seeds + 1)))
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        print(f"  failed: {name}: {error}", flush=True)
        return str(error)
    record = {"commit": commit, "date": datetime.date.today().isoformat(), "machine": machine(), "busy": busy,
              "seconds": time.monotonic() - started, "content": content}
    STORE.mkdir(parents=True, exist_ok=True)
    temporary = STORE / f"{name}.json.part"
    temporary.write_text(json.dumps(record), encoding="utf-8")
    temporary.replace(STORE / f"{name}.json")
    return None


def run_all(tasks, seeds, commit, again=False):
    """Reasons by task for what was not measured."""
    def run(one):
        return one[0], run_one(*one, seeds, commit, again)

    reasons = [run(one) for one in tasks.items() if one[1].timed]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        reasons += pool.map(run, (one for one in tasks.items() if not one[1].timed))
    return {name: reason for name, reason in reasons if reason}


# The documents. Every number stands in a record; here they are put side by side.

def content(records, *names):
    return [row for name in names if name in records for row in records[name]["content"]]


def table(columns, *tasks):
    """A line for each row; columns are keys by title."""
    def section(records):
        rows = content(records, *tasks)
        return rows and markdown(columns, [[bench.plain(row.get(key, "")) for key in columns.values()] for row in rows])
    return section


COLUMNS = {title: cell for title, cell in bench.ACCURACY.items() if title != "ms a scan"}


def worst_scene(rows):
    """The scene with the smallest share of correct faces."""
    scenes = {scene: its for (scene,), its in bench.groups(rows, ("scene",)).items() if scene != "all"}
    name = min(scenes, key=lambda scene: bench.ratio(scenes[scene], "correct", "faces"))
    return f'{name} {bench.share("correct", "faces")(scenes[name])}'


def lines_of(groups, columns):
    return markdown(["", *columns], [[*line, *(cell(rows) for cell in columns.values())] for line, rows in groups.items()]) \
        if groups else ""


def accuracy_section(*names):
    """A line for each set."""
    def section(records):
        found = {(TASKS[name].title,): rows for name in names if (rows := content(records, name))}
        return lines_of(found, {**COLUMNS, "worst scene": worst_scene})
    return section


def departures_section(records):
    """Each over all sets."""
    columns = {title: bench.ACCURACY[title] for title in ("correct", "over/under/missed", "noise", "unsafe (worst)")}
    whole = [row | {"method": "as it is"} for row in content(records, *SETS) if row["seed"] == 1]
    found = bench.groups(whole + content(records, *(f"departures-{name}" for name in SETS)), ("method",))
    fine = bench.groups(content(records, "departures-1cm"), ("method",))
    return lines_of({**found, **{(f"d = 1 cm, depth: {method}",): rows for (method,), rows in fine.items()}}, columns)


def paper_section(records):
    columns = {title: bench.ACCURACY[title] for title in ("correct", "noise", "coverage (worst)", "unsafe (worst)", "ms a scan")}
    return lines_of(bench.groups(content(records, "paper"), ("method",)), columns)


def table1_section(records):
    """A line for each environment and resolution; in its cells the paper's figure, ours and the rebuilt detector's."""
    lines = []
    for line, rows in bench.groups(content(records, "table1"), ("environment", "resolution")).items():
        detectors = list(bench.groups(rows, ("detector",)).values())
        for cell in bench.TABLE1.values():
            pairs = [[value.partition(" ") for value in cell(its).split(", ")] for its in detectors]
            (theirs, _, unit), (ours, _, _) = pairs[0]
            slower = ", slower" if unit == "s" and float(ours) > float(theirs) else ""
            line += (f'{"/".join([theirs, *(pair[1][0] for pair in pairs)])} {unit}{slower}'.strip(),)
        lines.append(line)
    return lines and markdown(["environment", "d", *(title.partition(":")[0] for title in bench.TABLE1)], lines)


def steadiness_section(records):
    kept = [row for row in content(records, "steadiness") if row["surfaces"] == "kept"]
    return kept and markdown(["recordings", "unchanged", "came or went, worst", "got another id, worst"],
                             [[len(kept), f'{bench.add(kept, "unchanged_m2"):,.0f} m²',
                               *(percent(max(row[key] for row in kept), 2) for key in ("flipped", "renamed"))]])


def life_section(records):
    """Days 2 and 30, and what the latter is of the former."""
    columns = {"heap, MB": "heap_mb", "a scan, p50, ms": "scan_p50_ms", "p99": "scan_p99_ms", "a save, kB": "save_p50_kb", "file, MB": "file_mb"}
    first, last = ([row for row in content(records, "life") if "faces" in row] + [None, None])[:2]
    def line(row, title):
        return [title, *(bench.plain(row[key]) for key in columns.values()), f'{row["next_id"]:,}', f'{row["correct"]} of {row["faces"]}', row["noise"]]
    return first and markdown(["", *columns, "next id", "correct", "noise"], [
        line(first, "day 2"), line(last, "day 30"), ["ratio", *(f"{last[key] / first[key]:.2f}" for key in columns.values()), "", "", ""]])


def labelled_section(records):
    """A line for each method; in its cells what it found of a cloud's planes."""
    rows = content(records, "labelled")
    clouds = list(dict.fromkeys(row["cloud"] for row in rows))
    cells = {(row["method"], row["cloud"]): f'{row["correct"]} of {row["labels"]}, {row["noise"]}, {row["mean_iou"]:.3f}, '
                                            f'{row["ms"]:,.0f} ms' for row in rows}
    return rows and markdown(["correct, noise, mean IoU, time", *clouds],
                             [[method, *(cells[method, cloud] for cloud in clouds)]
                              for method in dict.fromkeys(row["method"] for row in rows)])


def sides(records):
    return bench.sides_of(content(records, "speed-sides", "speed-app"))


def mosd_section(records):
    def mean(key, scale, form):
        return lambda rows: form.format(scale * sum(row.get(key, 0) for row in rows) / len(rows))
    columns = {"frames": len, "IoU of pixels": mean("iou_pixels", 1, "{:.3f}"),
               "worst": lambda rows: f'{min(row.get("iou_pixels", 0) for row in rows):.3f}', "offset": mean("offset_m", 1000, "{:.2f} mm"),
               "angle": mean("angle_deg", 1, "{:.2f}°"),
               "behind what went, worst": lambda rows: percent(max(row["behind_what_went"] for row in rows), 2)}
    rows = content(records, "mosd")
    return rows and markdown(columns, [[cell(rows) for cell in columns.values()]])


def speed_section(records):
    found = sides(records)
    return found and markdown(*bench.speed_table(found)) + "\n" + bench.SPEED_NOTE


SECTIONS = [
    ("Simulated scenes", "accuracy", accuracy_section(*SETS),
     "Scenes `room`, `office`, `stairs`, `stones`, d = 2 cm. Faces of at least 0.05 m² seen, correct by Hoover's rule at 80 %. (Worst): "
     "of a recording. *Unsafe*: area more than 1.5 d, at least 2 cm, off what is there, or 30° aslant. Errors are of correct faces. *Seen "
     "well*: faces with readings in n voxels or more, most of them connected over gaps of at most h in a piece 8 cm wide."),
    ("Terrain meshes", "terrain", accuracy_section("terrain", "generated"),
     "Meshes that planners use, and exact steps, stairs, gaps, overhangs and rooms by `bench/terrains.py`, seen by a depth camera "
     "on a walking robot."),
    ("The same twice", "repeatability",
     table({"recording": "recording", "d": "resolution", "both saw, m²": "both_saw_m2", "agreeing": "agreeing",
            "only points": "without_surface", "empty": "seen_empty", "offset p50, mm": "offset_p50_mm", "p95": "offset_p95_mm",
            "angle p50, °": "angle_p50_deg", "p95, °": "angle_p95_deg"}, "repeat-kitchen", "repeat-hall"),
     "One map of every second scan and one of the others. Of the surfaces' area that both saw: the share where the other map has a "
     "surface within d, across and along it; where it has points only; where it has nothing."),
    ("What each departure from the paper is worth", "departures", departures_section,
     "The detector without one of them, all six sets, one seed. *s, not measured noise*: s as the paper states it gates instead of the "
     "noise that the scans show."),
    ("Beside the paper's detector and CGAL", "paper", paper_section,
     "`ours/paper` is the paper's steps from PCL's parts. CGAL gets the centroids of all scans' voxels at once, with octosurf's tolerance, "
     "angle and least size; its time is that of normals and planes. The same 20 scans of each recording. Not measured: Bonxai and "
     "wavemap, convex_plane_decomposition (no package; no labelled height maps)."),
    ("The paper's Table I", "table1", table1_section,
     "In each cell the paper's figure (8 cores, mean of five runs), ours, without the time of polygons, and that of the paper's "
     "detector rebuilt (all cores of this machine, mean of five seeds); *slower*: ours than the paper's. Not the paper's scenes: a "
     "tilting laser, increments of one second, the paper's h and r, n = 50; `real` is one recording, the kitchen, one reading in 24, "
     "its noise estimated. Lag counts from an increment's insertion."),
    ("The kitchen", "kitchen",
     table({"scans": "scans", "d": "resolution", "surfaces": "surfaces", "m²": "area_m2", "double layers": "double_layers",
            "their m²": "double_layers_m2"}, "kitchen-2cm", "kitchen-1cm"),
     "A real recording without truth. A double layer is a pair of surfaces within 15° and 5 cm that overlap by a fifth of the "
     "smaller one: a good map has none."),
    ("Surfaces where nothing changed", "ground", steadiness_section,
     "Of the area of polygons about which no voxel changed from one scan to the next: the share that came or went, and that got another "
     "id, in the worst of the recordings."),
    ("A month in an office", "life", life_section,
     "100,000 scans of a small lidar among people, doors and furniture that moves, killed and resumed each day."),
    ("Ground kept up", "ground",
     table({"scene": "scene", "scan": "insert_ms", "ground of the next snapshot": "next_ms", "a foothold": "foothold_ms",
            "a region within 2 m": "region_2m_ms", "all ground": "all_ms"}, "ground"),
     "Medians over scans, in ms."),
    ("Labelled clouds", "labelled", labelled_section,
     "All get the same voxels; the libraries' results are the best of several settings (Open3D's: of 24), octosurf has its defaults. "
     "Times are of normals and planes, octosurf's of everything."),
    ("A real table with things on it", "labelled", mosd_section,
     "Frames of mOSD: cover of the table's pixels, and error of its plane. *Behind what went*: a map of a folder's frames, nine scans of "
     "each, between which things were moved; the share of the table's pixels with a surface left in front."),
    ("Speed and memory", "speed", speed_section,
     "In one run with the other; `octosurf map` with two threads; below 1× octosurf is worse."),
]


def scores(rows):
    if not rows:
        return NONE
    seeds = len({row["seed"] for row in rows})
    return f'{bench.ACCURACY["correct"](rows)} faces correct, {percent(bench.coverage(rows))} covered, ' \
        f'{bench.share("unsafe_m2", "area_m2", 2)(rows)} unsafe ({seeds} seed{"s" if seeds > 1 else ""})'


def ten_paper(records):
    shares = {method: bench.ratio(rows, "correct", "faces") for (method,), rows in bench.groups(content(records, "paper"), ("method",)).items()}
    theirs = [value for method, value in shares.items() if method.startswith("ours/paper")]
    return f'{percent(shares["ours/default"])} of faces correct; the paper\'s {percent(max(theirs))} at best' if theirs else NONE


def ten_labelled(records):
    parts = []
    for rows in bench.groups([row for row in content(records, "labelled") if row["resolution"] == 0.02], ("cloud",)).values():
        ours = next(row for row in rows if row["method"] == "octosurf")
        best = max((row for row in rows if row["settings"]), key=lambda row: row["correct"])
        parts.append(f'{ours["correct"]} of {ours["labels"]}, {best["method"]} {best["correct"]}')
    return "; ".join(parts) or NONE


def ten_speed(records, say, *names):
    found = sides(records)
    return say(*(found[name] for name in names)) if all(name in found for name in names) else NONE


def ten(records):
    kitchen = content(records, "kitchen-2cm")
    return [
        ("simulated depth camera", scores(content(records, "depth"))),
        ("with a real camera's faults", scores(content(records, "depth-real"))),
        ("simulated spinning lidar", scores(content(records, "spinning"))),
        ("terrain meshes, depth camera", scores(content(records, "terrain"))),
        ("generated terrains, depth camera", scores(content(records, "generated"))),
        ("real kitchen mapped twice", "; ".join(f'{percent(row["agreeing"])} of the area within d, offsets p95 {row["offset_p95_mm"]:.1f} mm'
                                                for row in content(records, "repeat-kitchen")) or NONE),
        ("beside the paper's detector from PCL's parts", ten_paper(records)),
        ("planes of two labelled clouds", ten_labelled(records)),
        ("real kitchen", "{surfaces} surfaces, {double_layers} double layers in {scans} scans".format(**kitchen[0]) if kitchen else NONE),
        ("a scan of it, one thread",
         ten_speed(records, lambda ours, theirs: f'{bench.short(ours["ms"])} ms; OctoMap\'s insertion alone {bench.short(theirs["ms"])} ms',
                   "kitchen/d:0.02/mapper", "kitchen/d:0.02/octomap")),
        ("heap per octree leaf",
         ten_speed(records, lambda *both: "{:.1f} B; OctoMap's pruned tree {:.1f} B".format(*bench.heap_per_leaf(*both)),
                   "kitchen/d:0.02/occupancy", "kitchen/d:0.02/octomap")),
        ("kitchen live, 30 scans a second, two threads", ten_speed(records, bench.lag, "realtime/d:0.02")),
    ]


def document(records, commit, reasons):
    """The whole of docs/results.md."""
    parts = ["# What was measured", "",
             f"Written by `./dev bench results` at commit **{commit}**: every number was measured at that commit; what was not is "
             "listed last. `--only GROUP` measures a part.", "",
             "## In short", "", markdown(["what", "result"], ten(records))]
    for title, group, section, text in SECTIONS:
        busy = [record["busy"] for name, record in records.items() if TASKS[name].group == group and TASKS[name].timed]
        beside = f" Times beside {max(busy):.1f} busy cores." if busy and max(busy) >= 0.2 else ""
        parts += [f"## {title}", "", f"{text}{beside}", "", section(records) or f"{NONE.capitalize()}.\n"]
    parts += ["## When and where", ""]
    for place in dict.fromkeys(f'{record["machine"]}, {record["date"]}' for record in records.values()):
        parts.append(f"- {place}. Idle, but where a section says otherwise.")
    missing = "; ".join(f"`{name}`" + (f": {reason}" if reason != NONE else "") for name, reason in reasons.items())
    parts += [*([f"\nNot measured at this commit: {missing}."] if missing else []), ""]
    return "\n".join(parts)


def put_between(file, mark, text):
    """Replaces what stands between <!-- mark --> and <!-- /mark -->."""
    old = file.read_text(encoding="utf-8")
    pattern = re.compile(rf"(<!-- {mark} -->\n).*?(<!-- /{mark} -->)", re.DOTALL)
    if not pattern.search(old):
        sys.exit(f"{file}: has no marks <!-- {mark} --> and <!-- /{mark} -->")
    file.write_text(pattern.sub(lambda match: match[1] + text + match[2], old), encoding="utf-8")


def write_documents(commit, reasons):
    records = {name: record for name in TASKS if is_present(record := stored(name), commit)}
    reasons = {name: reasons.get(name, NONE) for name in TASKS if name not in records}
    (ROOT / "docs/results.md").write_text(document(records, commit, reasons), encoding="utf-8")
    put_between(ROOT / "README.md", "results", f"At d = 2 cm, commit {commit}; [all figures](docs/results.md).\n\n"
                + markdown(["what", "result"], ten(records)))
    print(f"wrote docs/results.md and README.md: {len(records)} of {len(TASKS)} tasks at {commit}")


def main(arguments):
    parser = argparse.ArgumentParser(prog="./dev bench results", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(GROUPS), help="groups or tasks, with commas: " + ", ".join([*GROUPS, *TASKS]))
    parser.add_argument("--seeds", type=int, default=3, help="of the simulated rows [%(default)s]")
    parser.add_argument("--again", action="store_true", help="measure also what was measured at this commit")
    parser.add_argument("--write", action="store_true", help="measure nothing, write what there is")
    options = parser.parse_args(arguments)
    tasks = tasks_of(options.only.split(","))
    if not tasks:
        parser.error(f"--only {options.only}: no such group or task")
    commit = commit_of_code()
    write_documents(commit, {} if options.write else run_all(tasks, options.seeds, commit, options.again))
