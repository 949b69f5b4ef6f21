"""./dev package: what it makes installs in a fresh Debian by mmdebstrap. There it maps, programs link it with the packages that it
suggests (but libpcl-dev: a gigabyte), and the tutorial runs."""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import world

SOURCES = [pathlib.Path("/etc/apt/sources.list.d/debian.sources"), pathlib.Path("/etc/apt/sources.list")]
BAGS = "python3-rosbag python3-sensor-msgs python3-tf2-msgs"


def run(*command):
    return subprocess.run([str(part) for part in command], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def write_floor(folder):
    (folder / "scans").mkdir()
    floor = [f"{x / 100} {y / 100} -1" for x in range(-100, 100) for y in range(-100, 100)]
    header = ["VERSION .7", "FIELDS x y z", "SIZE 4 4 4", "TYPE F F F", "COUNT 1 1 1", f"WIDTH {len(floor)}", "HEIGHT 1", "DATA ascii"]
    (folder / "scans/1.pcd").write_text("\n".join(header + floor) + "\n")
    (folder / "poses.txt").write_text("1 0 0 1 0 0 0 1\n")


class Package(unittest.TestCase):
    def check(self, says, *command):
        done = run(*command)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn(says, done.stdout)

    def test_maps_links_and_teaches_in_a_fresh_root(self):
        if not shutil.which("mmdebstrap") or not shutil.which("help2man") or os.geteuid() != 0:
            self.skipTest("not root on a Debian with mmdebstrap and help2man")
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        root, work = folder / "root", folder / "work"
        mirrors = [uri for file in SOURCES if file.exists() for uri in re.findall(r"^(?:URIs:|deb) .*?(https?://\S+)", file.read_text(), re.MULTILINE)]
        release = re.search(r"VERSION_CODENAME=(\w+)", pathlib.Path("/etc/os-release").read_text())[1]
        self.check("", world.SOURCE / "dev", "package")
        package = max((world.SOURCE / "out").glob("octosurf_*.deb"), key=os.path.getmtime)
        suggested = run("dpkg-deb", "-f", package, "Suggests").stdout.strip().replace(",", "").replace("libpcl-dev", "")
        self.assertNotEqual(run("dpkg-deb", "-f", package, "Depends").stdout.strip(), "")
        shutil.copytree(world.SOURCE / "test/consumer/project", work / "consumer")
        project = work / "consumer/CMakeLists.txt"
        project.write_text(re.sub(r"^# The paper's.*?\n\n", "", project.read_text(), flags=re.DOTALL | re.MULTILINE))
        for file in ("docs/tutorial.md", "test/docs/blocks.py"):
            (work / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(world.SOURCE / file, work / file)
        (work / "maps").mkdir()
        (work / "examples").symlink_to("/usr/share/octosurf/examples")
        write_floor(work)
        # The package first alone: what it maps by is among what it depends on.
        (work / "use").write_text(f"""set -eu
cd /work
apt="apt-get install -y -qq --no-install-recommends"
$apt /work/{package.name} python3-numpy
octosurf map scans --poses poses.txt -o floor
octosurf info floor > info
python3 -c 'import octosurf; print(len(octosurf.load("floor").snapshot().surfaces))' > python
$apt g++ cmake make {suggested} {BAGS}
""")
        shutil.copy(package, work)
        proxies = [f"--aptopt={file}" for file in pathlib.Path("/etc/apt/apt.conf.d").glob("99*")]  # and what else a host needs
        made = run("mmdebstrap", "--variant=apt", "--mode=root", *proxies, f"--customize-hook=copy-in {work} /",
                   '--customize-hook=chroot "$1" sh /work/use', release, root, *(f"deb [trusted=yes] {uri} {release} main" for uri in mirrors[:1]))
        if "copy-in" not in made.stdout:
            self.skipTest(f"no fresh root: {made.stdout[-200:]}")
        self.assertEqual(made.returncode, 0, made.stdout[-2000:])
        self.assertIn("surfaces             1", (root / "work/info").read_text())
        self.assertEqual((root / "work/python").read_text(), "1\n")
        self.assertTrue((root / "usr/share/man/man1/octosurf.1.gz").exists())
        inside = ("env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "chroot", root, "sh", "-euc")
        self.check("", *inside, "cd /work && cmake -S consumer -B built && cmake --build built --target floor everything octree")
        self.check("1 polygons", *inside, "cd /work && built/floor && built/everything && built/octree")
        self.check("right on surface", *inside, "cd /work && OCTOSURF=/usr/bin/octosurf python3 -B test/docs/blocks.py run docs/tutorial.md")
