"""PEP 517 backend: drives CMake and packs the wheel. Python's standard library only.

The library is linked into the extension, Debian's libraries are not: the wheel works anywhere on the machine (or one like
it), not everywhere. Settings (pip install . --config-settings KEY=VALUE):

    build-dir   where CMake builds; build/wheel by default, kept so that the next time is quick. A build that is there,
                such as build/release, is used as it is configured.
    jobs        compilers at a time; as many as there are processors by default.
"""

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
import zipfile

CHECKOUT = pathlib.Path(__file__).resolve().parents[3]
SUMMARY = "Contact surfaces on an OctoMap for legged robots"
OLDEST_DATE = (1980, 1, 1, 0, 0, 0)  # a zip's; the same files give the same wheel


def version():
    project = (CHECKOUT / "CMakeLists.txt").read_text()
    return re.search(r"project\(octosurf VERSION (\S+)", project).group(1)


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"{python}-{python}-{platform}"


def metadata_files():
    info = f"octosurf-{version()}.dist-info"
    metadata = (
        f"Metadata-Version: 2.1\nName: octosurf\nVersion: {version()}\nSummary: {SUMMARY}\n"
        f"License: Apache-2.0\nRequires-Python: >=3.9\nRequires-Dist: numpy\n"
    )
    wheel = f"Wheel-Version: 1.0\nGenerator: octosurf_wheel\nRoot-Is-Purelib: false\nTag: {tag()}\n"
    return {f"{info}/METADATA": metadata.encode(), f"{info}/WHEEL": wheel.encode(),
            f"{info}/LICENSE": (CHECKOUT / "LICENSE").read_bytes()}


def run(*command):
    print("+", *command, flush=True)
    subprocess.run([str(part) for part in command], check=True)


def built_package(settings):
    """The package's files as CMake installs them: path in the wheel -> bytes."""
    build = CHECKOUT / settings.get("build-dir", "build/wheel")
    if not (build / "CMakeCache.txt").exists():
        options = ["BUILD_TESTS", "BUILD_BENCH", "BUILD_APPS", "BUILD_OCTOMAP", "BUILD_PCL", "BUILD_ROS1"]
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        run("cmake", "-S", CHECKOUT, "-B", build, *generator, "-DCMAKE_BUILD_TYPE=Release", "-DBUILD_SHARED_LIBS=OFF",
            "-DOCTOSURF_BUILD_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}",
            *[f"-DOCTOSURF_{option}=OFF" for option in options])
    jobs = settings.get("jobs", os.cpu_count() or 1)
    run("cmake", "--build", build, "--target", "octosurf_python", "--parallel", jobs)
    with tempfile.TemporaryDirectory() as staging:
        run("cmake", "--install", build, "--component", "python", "--prefix", staging)
        root = pathlib.Path(staging)
        return {str(file.relative_to(root)): file.read_bytes() for file in root.rglob("*") if file.is_file()}


def record(files):
    lines = []
    for path, content in sorted(files.items()):
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        lines.append(f"{path},sha256={digest},{len(content)}\n")
    return "".join(lines)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    files = built_package(config_settings or {}) | metadata_files()
    own = f"octosurf-{version()}.dist-info/RECORD"
    files[own] = (record(files) + f"{own},,\n").encode()
    name = f"octosurf-{version()}-{tag()}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in sorted(files.items()):
            entry = zipfile.ZipInfo(path, OLDEST_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if path.endswith(".so") else 0o644) << 16
            wheel.writestr(entry, content)
    return name


class UnsupportedOperation(Exception):
    """What PEP 517 lets a backend say of source archives."""


def build_sdist(sdist_directory, config_settings=None):
    raise UnsupportedOperation("the checkout is the source archive: pip install PATH")
