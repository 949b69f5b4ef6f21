"""What results.py measures: one task per program run."""

import dataclasses
import pathlib
from typing import Callable

PROGRAMS = pathlib.Path("build/release/test/bench")


@dataclasses.dataclass(frozen=True)
class Task:
    """`command(options, output)`: writes JSON to `output`, or prints what `parse` makes JSON of. Minutes are
    rough: alone on two cores with ten seeds, and in the quick form."""
    group: str
    name: str
    title: str
    target: str
    command: Callable
    minutes: float
    quick_minutes: float
    needs: str = ""  # in ../shared/data
    parse: Callable = None


def seeds(options, at_most=1000):
    return ",".join(str(seed) for seed in range(1, min(options.seeds, at_most) + 1))


def accuracy(name, title, minutes, *arguments, at_most=1000, needs="", group="accuracy"):
    def command(options, output):
        return [PROGRAMS / "bench_accuracy", "--only", "ours/default", "--seeds", seeds(options, at_most), *arguments,
                "--json", output]
    return Task(group, name, title, "bench_accuracy", command, minutes, minutes / 10, needs)


def paper(options, output):
    """The PCL pipeline takes a third of a second a scan and more: 20 scans of each recording, the same for all."""
    return [PROGRAMS / "bench_accuracy", "--only", "ours/default,pcl", "--frames", "20", "--seeds", seeds(options, 2),
            "--json", output]


def kitchen(resolution, every):
    def command(options, output):
        step = str(3 * every if options.quick else every)
        return [PROGRAMS / "bench_kitchen", "--resolution", str(resolution), "--every", step, "--json", output]
    return command


def labelled(options, output):
    some = ["--resolutions", "0.02"] if options.quick else ["--resolutions", "0.02,0.01"]
    return [PROGRAMS / "bench_labelled", *some, "--json", output]


def mosd(options, output):
    some = ["--resolutions", "0.02"] if options.quick else ["--resolutions", "0.02,0.01"]
    return [PROGRAMS / "bench_labelled", "--mosd", *some, "--json", output]


def table1(options, output):
    return [PROGRAMS / "bench_table1", "--runs", str(min(options.seeds, 5)), "--json", output]


def speed(name, minutes, quick_minutes, needs="rgbd_7scenes_redkitchen"):
    def command(options, output):
        form = ["--short"] if options.quick else []
        return [PROGRAMS / "bench_speed", name, *form, "--json", output]
    return Task("speed", f"speed-{name}", f"speed: {name}", "bench_speed", command, minutes, quick_minutes, needs)


def demo(options, output):
    return ["bash", "-c", "./dev demo && cp out/demo/office.png docs/office.png"]


def demo_output(text):
    """From the map's summary to the scores; the build before and the files after it are left out."""
    begin, end = text.index("== Its map\n"), text.index("== Files\n")
    return {"text": text[begin:end]}


KITCHEN = "rgbd_7scenes_redkitchen"

# The most telling first: a budget cuts from the end.
TASKS = [
    Task("demo", "demo", "the demo's output and picture", "octosurf_app", demo, 1, 1, parse=demo_output),
    accuracy("depth", "depth camera, d = 2 cm", 5),
    accuracy("depth-real", "depth camera with a real one's faults, d = 2 cm", 5, "--sensor", "depth-real"),
    Task("paper", "paper", "the paper's pipeline from PCL, 20 scans each", "bench_accuracy", paper, 15, 8),
    accuracy("terrain", "terrain meshes, depth camera", 8, "--terrain", at_most=1, needs="terrain_meshes", group="terrain"),
    Task("kitchen", "kitchen-2cm", "the kitchen, d = 2 cm", "bench_kitchen", kitchen(0.02, 1), 1, 0.3, KITCHEN),
    Task("table1", "table1", "the paper's Table I", "bench_table1", table1, 6, 2, KITCHEN),
    speed("mapper", 3, 1),
    speed("memory", 1, 0.5),
    speed("occupancy", 5, 1),
    speed("app", 2, 1),
    accuracy("spinning", "spinning lidar, d = 2 cm", 8, "--sensor", "spinning"),
    accuracy("tilting", "tilting laser, d = 2 cm", 8, "--sensor", "tilting"),
    accuracy("noise", "depth camera, noise × 2", 5, "--noise-scale", "2"),
    accuracy("drift", "depth camera, drift of 15 mm and 0.3° a lap, two laps", 8, "--drift-m", "0.015", "--drift-deg", "0.3"),
    Task("labelled", "labelled", "labelled clouds beside CGAL and PCL", "bench_labelled", labelled, 4, 1.5,
         "labelled_synpeb_sample"),
    Task("labelled", "mosd", "a real table with things on it", "bench_labelled", mosd, 1, 0.5, "labelled_mosd"),
    Task("kitchen", "kitchen-1cm", "the kitchen, d = 1 cm, every third frame", "bench_kitchen", kitchen(0.01, 3), 1, 0.5,
         KITCHEN),
    speed("plain", 5, 1),
    speed("lidar", 4, 1, needs=""),
    speed("pcl", 6, 1),
    speed("loading", 1, 0.5),
    speed("planes", 5, 1),
    speed("normals", 1, 0.5),
    speed("derive", 2, 0.5, needs=""),
    accuracy("depth-1cm", "depth camera, d = 1 cm", 30, "--resolution", "0.01"),
    speed("long_run", 5, 1, needs=""),
]

GROUPS = list(dict.fromkeys(task.group for task in TASKS))


def tasks_of(names):
    """Of these groups or tasks, in the order above."""
    return [task for task in TASKS if task.group in names or task.name in names]
