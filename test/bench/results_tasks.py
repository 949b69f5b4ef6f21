"""What results.py measures: one task per program run."""

import dataclasses
import pathlib
from typing import Callable

PROGRAMS = pathlib.Path("build/release/test/bench")


@dataclasses.dataclass(frozen=True)
class Task:
    """`command(options, output)`: writes JSON to `output`, or prints what `parse` makes JSON of. Minutes are
    rough: alone on two cores, with one seed. A long task runs only if it is named."""
    group: str
    name: str
    title: str
    target: str
    command: Callable
    minutes: float
    needs: str = ""  # in ../shared/data
    parse: Callable = None
    seeded: bool = False  # takes so long for each seed
    long: bool = False


def seeds(options, at_most=1000):
    return ",".join(str(seed) for seed in range(1, min(options.seeds, at_most) + 1))


def accuracy(name, title, minutes, *arguments, at_most=1000, needs="", group="accuracy", long=False):
    def command(options, output):
        return [PROGRAMS / "bench_accuracy", "--only", "ours/default", "--seeds", seeds(options, at_most), *arguments,
                "--json", output]
    return Task(group, name, title, "bench_accuracy", command, minutes, needs, seeded=at_most > 1, long=long)


def paper(options, output):
    """The paper's detector takes a third of a second a scan and more: 20 scans of each recording, the same for all."""
    return [PROGRAMS / "bench_accuracy", "--only", "ours,cgal", "--frames", "20", "--seeds", seeds(options, 2),
            "--json", output]


def kitchen(resolution, every):
    def command(options, output):
        return [PROGRAMS / "bench_kitchen", "--resolution", str(resolution), "--every", str(every), "--json", output]
    return command


def labelled(*arguments):
    def command(options, output):
        return [PROGRAMS / "bench_labelled", *arguments, "--resolutions", "0.02,0.01", "--json", output]
    return command


def table1(*arguments):
    def command(options, output):
        return [PROGRAMS / "bench_table1", *arguments, "--runs", str(min(options.seeds, 5)), "--json", output]
    return command


def speed(name, minutes, needs="rgbd_7scenes_redkitchen", pattern="", long=False):
    def command(options, output):
        return [PROGRAMS / "bench_speed", f"--benchmark_filter=^({pattern or name})/", f"--benchmark_out={output}"]
    return Task("speed", f"speed-{name}", f"speed: {name}", "bench_speed", command, minutes, needs, long=long)


def demo(options, output):
    return ["bash", "-c", "./dev demo && cp out/demo/office.png docs/office.png"]


def demo_output(text):
    """From the map's summary to the scores; the build before and the files after it are left out."""
    begin, end = text.index("== Its map\n"), text.index("== Files\n")
    return {"text": text[begin:end]}


KITCHEN = "rgbd_7scenes_redkitchen"

# The most telling first: a budget cuts from the end.
TASKS = [
    Task("demo", "demo", "the demo's output and picture", "octosurf_app", demo, 0.2, parse=demo_output),
    accuracy("depth", "depth camera, d = 2 cm", 0.5),
    accuracy("depth-real", "depth camera with a real one's faults, d = 2 cm", 0.8, "--sensor", "depth-real"),
    Task("paper", "paper", "the paper's detector from PCL's parts and CGAL, 20 scans each", "bench_accuracy", paper, 1.2),
    accuracy("terrain", "terrain meshes, depth camera", 1.1, "--terrain", at_most=1, needs="terrain_meshes", group="terrain"),
    Task("kitchen", "kitchen-2cm", "the kitchen, d = 2 cm", "bench_kitchen", kitchen(0.02, 1), 0.3, KITCHEN),
    Task("table1", "table1", "the paper's Table I", "bench_table1", table1(), 0.8, KITCHEN),
    # At 1 cm moving least squares over all that is pending take minutes for each run.
    Task("table1", "table1-paper", "the paper's Table I by the paper's detector", "bench_table1",
         table1("--detector", "paper", "--resolution", "0.02"), 0.6, KITCHEN),
    speed("kitchen", 3.5),
    speed("app", 1.5, pattern="app|realtime"),
    accuracy("spinning", "spinning lidar, d = 2 cm", 0.6, "--sensor", "spinning"),
    accuracy("tilting", "tilting laser, d = 2 cm", 0.7, "--sensor", "tilting"),
    accuracy("noise", "depth camera, noise × 2", 0.7, "--noise-scale", "2"),
    accuracy("drift", "depth camera, drift of 15 mm and 0.3° a lap, two laps", 0.9, "--drift-m", "0.015", "--drift-deg", "0.3"),
    Task("labelled", "labelled", "labelled clouds beside CGAL and PCL", "bench_labelled", labelled(), 0.6,
         "labelled_synpeb_sample"),
    Task("labelled", "mosd", "a real table with things on it", "bench_labelled", labelled("--mosd"), 0.1, "labelled_mosd"),
    Task("kitchen", "kitchen-1cm", "the kitchen, d = 1 cm, every third frame", "bench_kitchen", kitchen(0.01, 3), 0.9,
         KITCHEN),
    speed("lidar", 3, needs=""),
    speed("loading", 0.5),
    accuracy("depth-1cm", "depth camera, d = 1 cm", 3, "--resolution", "0.01", long=True),
    speed("long_run", 5, needs="", long=True),
]

GROUPS = list(dict.fromkeys(task.group for task in TASKS))
LONG = [task.name for task in TASKS if task.long]


def tasks_of(names):
    """Of these groups or tasks, in the order above; of a group's the long ones only by their own name."""
    return [task for task in TASKS if task.name in names or (task.group in names and not task.long)]
