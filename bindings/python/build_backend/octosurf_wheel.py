"""PEP 517 backend: drives CMake and packs the wheel. Python's standard library only.

The library is linked into the extension, Debian's libraries are not: the wheel works anywhere on the machine (or one like
it), not everywhere. Settings (pip install . --config-settings KEY=VALUE):

    build-dir   where CMake builds; build/wheel by default, kept so that the next time is quick. A build that is there,
                such as build/release, is used as it is configured.
    pcl         on: with the paper's detector, which takes PCL; looked at when build-dir is new.
    jobs        compilers at a time; as many as there are processors by default.

pip keeps what a backend prints to itself (pip -v shows it), so how far the build has come is one line on the terminal.
As a program it builds a wheel into a folder and prints its path; ./dev wheel does that.
"""

import argparse
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
import zipfile

CHECKOUT = pathlib.Path(__file__).resolve().parents[3]
# How Ninja, and make by CMake, begin the line of a step.
STEP = re.compile(r"\[\s*(?:(?P<done>\d+)/(?P<all>\d+)|(?P<percent>\d+%))\]")
OLDEST_DATE = (1980, 1, 1, 0, 0, 0)  # a zip's; the same files give the same wheel


VERSION = re.search(r"project\(octosurf VERSION (\S+)", (CHECKOUT / "CMakeLists.txt").read_text())[1]
PYTHON = f"cp{sys.version_info.major}{sys.version_info.minor}"
TAG = f"{PYTHON}-{PYTHON}-{re.sub('[-.]', '_', sysconfig.get_platform())}"
INFO = f"octosurf-{VERSION}.dist-info"
METADATA = f"""Metadata-Version: 2.1
Name: octosurf
Version: {VERSION}
Summary: Contact surfaces on an OctoMap for legged robots
License: Apache-2.0
Requires-Python: >=3.9
Requires-Dist: numpy
"""
WHEEL = f"Wheel-Version: 1.0\nGenerator: octosurf_wheel\nRoot-Is-Purelib: false\nTag: {TAG}\n"


def metadata_files():
    return {f"{INFO}/METADATA": METADATA.encode(), f"{INFO}/WHEEL": WHEEL.encode(),
            f"{INFO}/LICENSE": (CHECKOUT / "LICENSE").read_bytes()}


def terminal():
    """The terminal of whoever runs pip, or None: there is none, or it shows what is printed anyway."""
    try:
        return None if sys.stdout.isatty() else open("/dev/tty", "w")
    except OSError:
        return None


def run(*command):
    command = [str(part) for part in command]
    print("+", *command, flush=True)
    # As ./dev has it, so that either finds in ccache what the other has compiled.
    environment = os.environ | {"CCACHE_BASEDIR": str(CHECKOUT), "CCACHE_NOHASHDIR": "1"}
    began, shown = time.monotonic(), terminal()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, errors="replace", env=environment,
                          cwd=CHECKOUT) as process:
        for line in process.stdout:
            print(line, end="", flush=True)
            if shown and (step := STEP.match(line)):
                done = step["percent"] or f"{step['done']} of {step['all']}"
                minutes, seconds = divmod(int(time.monotonic() - began), 60)
                # Back to the line's start, where pip has its own mark: five columns are left to that.
                print(f"\r\x1b[K     octosurf: {done} built, {minutes}:{seconds:02} min\r", end="", file=shown, flush=True)
    if process.returncode != 0:
        raise SystemExit(f"octosurf_wheel: {command[0]} failed; its lines above say why (pip -v shows them all)")


def built_package(settings):
    """The package's files as CMake installs them: path in the wheel -> bytes."""
    build = CHECKOUT / settings.get("build-dir", "build/wheel")
    if not (build / "CMakeCache.txt").exists():
        off = ["TESTS", "BENCH", "APPS", "OCTOMAP"] + ["PCL"] * (settings.get("pcl") != "on")
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        run("cmake", "-S", CHECKOUT, "-B", build, *generator, "-DCMAKE_BUILD_TYPE=Release", "-DOCTOSURF_UNITY_BUILD=ON",
            "-DBUILD_SHARED_LIBS=OFF", "-DOCTOSURF_BUILD_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}",
            *[f"-DOCTOSURF_BUILD_{part}=OFF" for part in off])
    jobs = settings.get("jobs", os.cpu_count() or 1)
    run("cmake", "--build", build, "--target", "octosurf_python", "--parallel", jobs)
    with tempfile.TemporaryDirectory() as staging:
        run("cmake", "--install", build, "--component", "python", "--prefix", staging)
        root = pathlib.Path(staging)
        files = {str(file.relative_to(root)): file.read_bytes() for file in root.rglob("*") if file.is_file()}
    if not any(path.endswith(sysconfig.get_config_var("EXT_SUFFIX")) for path in files):
        raise SystemExit(f"octosurf_wheel: {build} is for another Python than {sys.executable}; "
                         "give another build-dir, or run that Python")
    return files


def record(files):
    lines = []
    for path, content in sorted(files.items()):
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        lines.append(f"{path},sha256={digest},{len(content)}\n")
    return "".join(lines)


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """Without it pip would build the wheel to learn its name and what it needs."""
    pathlib.Path(metadata_directory, INFO).mkdir(parents=True)
    for path, content in metadata_files().items():
        pathlib.Path(metadata_directory, path).write_bytes(content)
    return INFO


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    files = built_package(config_settings or {}) | metadata_files()
    files[f"{INFO}/RECORD"] = f"{record(files)}{INFO}/RECORD,,\n".encode()
    name = f"octosurf-{VERSION}-{TAG}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in sorted(files.items()):
            entry = zipfile.ZipInfo(path, OLDEST_DATE)
            entry.external_attr = (0o755 if path.endswith(".so") else 0o644) << 16
            wheel.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return name


class UnsupportedOperation(Exception):
    """What PEP 517 lets a backend say of source archives."""


def build_sdist(sdist_directory, config_settings=None):
    raise UnsupportedOperation("the checkout is the source archive: pip install PATH")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Builds the wheel of octosurf and prints its path.")
    arguments.add_argument("folder", type=pathlib.Path, help="where the wheel is written")
    arguments.add_argument("--build-dir", default="build/wheel", help="where CMake builds [build/wheel]")
    chosen = arguments.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    print(chosen.folder / build_wheel(chosen.folder, {"build-dir": chosen.build_dir}))
