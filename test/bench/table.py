#!/usr/bin/env python3
"""Markdown table of bench_speed's JSON files: table.py JSON…

Of rows that several files hold, the later file's counts. Every number stands in the files; here they
are only put side by side.
"""

import json
import pathlib
import sys

FOOTNOTES = """\
Each side is a process of its own with its own heap; they take turns, scan by scan, on the same data, which
is read beforehand. Medians over the turns; in brackets the 10th to 90th percentile of single turns' ratios.
OctoMap's insertion: `insertPointCloud` lazy and discretised, then `updateInnerOccupancy`, points already in
the map's frame. PCL pipeline: the paper's steps from stock PCL parts (`test/reference`). CGAL: normals from
24 neighbours, 12 for growing, octosurf's tolerance, angle and least size, voxel centroids given; it knows
neither outlines nor free space, and of ours only the stages from `retract` on are counted beside it.
Outlines from scratch: adding or projecting the inliers is not counted."""


def short(value):
    """Three significant digits, at most two decimals, thousands separated."""
    return f"{value:,.{max(0, 3 - len(str(int(abs(value)))))}f}"


def unit(value, name):
    """A time in ms, or s if it is long."""
    return f"{short(value / 1000)} s" if name == "ms" and value >= 10000 else f"{short(value)} {name}"


def pair(row, name="ms"):
    return unit(row[f"ours_{name}"], name), unit(row[f"theirs_{name}"], name)


def ratio(row):
    text = f'{short(row["ratio"])}×'
    if "ratio_p10" in row and row["turns"] > 2:
        text += f' ({short(row["ratio_p10"])} to {short(row["ratio_p90"])})'
    return text


STAGES = ("downsample", "occupancy", "retract", "add_inliers", "expand", "detect", "revise", "cylinders", "derive")


def stages(row):
    return ", ".join(f'{name.replace("_", " ")} {short(row[name + "_ms"])}' for name in STAGES) + " ms"


def differing(count, what):
    return f"{what} equal" if count == 0 else f"**{what} differ: {count:,.0f}**"


def insertion(row):
    return (*pair(row), ratio(row),
            differing(row["voxels_that_differ"], f'{short(row["voxels"] / 1e6)} million voxels'))


def whole_scan(row):
    return *pair(row), ratio(row), stages(row) + f'; p95 {short(row["ours_p95_ms"])} ms'


def memory(row):
    ours, theirs = (f'{row[side + "_bytes"]:.1f} B' for side in ("ours", "theirs"))
    return ours, theirs, ratio(row), f'{row["their_leaves"] / 1e6:.2f} million leaves; the tree alone ' \
        f'{row["tree_alone_bytes"]:.1f} B, the rest is kept between scans'


def loading(row):
    return *pair(row), ratio(row), ""


def planes(row):
    notes = []
    if "faces" in row:
        sides = [f'{row[s + "_correct_percent"]:.0f} % of {row["faces"]:.0f} faces correct, '
                 f'{row[s + "_noise"]:.0f} surfaces of noise, {row[s + "_unsafe_percent"]:.1f} % unsafe'
                 for s in ("ours", "theirs")]
        notes.append(" / ".join(sides))
    else:
        notes.append(f'{row["ours_surfaces"]:.0f} / {row["theirs_surfaces"]:.0f} surfaces')
    if "insert_all_scans_ms" in row:
        notes.append(f'all scans\' inserts together {unit(row["insert_all_scans_ms"], "ms")}')
    else:
        notes.append(f'with voxels and free space {unit(row["insert_ms"], "ms")}')
    return *pair(row), ratio(row), "; ".join(notes)


def normals(row):
    return *pair(row), ratio(row), \
        f'{row["mean_angle_deg"]:.2f}° apart (95 % within {row["p95_angle_deg"]:.2f}°) at ' \
        f'{row["planar_points"]:,.0f} planar points'


def derive(row):
    vertices = f'{row["ring_vertices"]:,.0f} vertices'
    if "outlines_that_differ" in row:
        return *pair(row), ratio(row), differing(row["outlines_that_differ"], f"outlines of {vertices}")
    return *pair(row), ratio(row), f'{vertices}; areas differ by {row["area_differs_percent"]:.3f} %'


