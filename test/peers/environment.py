"""Makes the virtual environment of a test against software that others wrote, or runs that test in it.

environment.py FOLDER REQUIREMENTS            makes it, unless it is one of these requirements already
environment.py FOLDER REQUIREMENTS TEST...    runs unittest TEST...
environment.py FOLDER REQUIREMENTS FILE.py ARGUMENT...
                                              runs FILE.py with the environment's programs, or without if there is none

What cannot be had (venv, index, a wheel) is named, and the test is skipped: exit code 77."""
import os
import pathlib
import shutil
import subprocess
import sys

folder, requirements = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
python, made, missing = folder / "bin/python", folder / "requirements.txt", folder / "missing.txt"


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def run(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        errors = [line for line in done.stdout.splitlines() if "ERROR" in line or "error" in line]
        missing.write_text(f"{requirements.name}: {' '.join(errors[-1:]) or done.stdout.strip()}")
        skip(missing.read_text())


def make():
    if made.exists() and made.read_text() == requirements.read_text():
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    run(sys.executable, "-m", "venv", folder)
    run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:",
        "--retries", "1", "--timeout", "15", "--requirement", requirements)
    made.write_text(requirements.read_text())


if len(sys.argv) == 3:
    make()
elif sys.argv[3].endswith(".py"):
    os.environ["PATH"] = f"{folder / 'bin'}:{os.environ['PATH']}"
    program = python if made.exists() else sys.executable
    os.execv(program, [program, "-B", *sys.argv[3:]])
elif made.exists():
    os.execv(python, [python, "-B", "-m", "unittest", *sys.argv[3:]])
else:
    skip(missing.read_text() if missing.exists() else f"{folder} is not made")
