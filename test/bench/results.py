"""./dev bench results: measures what the documents show, and writes it there.

Without an option every task that has not been measured at the present commit is run, in some 45 minutes; long ones run
where --only names them. What is no matter of time runs two at a time. docs/results.md and the README's table are then written from what was measured at this
commit. What was not is listed as such: no row of another commit is ever shown. A row's commit is the last one that touched code (src, include, apps, lab, test,
cmake), so that writing the documents does not outdate them.
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
import sheet
from bench import markdown, percent

ROOT = bench.ROOT
STORE = ROOT / "out/bench/results"
DATA = bench.DATA
CODE = ["src", "include", "apps", "lab", "test", "cmake", "CMakeLists.txt", "CMakePresets.json"]
NONE = "not measured at this commit"


@dataclasses.dataclass(frozen=True)
class Task:
    """Of a group; a long one runs only if it is named, a timed one alone."""
    group: str
    title: str
    bench: str
    options: dict = dataclasses.field(default_factory=dict)
    needs: str = ""  # in ../shared/data
    seeds: bool = False  # takes --seeds
    long: bool = False
    timed: bool = False

    def measure(self, seeds):
        if self.bench == "app":
            return bench.run_app({})
        return bench.run(self.bench, bench.complete({**self.options, **({"seeds": seeds} if self.seeds else {})}))


def accuracy(title, long=False, **options):
    return Task("accuracy", title, "accuracy", {"only": ["ours/default"], "outlines": True, **options}, seeds=True, long=long)


RED = "rgbd_7scenes_redkitchen"
SETS = {"depth": ("depth camera", {}), "depth-real": ("depth camera with a real one's faults", {"sensors": ["depth-real"]}),
        "spinning": ("spinning lidar", {"sensors": ["spinning"]}), "tilting": ("tilting laser", {"sensors": ["tilting"]}),
        "noise": ("depth camera, noise × 2", {"noise_scale": 2}),
        "drift": ("depth camera, drift of 15 mm and 0.3° a lap, two laps", {"drift_m": 0.015, "drift_deg": 0.3})}
# By name, the most telling first.
TASKS = {
    **{name: accuracy(title, **options) for name, (title, options) in SETS.items()},
    "depth-1cm": accuracy("depth camera, d = 1 cm", resolutions=[0.01], long=True),
    **{f"departures-{name}": Task("departures", f"departures, {title}", "departures", {"seeds": [1], **options})
       for name, (title, options) in SETS.items()},
    "departures-1cm": Task("departures", "departures, depth camera, d = 1 cm", "departures",
                           {"seeds": [1], "resolutions": [0.01], "only": ["as it is", "no coarse"]}),
    # The paper's detector takes a third of a second a scan and more.
    "paper": Task("paper", "the paper's detector from PCL's parts and CGAL, 20 scans each", "accuracy",
                  {"only": ["ours", "cgal"], "frames": 20}, seeds=True, timed=True),
    "terrain": Task("terrain", "terrain meshes, depth camera", "accuracy", {"only": ["ours/default"], "terrain": True}, "terrain_meshes"),
    "generated": Task("terrain", "generated terrains, depth camera", "accuracy", {"only": ["ours/default"], "generated": True}),
    "repeat-kitchen": Task("repeatability", "kitchen, twice", "repeatability", needs=RED),
    "repeat-hall": Task("repeatability", "hall, twice", "repeatability", {"scenes": ["hall"], "resolutions": [0.05, 0.1]},
                        "lidar_balm_realworld"),
    "kitchen-2cm": Task("kitchen", "the kitchen", "kitchen", needs=RED),
    "kitchen-1cm": Task("kitchen", "the kitchen, d = 1 cm, every third frame", "kitchen", {"resolutions": [0.01], "every": 3}, RED),
    "steadiness": Task("ground", "surfaces where nothing changed", "steadiness", needs=RED),
    "ground": Task("ground", "ground kept up", "ground", needs=RED, timed=True),
    "table1": Task("table1", "the paper's Table I by both detectors", "table1", {"seeds": [1]}, RED, timed=True),
    "speed-sides": Task("speed", "insertion, whole scans, memory and loading", "speed", needs=RED, timed=True),
    "speed-app": Task("speed", "`octosurf map`", "app", needs=RED, timed=True),
    "labelled": Task("labelled", "labelled clouds beside CGAL and the paper's detector", "labelled", {"resolutions": [0.02]},
                     "labelled_synpeb_sample", timed=True),
    "mosd": Task("labelled", "a real table with things on it", "labelled", {"mosd": True}, "labelled_mosd"),
}
GROUPS = list(dict.fromkeys(task.group for task in TASKS.values()))


def tasks_of(names):
    """Of these groups or tasks, in the order above; of a group's the long ones only by their own name."""
    return {name: task for name, task in TASKS.items() if name in names or (task.group in names and not task.long)}


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


