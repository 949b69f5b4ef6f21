#!/usr/bin/env python3
"""Measures what the documents show, and writes it there.

Without an option every task that has not been measured at the present commit is run, the most telling first, in
half an hour at most; longer tasks run where --long names them.
docs/results.md, docs/demo.md with its picture and the README's table are then written from what was measured at this commit.
What was not is listed as such: no row of another commit is ever shown. A row's commit is the last one that
touched code (src, include, apps, lab, test, cmake), so that writing the documents does not outdate them.
"""

import argparse
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

import results_tables as tables
from results_tasks import GROUPS, LONG, TASKS, tasks_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
STORE = ROOT / "out/bench/results"
DATA = ROOT.parent / "shared/data"
CODE = ["src", "include", "apps", "lab", "test", "cmake", "CMakeLists.txt", "CMakePresets.json"]
GRACE_S = 30  # a task may take so much longer than the last time before the budget counts as spent


def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], check=True, capture_output=True, text=True).stdout.strip()


def commit_of_code():
    """`git describe` of the last commit that touched code; where the checkout differs, with how in brief."""
    last = git("log", "-1", "--format=%H", "--", *CODE)
    name = git("describe", "--always", last)
    changes = git("diff", "HEAD", "--", *CODE) + git("status", "--porcelain", "--", *CODE)
    return f"{name}-dirty-{hashlib.sha1(changes.encode()).hexdigest()[:7]}" if changes else name


def machine():
    model = platform.machine()
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            model = line.split(": ", 1)[1]
            break
    return f"{model}, {os.cpu_count()} cores"


def stored(task):
    """What was measured last; none if nothing was, or the file is damaged."""
    try:
        return json.loads((STORE / f"{task.name}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def is_present(record, commit):
    return record is not None and record["commit"] == commit


def measure(task, options, commit):
    """Runs a task; returns why it failed, if it did. Only a whole record is ever stored."""
    STORE.mkdir(parents=True, exist_ok=True)
    output = STORE / f"{task.name}.part"
    output.unlink(missing_ok=True)
    command = task.command(options, output)
    log = STORE / f"{task.name}.log"
    started = time.monotonic()
    with log.open("w", encoding="utf-8") as stream:
        code = subprocess.run(command, cwd=ROOT, stdout=stream, stderr=subprocess.STDOUT).returncode
    took = time.monotonic() - started
    text = log.read_text(encoding="utf-8", errors="replace")
    if code != 0:
        lines = text.strip().splitlines() or ["no message"]
        return f"exit code {code}: {lines[-1]}"
    try:
        content = json.loads(output.read_text(encoding="utf-8")) if output.exists() else task.parse(text)
    except (OSError, ValueError) as error:
        return f"left no numbers: {error}"
    output.unlink(missing_ok=True)
    record = {"commit": commit, "date": datetime.date.today().isoformat(), "machine": machine(),
              "load": os.getloadavg()[0], "seconds": took, "seeds": options.seeds,
              "content": content}
    temporary = STORE / f"{task.name}.json.part"
    temporary.write_text(json.dumps(record), encoding="utf-8")
    temporary.replace(STORE / f"{task.name}.json")
    return None


def expected_s(task, options):
    """What the task took last time with as many seeds; else its rough guess."""
    record = stored(task)
    if record and record["seeds"] == options.seeds:
        return record["seconds"]
    return 60 * task.minutes * (options.seeds if task.seeded else 1)


def run_all(tasks, options, commit):
    """Measures what is missing within the budget. Returns reasons by task for what was not."""
    reasons = {}
    end = time.monotonic() + 60 * options.budget if options.budget else float("inf")
    for number, task in enumerate(tasks, 1):
        if task.needs and not (DATA / task.needs).exists():
            reasons[task.name] = f"no ../shared/data/{task.needs}"
            continue
        if is_present(stored(task), commit) and not options.again:
            continue
        guess = expected_s(task, options)
        if time.monotonic() + guess > end + GRACE_S:
            reasons[task.name] = f"takes about {guess / 60:.0f} min, beyond the budget"
            continue
        print(f"[{number}/{len(tasks)}] {task.name}: {task.title} (about {guess / 60:.1f} min)", flush=True)
        failure = measure(task, options, commit)
        if failure:
            reasons[task.name] = failure
            print(f"  failed: {failure}", flush=True)
        else:
            print(f"  took {stored(task)['seconds'] / 60:.1f} min", flush=True)
    return reasons


def put_between(file, mark, text):
    """Replaces what stands between <!-- mark --> and <!-- /mark -->."""
    old = file.read_text(encoding="utf-8")
    pattern = re.compile(rf"(<!-- {mark} -->\n).*?(<!-- /{mark} -->)", re.DOTALL)
    if not pattern.search(old):
        sys.exit(f"{file}: has no marks <!-- {mark} --> and <!-- /{mark} -->")
    file.write_text(pattern.sub(lambda match: match[1] + text + match[2], old), encoding="utf-8")


def write_documents(commit, reasons):
    records = {}
    for task in TASKS:
        record = stored(task)
        if is_present(record, commit):
            records[task.name] = record
            reasons.pop(task.name, None)
        elif task.long:
            reasons.setdefault(task.name, f"takes about {task.minutes:g} min: `--long {task.name}`")
        else:
            reasons.setdefault(task.name, "not measured at this commit")
    text, ten = tables.document(records, commit, TASKS, reasons)
    (ROOT / "docs/results.md").write_text(text, encoding="utf-8")
    put_between(ROOT / "README.md", "results", ten)
    demo = records.get("demo")
    put_between(ROOT / "docs/demo.md", "demo", tables.demo_block(demo))
    print(f"wrote docs/results.md, docs/demo.md and README.md: {len(records)} of {len(TASKS)} tasks at {commit}")


def main():
    parser = argparse.ArgumentParser(prog="./dev bench results", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(GROUPS), help="groups or tasks, with commas; groups: " + ", ".join(GROUPS))
    parser.add_argument("--long", metavar="TASK", action="append", choices=LONG, default=[],
                        help="also this one: " + ", ".join(LONG))
    parser.add_argument("--seeds", type=int, default=1, help="of the simulated rows [%(default)s]")
    parser.add_argument("--budget", type=float, help="MINUTES: begin nothing that would not end in time")
    parser.add_argument("--again", action="store_true", help="measure also what was measured at this commit")
    parser.add_argument("--write", action="store_true", help="measure nothing, write what there is")
    parser.add_argument("--list", action="store_true", help="tasks, what each takes, and which are measured")
    parser.add_argument("--targets", action="store_true", help=argparse.SUPPRESS)  # for ./dev
    options = parser.parse_args()
    tasks = tasks_of(options.only.split(",") + options.long)
    if not tasks:
        parser.error(f"--only {options.only}: no such group or task; --list names them")
    if options.targets:
        print("\n".join(sorted({task.target for task in tasks} | {"octosurf_app"})))
        return
    commit = commit_of_code()
    if options.list:
        for task in tasks + [task for task in TASKS if task.long and task not in tasks]:
            record = stored(task)
            state = f"measured at {record['commit']} in {record['seconds'] / 60:.1f} min" if record else "never measured"
            note = f"  only with --long {task.name}" if task not in tasks else ""
            print(f"{task.group:10} {task.name:15} about {expected_s(task, options) / 60:4.1f} min  {state}{note}")
        print(f"about {sum(expected_s(task, options) for task in tasks) / 60:.0f} min in all, --long ones as named")
        return
    write_documents(commit, {} if options.write else run_all(tasks, options, commit))


if __name__ == "__main__":
    main()
