"""./dev package: what it makes installs in a fresh Debian by mmdebstrap, and maps there."""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import world

SOURCES = [pathlib.Path("/etc/apt/sources.list.d/debian.sources"), pathlib.Path("/etc/apt/sources.list")]


def run(*command):
    return subprocess.run([str(part) for part in command], text=True, capture_output=True)


class Package(unittest.TestCase):
    def test_command_and_module_map_in_a_fresh_root(self):
        if not shutil.which("mmdebstrap") or not shutil.which("help2man") or os.geteuid() != 0:
            self.skipTest("not root on a Debian with mmdebstrap and help2man")
        root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()), "root")
        mirrors = [uri for file in SOURCES if file.exists() for uri in re.findall(r"^(?:URIs:|deb) .*?(https?://\S+)", file.read_text(), re.MULTILINE)]
        release = re.search(r"VERSION_CODENAME=(\w+)", pathlib.Path("/etc/os-release").read_text())[1]
        self.assertEqual(run(world.SOURCE / "dev", "package").returncode, 0)
        package = max((world.SOURCE / "out").glob("octosurf_*.deb"), key=os.path.getmtime)
        unpacked, consumer = root.parent / "unpacked", root.parent / "consumer"
        for command in (("dpkg-deb", "-x", package, unpacked),
                        ("cmake", "-S", world.SOURCE / "test/consumer/project", "-B", consumer, "-G", "Ninja",
                         f"-DCMAKE_PREFIX_PATH={unpacked}/usr"),
                        ("cmake", "--build", consumer, "--target", "floor"), (consumer / "floor",)):
            done = run(*command)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("1 polygons", done.stdout)
        proxies = [f"--aptopt={file}" for file in pathlib.Path("/etc/apt/apt.conf.d").glob("99*")]  # and what else a host needs
        install = f'chroot "$1" apt-get install -y -qq --no-install-recommends /tmp/{package.name} python3-numpy'
        made = run("mmdebstrap", "--variant=apt", "--mode=root", *proxies, f"--customize-hook=copy-in {package} /tmp",
                   f"--customize-hook={install}", release, root, *(f"deb [trusted=yes] {uri} {release} main" for uri in mirrors[:1]))
        if "copy-in" not in made.stderr:
            self.skipTest(f"no fresh root: {made.stderr[-200:]}")
        self.assertEqual(made.returncode, 0, made.stderr)
        (root / "tmp/scans").mkdir()
        floor = [f"{x / 100} {y / 100} -1" for x in range(-100, 100) for y in range(-100, 100)]
        header = ["VERSION .7", "FIELDS x y z", "SIZE 4 4 4", "TYPE F F F", "COUNT 1 1 1", f"WIDTH {len(floor)}", "HEIGHT 1", "DATA ascii"]
        (root / "tmp/scans/1.pcd").write_text("\n".join(header + floor) + "\n")
        (root / "tmp/poses.txt").write_text("1 0 0 1 0 0 0 1\n")
        for command, says in (("cd /tmp && octosurf map scans --poses poses.txt -o floor && octosurf info floor", "surfaces             1"),
                              ("cd /tmp && python3 -c 'import octosurf; print(len(octosurf.load(\"floor\").snapshot().surfaces))'", "1"),
                              ("ls /usr/share/man/man1/", "octosurf.1.gz")):
            done = run("chroot", root, "sh", "-c", command)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(says, done.stdout)
