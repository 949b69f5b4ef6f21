"""Markdown of what results.py measured. Every number stands in a record; here they are put side by side."""

import table as speed_table

NONE = "not measured at this commit"


def percent(share, digits=1):
    return f"{100 * share:.{digits}f} %"


def markdown(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def content(records, name):
    return records[name]["content"] if name in records else None


def note(record):
    """What a reader must know of a task: of what commit, when, where, how busy, how long."""
    return [record["commit"], record["date"], record["machine"],
            f'{record["load"]:.1f}', f'{record["seconds"] / 60:.1f} min']


def rows_of(records, name, **wanted):
    return [row for row in content(records, name) or [] if all(row.get(key) == value for key, value in wanted.items())]


def seeds(row):
    count = len(row["seeds"])
    return f"{count} seed" + ("s" if count > 1 else "")


# Simulated scenes.

ACCURACY = [("depth", "depth camera, 2 cm"), ("depth-real", "depth camera with a real one's faults, 2 cm"),
            ("depth-1cm", "depth camera, 1 cm"), ("spinning", "spinning lidar, 2 cm"), ("tilting", "tilting laser, 2 cm"),
            ("noise", "depth camera, noise × 2, 2 cm"), ("drift", "depth camera, drift of 15 mm and 0.3° a lap, two laps, 2 cm")]

ACCURACY_HEADER = ["", "seeds", "correct", "over / under / missed", "noise", "coverage (worst)", "layers (worst)",
                   "unsafe (worst)", "off by 1 cm, 1.5 cm; false", "normal mean / max", "offset mean",
                   "all faces: normal, offset"]


def accuracy_cells(row):
    known = "unsafe_10mm_share" in row
    off = f'{percent(row["unsafe_10mm_share"])}, {percent(row["unsafe_15mm_share"])}; {percent(row["false_share"], 2)}' \
        if known else "–"
    every = f'{row["normal_all_mean_deg"]:.2f}°, {row["offset_all_mean_mm"]:.2f} mm' if known else "–"
    return [seeds(row), f'{percent(row["correct"] / max(row["faces"], 1))} of {row["faces"]}',
            f'{row["over_segmented"]} / {row["under_segmented"]} / {row["missed"]}', str(row["noise"]),
            f'{percent(row["coverage"])} ({percent(row["worst_coverage"])})',
            f'{row["multiplicity"]:.3f} ({row["worst_multiplicity"]:.3f})',
            f'{percent(row["unsafe_share"], 2)} ({percent(row["worst_unsafe_share"], 2)})', off,
            f'{row["normal_mean_deg"]:.2f}° / {row["normal_max_deg"]:.1f}°', f'{row["offset_mean_mm"]:.2f} mm', every]


def accuracy(records):
    total, scenes = [], []
    for name, title in ACCURACY:
        total += [[title, *accuracy_cells(row)] for row in rows_of(records, name, scene="all")]
        scenes += [[f'{title}: `{row["scene"]}`', *accuracy_cells(row)]
                   for row in content(records, name) or [] if row["scene"] != "all"]
    if not total:
        return ""
    return f"{markdown(ACCURACY_HEADER, total)}\n### By scene\n\n{markdown(ACCURACY_HEADER, scenes)}"


def terrain(records):
    rows = content(records, "terrain")
    return markdown(ACCURACY_HEADER, [[row["scene"], *accuracy_cells(row)] for row in rows]) if rows else ""


METHODS = {"ours/default": "octosurf", "ours/paper/r=0.15": "octosurf, `detector = paper`, r = 0.15",
           "ours/paper/r=0.06": "the same, r = 0.06", "cgal/growing": "CGAL region growing",
           "cgal/ransac": "CGAL Efficient RANSAC"}


def paper(records):
    rows = rows_of(records, "paper", scene="all")
    return markdown(["method", *ACCURACY_HEADER[1:], "ms a scan"],
                    [[METHODS[row["method"]], *accuracy_cells(row), f'{row["ms_per_scan"]:.1f}']
                     for row in rows]) if rows else ""


# Real recordings.

def kitchen(records):
    rows = []
    for name in ("kitchen-2cm", "kitchen-1cm"):
        row = content(records, name)
        if not row:
            continue
        level = [f'{row[what]["area_m2"]:.2f} m², {1000 * row[what]["rms_m"]:.1f} mm' if what in row else "none"
                 for what in ("floor", "table")]
        rows.append([f'{row["resolution"]:g} m', str(row["scans"]), str(row["surfaces"]),
                     str(row["surfaces_over_min_area"]), f'{row["area_m2"]:.1f} m²', str(row["double_layers"]), *level,
                     f'{row["up_error_deg"]:.2f}°'])
    return markdown(["d", "scans", "surfaces", "of 0.05 m² and more", "area", "double layers", "floor: area, rms",
                     "table: area, rms", "`--up auto` off by"], rows) if rows else ""


def labelled(records):
    rows = [[row["cloud"], f'{row["resolution"]:g}', row["method"], f'{row["correct"]} of {row["labels"]}',
             f'{row["over_segmented"]} / {row["under_segmented"]} / {row["missed"]}', str(row["noise"]),
             percent(row["coverage"]), f'{row["mean_iou"]:.3f}',
             f'{row["normal_deg"]["mean"]:.2f}° / {row["normal_deg"]["max"]:.2f}°',
             f'{1000 * row["offset_m"]["mean"]:.2f} mm', f'{row["ms"]:,.0f}'] for row in content(records, "labelled") or []]
    return markdown(["cloud", "d", "method", "correct", "over / under / missed", "noise", "coverage", "mean IoU",
                     "normal mean / max", "offset mean", "ms"], rows) if rows else ""


def mosd(records):
    by_resolution = {}
    for row in content(records, "mosd") or []:
        by_resolution.setdefault(row["resolution"], []).append(row)

    def worst(rows, key, choose, scale=1):
        return choose(abs(row[key]) for row in rows) * scale
    rows = [[f"{resolution:g}", str(len(found)), f'{worst(found, "iou_points", min):.3f}',
             f'{worst(found, "iou_pixels", min):.3f}', f'{worst(found, "offset_m", max, 1000):.2f} mm',
             f'{worst(found, "angle_deg", max):.3f}°'] for resolution, found in by_resolution.items()]
    return markdown(["d", "frames", "IoU of readings, least", "IoU of pixels, least", "offset, most", "angle, most"],
                    rows) if rows else ""


def table1(records):
    def beside(row, field, form):
        paper = row.get("paper", {}).get(field)
        return "–" if paper is None else form.format(paper), form.format(row[field])

    def rows(name):
        for row in content(records, name) or []:
            points = beside(row, "points_per_second", "{:,.0f}")
            first = beside(row, "time_to_first_detection_s", "{:.3f} s")
            lag = beside(row, "detection_lag_s", "{:.3f} s")
            share = beside(row, "categorized_percent", "{:.1f} %")
            yield [row["environment"], f'{row["resolution"]:g}', row["detector"],
                   *(", ".join(pair) for pair in (points, first, lag, share))]

    columns = ["environment", "d", "detector", "points per second: paper, here", "first detection", "mean lag", "categorised"]
    return markdown(columns, increments) if (increments := [*rows("table1"), *rows("table1-paper")]) else ""


# Speed.

def speed_sides(records):
    sides, runs = {}, []
    for name, record in records.items():
        if name.startswith("speed-"):
            found = speed_table.sides_of(record["content"])
            sides.update(found)
            context = dict(record["content"]["context"], commit=record["commit"])
            runs.append((context, sorted({side.split("/")[0] for side in found})))
    return sides, runs


def speed(records):
    sides, runs = speed_sides(records)
    return speed_table.table(sides, runs) + "\n" if sides else ""


# The document.

SECTIONS = [
    ("Simulated scenes", "accuracy", accuracy,
     "Faces of at least 0.05 m² seen; a face is correct by Hoover's rule at 80 %. *Worst* is the worst single recording, "
     "*layers* how many surfaces lie over a seen place. *Unsafe* is area of surfaces farther than 1.5 d, at least 2 cm, off what is there, "
     "or 30° aslant; *off by 1 cm, 1.5 cm* is area that far off the true outline, of which *false* is 5 cm and more off. Errors of "
     "normal and offset are over correct faces, in the last column over all matched ones."),
    ("Terrain meshes", "terrain", terrain, "Meshes that planners use, seen by a depth camera as a walking robot would."),
    ("Beside the paper's detector and CGAL", "paper", paper,
     "`detector = paper` is the paper's steps from PCL's parts. CGAL gets the centroids of all scans' voxels at once: normals from "
     "24 neighbours, 12 for growing, octosurf's tolerance, angle and least size, the paper's alpha shape around what it finds; its time "
     "is that of normals and planes. The same 20 scans of each recording, all four scenes."),
    ("The paper's Table I", "table1", table1,
     "Same columns as in the paper, its figures first; its machine had 8 cores, here it is one thread. A tilting laser as the paper's, "
     "its data in increments of one second, the paper's parameters with either detector; the real recording is the kitchen, one reading in 24, and its noise is measured. "
     "Lag counts from when an increment is handed over."),
    ("The kitchen", "kitchen", kitchen,
     "A real recording without truth. A double layer is a pair of surfaces within 15° and 5 cm whose polygons overlap by a "
     "fifth of the smaller one: on a good map there is none."),
    ("Labelled clouds", "labelled", labelled,
     "Every method gets the same voxels; CGAL's get the best of several settings, octosurf has its defaults. Milliseconds "
     "have normals and planes for CGAL, downsampling, occupancy and outlines as well for octosurf."),
    ("A real table with things on it", "labelled", mosd,
     "Twelve frames of mOSD, one scan each: how well the table's labelled pixels are covered, and how far its plane is off "
     "the least-squares plane of those pixels."),
    ("Speed and memory", "speed", speed, "Beside what others take for the same, in the same run."),
]


def one(records, name, **wanted):
    rows = rows_of(records, name, **wanted)
    return rows[0] if rows else None


def scores(row):
    return f'{percent(row["correct"] / max(row["faces"], 1))} of {row["faces"]} faces correct, {percent(row["coverage"])} ' \
        f'covered, {percent(row["unsafe_share"], 2)} unsafe ({seeds(row)})' if row else NONE


def ten_terrain(records):
    rows = content(records, "terrain")
    return scores(next((row for row in rows if row["scene"] == "all"), rows[0])) if rows else NONE


def ten_paper(records):
    shares = {row["method"]: row["correct"] / max(row["faces"], 1) for row in rows_of(records, "paper", scene="all")}
    theirs = [share for name, share in shares.items() if name.startswith("ours/paper")]
    if "ours/default" not in shares or not theirs:
        return NONE
    return f'{percent(shares["ours/default"])} of faces correct; the pipeline {percent(max(theirs))} at best'


def ten_kitchen(records):
    row = content(records, "kitchen-2cm")
    return f'{row["surfaces"]} surfaces, {row["double_layers"]} double layers in {row["scans"]} scans' if row else NONE


def ten_labelled(records):
    by_cloud = {}
    for row in content(records, "labelled") or []:
        if row["resolution"] == 0.02:
            by_cloud.setdefault(row["cloud"], {})[row["method"]] = row
    parts = []
    for rows in by_cloud.values():
        others = [row["correct"] for method, row in rows.items() if method.startswith("CGAL")]
        if "octosurf" in rows and others:
            parts.append(f'{rows["octosurf"]["correct"]} of {rows["octosurf"]["labels"]}, CGAL {max(others)}')
    return "; ".join(parts) or NONE


def ten_speed(records, names, say):
    sides, _ = speed_sides(records)
    if any(name not in sides or sides[name].get("error_occurred") for name in names):
        return NONE
    return say(*(sides[name] for name in names))


def beside(ours, theirs):
    return "{}; OctoMap's insertion alone {}".format(*speed_table.pair(ours, theirs))


def heap(ours, theirs):
    return "{:.1f} B; OctoMap's pruned tree {:.1f} B".format(*speed_table.heap_per_leaf(ours, theirs))


def lag(row):
    return f'lag p50 {row["lag_p50_ms"]:.0f} ms, p95 {row["lag_p95_ms"]:.0f} ms; {row["categorized_percent"]:.1f} % of points ' \
        "categorised"


def ten(records):
    return [
        ("simulated depth camera", scores(one(records, "depth", scene="all")), "accuracy"),
        ("with a real camera's faults", scores(one(records, "depth-real", scene="all")), "accuracy"),
        ("simulated spinning lidar", scores(one(records, "spinning", scene="all")), "accuracy"),
        ("terrain meshes, depth camera", ten_terrain(records), "terrain"),
        ("beside the paper's pipeline from PCL", ten_paper(records), "paper"),
        ("planes of two labelled clouds", ten_labelled(records), "labelled"),
        ("real kitchen", ten_kitchen(records), "kitchen"),
        ("a scan of it, one thread",
         ten_speed(records, ["kitchen/d:0.02/mapper", "kitchen/d:0.02/octomap"], beside), "speed"),
        ("heap per octree leaf",
         ten_speed(records, ["kitchen/d:0.02/occupancy", "kitchen/d:0.02/octomap"], heap), "speed"),
        ("kitchen live, 30 scans a second, two threads",
         ten_speed(records, ["realtime/d:0.02"], lag), "speed"),
    ]


def ten_block(records, commit):
    return f"At d = 2 cm, commit {commit}; [all figures](docs/results.md).\n\n" \
        + markdown(["what", "result"], [[what, result] for what, result, _ in ten(records)])


def demo_block(record):
    if not record:
        return f"The demo's output: {NONE} (`./dev bench results --only demo`).\n"
    return "```text\n" + record["content"]["text"] + "```\n"


def document(records, commit, tasks, reasons):
    """The whole of docs/results.md, and the README's table."""
    block = ten_block(records, commit)
    parts = ["# What was measured", "",
             f"Written by `./dev bench results` at commit **{commit}**: every number here was measured at that commit; what was "
             "not is listed at the end. `--only GROUP` measures a part anew, `--list` tells what each part takes.", "",
             "## In short", "", markdown(["what", "result", "measured by"],
                                         [[what, result, f"`--only {group}`"] for what, result, group in ten(records)])]
    for title, group, section, text in SECTIONS:
        rows = section(records)
        parts += [f"## {title}", "", f"`./dev bench results --only {group}`. {text}", "", rows or f"{NONE.capitalize()}.\n"]
    parts += ["## When and where", "",
              "Load is that of the machine at the task's end: times beside a load of over one are those of a busy machine.", "",
              markdown(["task", "commit", "date", "machine", "load", "took"],
                       [[f"`{task.name}`: {task.title}", *note(records[task.name])]
                        for task in tasks if task.name in records])]
    missing = [[f"`{task.name}`: {task.title}", reasons[task.name]] for task in tasks if task.name in reasons]
    parts += ["## Not measured at this commit", "", markdown(["task", "why"], missing) if missing else "Nothing: all is there.\n"]
    return "\n".join(parts), block
