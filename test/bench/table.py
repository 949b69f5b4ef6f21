#!/usr/bin/env python3
"""Markdown table of bench_speed's JSON files: table.py JSON…

Benchmarks with the same path before their last part are sides of one comparison; of one that several files
hold, the later file's counts. Every number stands in the files; here they are only put side by side.
"""

import json
import pathlib
import sys

FOOTNOTES = """\
Each side's time is Google Benchmark's, mean over a recording's scans; of several passes in random order the
median, with their coefficient of variation. Both sides run in one process on the same scans, which are read
beforehand.
OctoMap's insertion: `insertPointCloud` lazy and discretised, then `updateInnerOccupancy`, points already in
the map's frame."""

OURS = ("occupancy", "plain", "mapper", "load_map")
GROUPS = ("kitchen", "lidar", "loading", "long_run", "app", "realtime")
ALONE = ("long_run", "app", "realtime")  # groups whose benchmarks have no other side


def short(value):
    """Three significant digits, at most two decimals, thousands separated."""
    return f"{value:,.{max(0, 3 - len(str(int(abs(value)))))}f}"


def unit(value, name):
    """A time in ms, or s if it is long."""
    return f"{short(value / 1000)} s" if name == "ms" and value >= 10000 else f"{short(value)} {name}"


def spread(side):
    return f' ± {100 * side["cv"]:.0f} %' if "cv" in side else ""


def pair(ours, theirs):
    return unit(ours["ms"], "ms"), unit(theirs["ms"], "ms")


def cells(ours, theirs, beside):
    mine, other = pair(ours, theirs)
    return mine + spread(ours), other + spread(theirs), f'{short(theirs["ms"] / ours["ms"])}×', beside


STAGES = ("downsample", "occupancy", "retract", "add_inliers", "expand", "detect", "revise", "cylinders", "derive")


def equality(ours, theirs, what):
    same = ours["digest"] == theirs["digest"]
    return f"{what} equal" if same else f"**{what} differ**"


def insertion(ours, theirs):
    return cells(ours, theirs, equality(ours, theirs, f'{short(theirs["voxels"] / 1e6)} million voxels'))


def whole_scan(ours, theirs):
    stages = ", ".join(f'{name.replace("_", " ")} {short(ours[name + "_ms"])}' for name in STAGES)
    return cells(ours, theirs, f'{stages} ms; p95 {short(ours["p95_ms"])} ms')


def heap_per_leaf(ours, theirs):
    """Bytes. The same occupancy, so the same leaves: OctoMap's count is both sides' divisor."""
    return ours["heap_bytes"] / theirs["leaves"], theirs["heap_bytes"] / theirs["leaves"]


def memory(ours, theirs):
    mine, other = heap_per_leaf(ours, theirs)
    return f"{mine:.1f} B", f"{other:.1f} B", f"{short(other / mine)}×", \
        f'{theirs["leaves"] / 1e6:.2f} million leaves; the tree alone {ours["tree_bytes"] / theirs["leaves"]:.1f} B, ' \
        "the rest is kept between scans"


def loading(ours, theirs):
    return cells(ours, theirs, "")


def long_run(row):
    def lap(number):
        return f'p50 {short(row[f"lap{number}_p50_ms"])} ms, p99 {short(row[f"lap{number}_p99_ms"])} ms'

    def over(name):
        return row["lap10_" + name] / row["lap2_" + name]
    return "its own second lap", lap(10), lap(2), f'{over("p50_ms"):.2f}, {over("p99_ms"):.2f} of it', \
        f'octree {over("tree_bytes"):.3f}, heap {over("heap_bytes"):.3f}, file {over("file_bytes"):.3f} of lap 2\'s; ' \
        f'surfaces {row["lap10_surfaces"]:.0f} ({row["lap2_surfaces"]:.0f})'


def app(row):
    return "the camera", f'{row["frames_per_second"]:.1f} frames/s', "30 frames/s", \
        f'{short(row["frames_per_second"] / 30)}×', \
        f'{row["scans"]:.0f} scans; one takes {short(row["scan_p50_ms"])} ms, 95 % within ' \
        f'{short(row["scan_p95_ms"])} ms; at most {row["peak_rss_mb"]:,.0f} MB'