def long_run(row):
    def both(name):
        return f'{short(row["lap10_" + name])} ms', f'{short(row["lap2_" + name])} ms', \
            f'{row[name[:3] + "_lap10_over_lap2"]:.2f}'
    (p50, p50_early, p50_ratio), (p99, p99_early, p99_ratio) = both("p50_ms"), both("p99_ms")
    return f"p50 {p50}, p99 {p99}", f"p50 {p50_early}, p99 {p99_early}", f"{p50_ratio}, {p99_ratio} of it", \
        f'octree {row["octree_lap10_over_lap2"]:.3f}, heap {row["heap_lap10_over_lap2"]:.3f}, file ' \
        f'{row["file_lap10_over_lap2"]:.3f} of lap 2\'s; surfaces {row["lap10_surfaces"]:.0f} ' \
        f'({row["lap2_surfaces"]:.0f})'


def app(row):
    return f'{row["frames_per_second"]:.1f} frames/s', "30 frames/s", \
        ratio(row), \
        f'{row["scans"]:.0f} scans; one takes {short(row["scan_p50_ms"])} ms, 95 % within ' \
        f'{short(row["scan_p95_ms"])} ms; at most {row["peak_rss_mb"]:,.0f} MB'


def realtime(row):
    return f'{row["first_detection_ms"]:.0f} ms, {row["lag_mean_ms"]:.0f} ms', \
        f'{row["theirs_first_detection_ms"]:,.0f} ms, {row["theirs_lag_mean_ms"]:,.0f} ms', "", \
        f'lag p50 {row["lag_p50_ms"]:.0f} ms, p95 {row["lag_p95_ms"]:.0f} ms; {row["scans"]:.0f} scans, ' \
        f'{row["skipped_scans"]:.0f} dropped; {row["categorized_percent"]:.1f} % of the points categorised'


CELLS = {"occupancy": insertion, "plain": insertion, "lidar": insertion, "mapper": whole_scan,
         "pcl": whole_scan, "memory": memory, "loading": loading, "planes": planes, "normals": normals,
         "derive": derive, "long_run": long_run, "app": app, "realtime": realtime}


def conditions(context):
    return f'{context["cpu_model"]}, {context["cores"]} cores; {context["compiler"]}; OctoMap {context["octomap"]}, ' \
        f'PCL {context["pcl"]}, CGAL {context["cgal"]}; {context["date"][:10]}, commit {context["commit"]}, ' \
        f'{context["form"]}'


def read(files):
    """Rows by name; runs as (context, groups measured in it)."""
    rows, runs = {}, []
    for file in files:
        content = json.loads(pathlib.Path(file).read_text(encoding="utf-8"))
        found = {row["name"].split("/iterations:")[0]: row for row in content["benchmarks"]}
        rows.update((name, row) for name, row in found.items()
                    if name not in rows or not row.get("error_occurred"))
        runs.append((content["context"], sorted({name.split("/")[0] for name in found})))
    return rows, runs


def losses(row):
    """What the other does better."""
    if row.get("ratio", 1) < 1:
        yield f'{row["ratio"]:.2f}×'
    if row.get("ours_correct_percent", 100) < row.get("theirs_correct_percent", 0):
        yield f'{row["ours_correct_percent"]:.0f} to {row["theirs_correct_percent"]:.0f} % correct'
    if row.get("lag_mean_ms", 0) > row.get("theirs_lag_mean_ms", float("inf")):
        yield f'mean lag {unit(row["lag_mean_ms"], "ms")} to {unit(row["theirs_lag_mean_ms"], "ms")}'


def table(rows, runs):
    lines = ["| what | against | octosurf | the other | times better | beside it |", "|---|---|---|---|---|---|"]
    lost, skipped = [], []
    order = list(CELLS)
    for name, row in sorted(rows.items(), key=lambda item: order.index(item[0].split("/")[0])):
        if row.get("error_occurred"):
            skipped.append(f'{name} ({row["error_message"]})')
            continue
        what, against = row["label"].split(" | ")
        lines.append(f"| {what} | {against} | " + " | ".join(CELLS[name.split("/")[0]](row)) + " |")
        if lost_by := ", ".join(losses(row)):
            lost.append(f"{what}, against {against} ({lost_by})")
    lines += ["", "Where we lose: " + ("; ".join(lost) if lost else "nowhere in this table") + "."]
    if skipped:
        lines += ["", "Not measured: " + "; ".join(skipped) + "."]
    lines += ["", FOOTNOTES, ""]
    measured = {}
    for context, groups in runs:
        measured.setdefault(conditions(context), set()).update(groups)
    lines += [f'{text}: {", ".join(sorted(groups))}.' for text, groups in measured.items()]
    return "\n".join(lines)


def main():
    if len(sys.argv) < 2:
        sys.exit("table.py: no JSON file; `./dev bench NAME` writes one to out/bench")
    print(table(*read(sys.argv[1:])))


if __name__ == "__main__":
    main()
