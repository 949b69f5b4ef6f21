"""Which Debian packages build, tests and ./dev use that ./dev does not install: a new machine would lack them.

check_packages.py ROOT BUILD [--without PACKAGE...]

Used are the packages of: headers (ninja's record of each compilation), libraries, CMake's packages and programs (its cache and
build.ninja), programs that ./dev and tests run by name, and modules that Python programs import. Listed is what apt would
install for the lists in ./dev on a machine that has nothing but the essential packages, less those of --without, for a test of
this program. Exit code 77: no Debian, no build by Ninja, or apt has no lists of packages."""

import ast
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

INFO = pathlib.Path("/var/lib/dpkg/info")
SKIPPED = 77
# Where the shell expects a command: at the beginning of a line or list, behind a word of its own, behind what runs others.
IN_SHELL = re.compile(r"(?:^|[|&;(!]|\b(?:then|do|else|if|while|exec|xargs|command -v|sh -c ['\"])) *(?:-\S+ +)*([a-z][\w.+-]+)", re.MULTILINE)
HERE_DOCUMENT = re.compile(r"<<-?'?(\w+)'?.*?^\1$", re.DOTALL | re.MULTILINE)
IN_PYTHON = re.compile(r"(?:which|run|check_output|check_call|Popen|require)\(\[?((?:\"[a-z][\w.+-]*\"(?:, )?)+)|[\[(]\"([a-z][\w.+-]+)\", \"-")
IN_CMAKE = re.compile(r"COMMAND ([a-z][\w.+-]+)|find_program\(\w+ (?:NAMES )?([a-z][\w.+ -]*)|command -v ([\w-]+)")
PIP = {"pip"}  # that of a virtual environment


def output_of(*command):
    return subprocess.run(command, capture_output=True, text=True, env=dict(os.environ, LC_ALL="C")).stdout


def sources(root, *endings):
    for folder in ("test", "lab", "bench", "examples", "docs", "apps", "src", "bindings", "cmake", "web"):
        for file in (root / folder).rglob("*"):
            if (file.suffix in endings or file.name in endings) and "node_modules" not in file.parts:
                yield file


def build_files(build):
    for line in output_of("ninja", "-C", build, "-t", "deps").splitlines():
        if line.startswith("    /usr/"):
            yield line.strip()
    for value in re.findall(r"^[^:#/][^:]*:[A-Z]+=(/usr/[^;\n]+)", (build / "CMakeCache.txt").read_text(), re.MULTILINE):
        yield value
        if "/cmake/" in value and os.path.isdir(value):
            yield from map(str, pathlib.Path(value).glob("*.cmake"))
    yield from re.findall(r"/usr/[^ ;\"]+\.(?:so|a)[0-9.]*", (build / "build.ninja").read_text())


def programs(root):
    names = set()
    for file in [root / "dev", root / ".ci/run", *sources(root, ".sh")]:
        names.update(IN_SHELL.findall(HERE_DOCUMENT.sub("", file.read_text())))
    for file in sources(root, ".py"):
        for several, one in IN_PYTHON.findall(file.read_text()):
            names.update([one, *re.findall(r"[\w.+-]+", several)])
    for file in [root / "CMakeLists.txt", *sources(root, ".cmake", "CMakeLists.txt")]:
        for found in IN_CMAKE.findall(file.read_text()):
            names.update(" ".join(found).split())
    paths = (shutil.which(name, path="/usr/sbin:/usr/bin:/sbin:/bin") for name in names - PIP - {""})
    return [path for path in paths if path]


def modules(root):
    """Files of what Debian's Python imports; modules that only a virtual environment has are not found here."""
    names = set()
    for file in sources(root, ".py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                names.update(alias.name.split(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module.split(".")[0])
    found = (importlib.util.find_spec(name) for name in sorted(names - set(sys.stdlib_module_names)))
    return [spec.origin for spec in found if spec and spec.origin]


def owners(files):
    """The packages of files, links followed; /lib and /usr/lib are one."""
    def place(file):
        file = os.path.realpath(file)
        return file if file.startswith("/usr/") else "/usr" + file

    wanted = {place(file) for file in files if os.path.exists(file)}
    found = set()
    for listing in INFO.glob("*.list"):
        names = listing.read_text().split("\n")
        if any(name in wanted or "/usr" + name in wanted for name in names if not os.path.isdir(name)):
            found.add(listing.stem.split(":")[0])
    return found


def listed_in_dev(text):
    lists = re.findall(r"^\w+_packages=\((.*?)\)", re.sub(r" *#.*", "", text), re.DOTALL | re.MULTILINE)
    return set(" ".join(lists).split())


def installed_by(packages):
    """What apt would fetch on a machine that has nothing: half the time of a simulation, which orders the packages, too."""
    essential = re.findall(r"^(\S+) yes$", output_of("dpkg-query", "-W", "-f", "${Package} ${Essential}\n"), re.MULTILINE)
    with tempfile.TemporaryDirectory() as archives:
        plan = output_of("apt-get", "-o", "Dir::State::status=/dev/null", "-o", f"Dir::Cache::archives={archives}", "-o", "Debug::NoLocking=1",
                         "install", "-qq", "--print-uris", "--no-install-recommends", "apt", *essential, *packages)
    return set(re.findall(r"^'\S+' ([^_ ]+)_", plan, re.MULTILINE))


def main(root, build, without):
    if not INFO.exists() or not (build / "build.ninja").exists():
        print("skipped: no Debian, or no build by Ninja")
        return SKIPPED
    listed = listed_in_dev((root / "dev").read_text())
    known = installed_by(sorted(listed - set(without)))
    if "apt" not in known:
        print("skipped: apt cannot simulate an installation here; apt-get update first")
        return SKIPPED
    used = owners([*build_files(build), *programs(root), *modules(root)])
    missing = sorted(used - known)
    if missing:
        print(f"used, but not among what ./dev installs: {' '.join(missing)}")
    else:
        print(f"all {len(used)} packages that were used are among the {len(known)} that ./dev installs")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[4:]))
