#!/usr/bin/env python3
"""Which tests catch small wrong changes: each *.patch here, applied by itself to a copy of the checkout.

The fast tier runs first; with --full all other tests where it has caught nothing. Tests that fail without any
change catch nothing: exit 2. A change that does not compile is caught by the compiler, and is no mutant worth
keeping: exit 2. Exit 1 if fewer are caught than LEAST.
"""

import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LEAST = {"fast": 23, "full": 27}  # of twenty-nine


def patches(names):
    found = sorted(HERE.glob("*.patch"))
    return [p for p in found if not names or any(name in p.name for name in names)]


def run(command, where):
    return subprocess.run(command, cwd=where, capture_output=True, text=True, errors="replace", check=False)


def applies(patch, where, *more):
    return run(["git", "apply", *more, patch], where).returncode == 0


def copy_of_checkout(copy):
    """The files that git knows, as they are now; what has not changed keeps its time, so that little compiles anew."""
    copy.mkdir(parents=True, exist_ok=True)
    files = run(["git", "ls-files", "-co", "--exclude-standard"], ROOT).stdout.splitlines()
    for name in files:
        source, target = ROOT / name, copy / name
        if not source.is_file() or (target.is_file() and target.read_bytes() == source.read_bytes()):
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
        shutil.copymode(source, target)
    kept = set(files)
    for target in copy.rglob("*"):
        name = target.relative_to(copy)
        if target.is_file() and name.parts[0] not in (".git", "build", "out") and str(name) not in kept:
            target.unlink()  # removed from the checkout since
    if not (copy / ".git").exists():
        run(["git", "init", "-q"], copy)  # patches apply to this folder, not to the checkout around it


def failed_tests(copy, jobs, *selection):
    """Names of the tests of CTest that fail first, and of GoogleTest's in them: one is enough."""
    # mutants.Apply is left out: a patch that is applied does not apply again, so it would catch every change.
    ours = ["--exclude-regex", "^mutants[.]", "--no-tests=error", "--output-on-failure", "--stop-on-failure",
            "--timeout", "600"]
    done = run(["ctest", "--preset", "release", "-j", jobs, *ours, *selection], copy)
    if done.returncode == 0:
        return []
    cases = sorted(set(re.findall(r"^\[  FAILED  \] (\S+?),? ?\(\d+ ms\)", done.stdout, re.MULTILINE)))
    return cases or re.findall(r"^\s+\d+ - (\S+)", done.stdout, re.MULTILINE) or ["ctest"]


def judge_copy(copy, jobs, full):
    build = ["cmake", "--build", "--preset", "release", "-j", jobs]
    built = run([*build, *([] if full else ["--target", "fast_tests"])], copy)
    if built.returncode != 0:
        return "does not compile", []
    if caught := failed_tests(copy, jobs, "--label-regex", "^fast$"):
        return "fast", caught
    if full and (caught := failed_tests(copy, jobs, "--label-exclude", "^fast$")):
        return "full", caught
    return "missed", []


def judge(patch, copy, jobs, full):
    if not applies(patch, copy):
        return "does not apply", []
    try:
        return judge_copy(copy, jobs, full)
    finally:
        applies(patch, copy, "--reverse")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of patches' names; all by default")
    parser.add_argument("--full", action="store_true", help="all tests for what the fast tier misses")
    parser.add_argument("--jobs", default="2")
    parser.add_argument("--copy", type=pathlib.Path, default=ROOT / "out/mutants", help="where the copy is")
    parser.add_argument("--apply-only", action="store_true", help="check that each patch applies, build nothing")
    arguments = parser.parse_args()
    chosen = patches(arguments.names)
    if arguments.apply_only:
        stale = [patch.name for patch in chosen if not applies(patch, ROOT, "--check")]
        print(f"{len(chosen)} mutants, {len(stale)} do not apply", *stale, sep="\n  ")
        return 1 if stale or not chosen else 0
    copy_of_checkout(arguments.copy)
    prepared = run(["cmake", "--preset", "release"], arguments.copy)
    if prepared.returncode != 0:
        print(prepared.stderr)
        return 2
    verdict, failing = judge_copy(arguments.copy, arguments.jobs, arguments.full)
    if verdict != "missed":
        print(f"stopped, without any change: {verdict}", *failing, sep="\n  ")
        return 2
    verdicts = []
    for patch in chosen:
        begin = time.monotonic()
        verdict, caught = judge(patch, arguments.copy, arguments.jobs, arguments.full)
        verdicts.append(verdict)
        more = f" and {len(caught) - 3} more" if len(caught) > 3 else ""
        print(f"{patch.stem:32} {verdict:16} {time.monotonic() - begin:4.0f} s  {', '.join(caught[:3])}{more}", flush=True)
    fast, full = verdicts.count("fast"), verdicts.count("fast") + verdicts.count("full")
    print(f"caught by the fast tier {fast}, by all tests {full if arguments.full else '(--full)'}, of {len(verdicts)}")
    if any(verdict.startswith("does not") for verdict in verdicts):
        return 2
    # Of a part of them, as large a part.
    share = len(verdicts) / len(patches([]))
    return 1 if fast < LEAST["fast"] * share or (arguments.full and full < LEAST["full"] * share) else 0


if __name__ == "__main__":
    sys.exit(main())