def run_one(name, task, seeds, commit, again):
    """Measures a task if that is missing. Returns why it was not; only a whole record is ever stored."""
    if task.needs and not (DATA / task.needs).exists():
        return f"no ../shared/data/{task.needs}"
    if is_present(stored(name), commit) and not again:
        return None
    print(f"{name}: {task.title}", flush=True)
    started = time.monotonic()
    try:
        content = task.measure(list(range(1, seeds + 1)))
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        print(f"  failed: {name}: {error}", flush=True)
        return str(error)
    record = {"commit": commit, "date": datetime.date.today().isoformat(), "machine": machine(), "load": os.getloadavg()[0],
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


def table(benchmark, *tasks, folded=""):
    def section(records):
        rows = content(records, *tasks)
        text = markdown(*bench.table_of(benchmark, rows)) if rows else ""
        return details(folded, text) if text and folded else text
    return section


HIDDEN = ("layers", "off by 1 cm, 1.5 cm; false", "all faces", "ms a scan")
COLUMNS = {title: cell for title, cell in bench.ACCURACY.items() if title not in HIDDEN}


def details(summary, text):
    """Shown where it is clicked on."""
    return f"\n<details><summary>{summary}</summary>\n\n{text}\n</details>\n"


def lines_of(groups, columns, *header):
    return markdown([*header, *columns], [[*line, *(cell(rows) for cell in columns.values())] for line, rows in groups.items()]) \
        if groups else ""


def accuracy_section(records):
    """A line for each set, and folded away a line for each of its scenes, and its worst faces."""
    names = [name for name in SETS if name in records]
    text = lines_of({(TASKS[name].title,): content(records, name) for name in names}, COLUMNS, "")
    scenes = {(name, scene): rows for name in names for (scene,), rows in bench.groups(content(records, name), ("scene",)).items()
              if scene != "all"}
    pictures = "\n".join(f"![{TASKS[name].title}: the ten worst faces](worst/{name}.svg)\n" for name in names)
    return text and text + details("By scene: faces", lines_of(scenes, COLUMNS, "", "scene")) + details("The ten worst faces of each", pictures)


def terrain_section(records):
    found = {(TASKS[name].title,): rows for name in ("terrain", "generated") if (rows := content(records, name))}
    scenes = {line: rows for name in ("terrain", "generated") for line, rows in bench.groups(content(records, name), ("scene",)).items()
              if line != ("all",)}
    return found and lines_of(found, COLUMNS, "") + details("By mesh", lines_of(scenes, COLUMNS, "mesh"))


def departures_section(records):
    """Each over all sets, and by set; time is that of the same recordings as it is."""
    columns = {title: bench.ACCURACY[title] for title in ("correct", "seen well", "over/under/missed", "noise", "unsafe (worst)")}

    def table_of(names):
        rows = content(records, *names)
        usual = [row for row in rows if row["method"] == "as it is"]
        time_of = {"time": lambda its: f'{bench.add(its, "ms") / (bench.add(usual, "ms") or 1):.2f}'}
        return lines_of(bench.groups(rows, ("method",)), {**columns, **time_of}, "")
    sets = {name: content(records, f"departures-{name}") for name in SETS if f"departures-{name}" in records}
    by_set = {name: dict(bench.groups(rows, ("method",))) for name, rows in sets.items()}
    methods = dict.fromkeys(method for groups in by_set.values() for method in groups)
    cells = [[*method, *(f'{bench.add(rows, "correct")} of {bench.add(rows, "faces")}, {bench.add(rows, "noise")}, '
                         f'{bench.share("unsafe_m2", "area_m2", 2)(rows)}' for groups in by_set.values() if (rows := groups.get(method)))]
             for method in methods]
    fine = "".join(f"| d = 1 cm, depth: {line[2:]}\n" for line in table_of(["departures-1cm"]).splitlines()[2:])
    return table_of([f"departures-{name}" for name in sets]) + fine \
        + (cells and details("By set: correct, noise, unsafe", markdown(["", *sets], cells)) or "")


def table1_section(records):
    """A line for each environment and resolution, in its cells the paper's figure, that of ours and that of the paper's detector."""
    lines = []
    for line, rows in bench.groups(content(records, "table1"), ("environment", "resolution")).items():
        detectors = [[cell(its) for cell in bench.TABLE1.values()] for its in bench.groups(rows, ("detector",)).values()]
        lines.append([line[0], line[1], *(" / ".join([cells[0], *(cell.rpartition(", ")[2] for cell in cells[1:])]).replace(", ", " / ")
                                          for cells in zip(*detectors))])
    return lines and markdown(["environment", "d", *(title.partition(":")[0] for title in bench.TABLE1)], lines)


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
    return rows and lines_of({(): rows}, columns)


def speed_section(records):
    found = sides(records)
    if not found:
        return ""
    header, lines = bench.speed_table(found)
    besides = [line for line in lines if re.search("heap|loading|plain", line[0])]
    return markdown(header, [line for line in lines if line not in besides]) + "\n" + bench.SPEED_NOTE \
        + details("Memory, loading, a plain octree", markdown(header, besides))


SECTIONS = [
    ("Simulated scenes", "accuracy", accuracy_section,
     "Scenes `room`, `office`, `stairs`, `stones`, d = 2 cm. Faces of at least 0.05 m² seen; a face is correct by Hoover's rule at "
     "80 %. *Worst* is the worst recording. *Unsafe* is area farther than 1.5 d, at least 2 cm, off what is there, or 30° aslant. Errors "
     "are over correct faces. *Seen well* are faces with readings in n voxels or more, most of them together by gaps of at most h in a "
     "piece 8 cm wide."),
    ("Terrain meshes", "terrain", terrain_section,
     "Meshes that planners use, and steps, stairs, gaps, overhangs and rooms by `test/bench/terrains.py`, exact by construction, seen by "
     "a depth camera as a walking robot would."),
    ("The same twice", "repeatability", table("repeatability", "repeat-kitchen", "repeat-hall"), bench.BENCHES["repeatability"][3]),
    ("What each departure from the paper is worth", "departures", departures_section,
     "The detector without one of them, all six sets, one seed. *s, not measured noise*: s as the paper states it gates instead of the "
     "noise that the scans show. *Owned points stay*: detection takes pending points only. *Time*: times that of the same scans as it is."),
    ("Beside the paper's detector and CGAL", "paper",
     lambda records: lines_of(bench.groups(content(records, "paper"), ("method",)), {**COLUMNS, "ms a scan": bench.ACCURACY["ms a scan"]}, ""),
     "`paper` is the paper's steps from PCL's parts. CGAL gets the centroids of all scans' voxels at once and octosurf's tolerance, "
     "angle and least size; its time is that of normals and planes. The same 20 scans of each recording. Bonxai and wavemap are in no "
     "package of Debian, and convex_plane_decomposition publishes no labelled height maps: not measured."),
    ("The paper's Table I", "table1", table1_section,
     "In each cell the paper's figure (8 cores), ours and that of the paper's detector rebuilt (one thread, in seconds of CPU). A tilting "
     "laser, data in increments of one second, the paper's parameters; "
     "`real` is the kitchen, one reading in 24. Lag counts from when an increment is handed over."),
    ("The kitchen", "kitchen", table("kitchen", "kitchen-2cm", "kitchen-1cm"),
     "A real recording without truth. A double layer is a pair of surfaces within 15° and 5 cm that overlap by a fifth of the "
     "smaller one: on a good map there is none."),
    ("Surfaces where nothing changed", "ground", table("steadiness", "steadiness", folded="By scene: surfaces where nothing changed"),
     "Of the area of polygons about which no voxel changed from one scan to the next: the share that came or went, and that got another "
     "id; beside it, the same map segmented anew at each scan."),
    ("Ground kept up", "ground", table("ground", "ground", folded="By scene: ground kept up"),
     "Medians over scans: of the scan itself, of ground for planners kept from the snapshot before, of what is read of it near the sensor, "
     "and of all of it, kept and made from nothing."),
    ("Labelled clouds", "labelled", table("labelled", "labelled", folded="By cloud and method"),
     "Every method gets the same voxels; CGAL's get the best of several settings, octosurf its defaults. Milliseconds have normals "
     "and planes for CGAL, downsampling, occupancy and outlines as well for octosurf."),
    ("A real table with things on it", "labelled", mosd_section,
     "Frames of mOSD: how well the table's pixels are covered, and how far its plane is off theirs. *Behind what went*: of one map of "
     "a folder's frames, nine scans of each, in which things were moved: the table's pixels before which the map still has a surface."),
    ("Speed and memory", "speed", speed_section, "Beside what others take for the same, in the same run; `octosurf map` with two threads."),
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
        best = max(row["correct"] for row in rows if row["method"].startswith("CGAL"))
        parts.append(f'{ours["correct"]} of {ours["labels"]}, CGAL {best}')
    return "; ".join(parts) or NONE


def ten_speed(records, say, *names):
    found = sides(records)
    return say(*(found[name] for name in names)) if all(name in found for name in names) else NONE


def ten(records):
    kitchen = content(records, "kitchen-2cm")
    return [
        ("simulated depth camera", scores(content(records, "depth")), "accuracy"),
        ("with a real camera's faults", scores(content(records, "depth-real")), "accuracy"),
        ("simulated spinning lidar", scores(content(records, "spinning")), "accuracy"),
        ("spinning; tilting: faces seen well", "; ".join(f'{bench.ACCURACY["seen well"](rows)} correct' for name in ("spinning", "tilting")
                                                         if (rows := content(records, name))) or NONE, "accuracy"),
        ("terrain meshes, depth camera", scores(content(records, "terrain")), "terrain"),
        ("generated terrains, depth camera", scores(content(records, "generated")), "terrain"),
        ("real kitchen mapped twice", "; ".join(f'{percent(row["agreeing"])} of the area within d, offsets p95 {row["offset_p95_mm"]:.1f} mm'
                                                for row in content(records, "repeat-kitchen")) or NONE, "repeatability"),
        ("beside the paper's detector from PCL's parts", ten_paper(records), "paper"),
        ("planes of two labelled clouds", ten_labelled(records), "labelled"),
        ("real kitchen", "{surfaces} surfaces, {double_layers} double layers in {scans} scans".format(**kitchen[0]) if kitchen else NONE,
         "kitchen"),
        ("a scan of it, one thread",
         ten_speed(records, lambda ours, theirs: f'{bench.short(ours["ms"])} ms; OctoMap\'s insertion alone {bench.short(theirs["ms"])} ms',
                   "kitchen/d:0.02/mapper", "kitchen/d:0.02/octomap"), "speed"),
        ("heap per octree leaf",
         ten_speed(records, lambda *both: "{:.1f} B; OctoMap's pruned tree {:.1f} B".format(*bench.heap_per_leaf(*both)),
                   "kitchen/d:0.02/occupancy", "kitchen/d:0.02/octomap"), "speed"),
        ("kitchen live, 30 scans a second, two threads", ten_speed(records, bench.lag, "realtime/d:0.02"), "speed"),
    ]


def document(records, commit, reasons):
    """The whole of docs/results.md."""
    parts = ["# What was measured", "",
             f"Written by `./dev bench results` at commit **{commit}**: every number was measured at that commit; what was not is "
             "listed last. `--only GROUP` measures a part.", "",
             "## In short", "", markdown(["what", "result", "measured by"],
                                         [[what, result, f"`--only {group}`"] for what, result, group in ten(records)])]
    aside = []  # of what only the page by scene shows, a line each
    for title, group, section, text in SECTIONS:
        body = section(records) or f"{NONE.capitalize()}.\n"
        if body.startswith("\n<details>"):
            aside += [f"- **{title}** (`--only {group}`). {text}" + body]
        else:
            parts += [f"## {title}", "", f"`./dev bench results --only {group}`. {text}", "", body]
    parts += ["## By scene only", "", *aside, ""] if aside else []
    where = {}
    for name, record in records.items():
        where.setdefault(f'{record["machine"]}, {record["date"]}', []).append(
            f'`{name}` {record["seconds"] / 60:.1f} ({record["load"]:.1f})')
    parts += ["## When and where", "", "Minutes of each task, and the machine's load at its end: above one it was busy with other work.", ""]
    parts += [f'- {place}: {", ".join(tasks)}.' for place, tasks in where.items()]
    missing = "; ".join(f"`{name}`" + (f": {reason}" if reason != NONE else "") for name, reason in reasons.items())
    parts += [*([f"\nNot measured at this commit: {missing}."] if missing else []), ""]
    return "\n".join(parts)


def unfolded(text):
    """The document with links in place of what is folded away, and a page of that."""
    folded = ["# What was measured, by scene\n\nWritten with [results.md](results.md).\n"]

    def link(block):
        folded.append(f"## {block[1]}\n\n{block[2].strip()}\n")
        return f"[{block[1]}](results_by_scene.md#{re.sub('[^a-z0-9 -]', '', block[1].lower()).replace(' ', '-')})\n"
    short = re.sub(r"<details><summary>(.*?)</summary>\n(.*?)</details>\n+", link, text, flags=re.DOTALL)
    return short.replace(")\n[", "), ["), "\n".join(folded)


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
    (ROOT / "docs/worst").mkdir(exist_ok=True)
    for name in SETS:
        if name in records:
            text = sheet.sheet(SETS[name][0], sheet.worst(records[name]["content"]))
            (ROOT / f"docs/worst/{name}.svg").write_text(text, encoding="utf-8")
    short, folded = unfolded(document(records, commit, reasons))
    (ROOT / "docs/results.md").write_text(short, encoding="utf-8")
    (ROOT / "docs/results_by_scene.md").write_text(folded, encoding="utf-8")
    put_between(ROOT / "README.md", "results", f"At d = 2 cm, commit {commit}; [all figures](docs/results.md).\n\n"
                + markdown(["what", "result"], [row[:2] for row in ten(records)]))
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