def realtime(row):
    return "the paper's Table I", f'{row["first_detection_ms"]:.0f} ms, {row["lag_mean_ms"]:.0f} ms', \
        f'{row["theirs_first_detection_ms"]:,.0f} ms, {row["theirs_lag_mean_ms"]:,.0f} ms', "", \
        f'lag p50 {row["lag_p50_ms"]:.0f} ms, p95 {row["lag_p95_ms"]:.0f} ms; {row["scans"]:.0f} scans, ' \
        f'{row["skipped_scans"]:.0f} dropped; {row["categorized_percent"]:.1f} % of the points categorised'


CELLS = {"occupancy": insertion, "plain": insertion, "mapper": whole_scan, "load_map": loading,
         "long_run": long_run, "app": app, "realtime": realtime}


def conditions(context):
    return f'{context["cpu_model"]}, {context["num_cpus"]} cores; {context["compiler"]}; OctoMap {context["octomap"]}; ' \
        f'{context["date"][:10]}, commit ' \
        f'{context.get("commit", "unknown")}, {context["form"]}'


def sides_of(content):
    """Benchmarks of a file by name: counters, `ms`, and where it was repeated `cv`, of medians."""
    sides = {}
    for run in content["benchmarks"]:
        name, aggregate = run["run_name"].split("/iterations:")[0], run.get("aggregate_name")
        if aggregate == "cv":
            sides[name]["cv"] = run["real_time"]
        elif aggregate == "median" or (run["run_type"] == "iteration" and name not in sides):
            sides[name] = dict(run, ms=run.get("real_time"))
    return sides


def read(files):
    """Sides by name; runs as (context, groups measured in it)."""
    sides, runs = {}, []
    for file in files:
        content = json.loads(pathlib.Path(file).read_text(encoding="utf-8"))
        found = sides_of(content)
        sides.update((name, side) for name, side in found.items()
                     if name not in sides or not side.get("error_occurred"))
        runs.append((content["context"], sorted({name.split("/")[0] for name in found})))
    return sides, runs


def losses(ours, theirs):
    """What the other does better."""
    if theirs["ms"] < ours["ms"]:
        yield f'{theirs["ms"] / ours["ms"]:.2f}×'


def losses_alone(row):
    if row.get("frames_per_second", 30) < 30:
        yield f'{row["frames_per_second"] / 30:.2f}×'
    if row.get("lag_mean_ms", 0) > row.get("theirs_lag_mean_ms", float("inf")):
        yield f'mean lag {unit(row["lag_mean_ms"], "ms")} to {unit(row["theirs_lag_mean_ms"], "ms")}'


def compared(sides):
    """(what, against, cells, losses) of each row of the table."""
    for name, ours in sorted(sides.items(), key=lambda item: (GROUPS.index(item[0].split("/")[0]), item[0])):
        path, _, side = name.rpartition("/")
        group = name.split("/")[0]
        if group in ALONE:
            against, *rest = CELLS[group](ours)
            yield ours["label"], against, rest, losses_alone(ours)
        if side not in OURS:
            continue
        for other, theirs in sides.items():
            if other.rpartition("/")[0] != path or other.rpartition("/")[2] in OURS:
                continue
            yield ours["label"], theirs["label"], CELLS[side](ours, theirs), losses(ours, theirs)
            if group == "kitchen" and side == "occupancy":
                mine, least = heap_per_leaf(ours, theirs)
                yield ours["label"].replace("occupancy insertion", "heap per octree leaf"), "OctoMap's pruned tree", \
                    memory(ours, theirs), [f"{least / mine:.2f}×"] if least < mine else []


def table(sides, runs):
    lines = ["| what | against | octosurf | the other | times better | beside it |", "|---|---|---|---|---|---|"]
    failed = {name: side["error_message"] for name, side in sides.items() if side.get("error_occurred")}
    lost = []
    for what, against, shown, lost_by in compared({n: s for n, s in sides.items() if n not in failed}):
        lines.append(f"| {what} | {against} | " + " | ".join(shown) + " |")
        if lost_by := ", ".join(lost_by):
            lost.append(f"{what}, against {against} ({lost_by})")
    lines += ["", "Where we lose: " + ("; ".join(lost) if lost else "nowhere in this table") + "."]
    if failed:
        lines += ["", "Not measured: " + "; ".join(f"{name} ({why})" for name, why in failed.items()) + "."]
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
