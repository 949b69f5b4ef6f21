"""What the tests of the Python package share: the checkout, the command, a simulated recording."""

import functools
import os
import pathlib
import subprocess
import tempfile

SOURCE = pathlib.Path(os.environ["OCTOSURF_SOURCE"])
BUILD = pathlib.Path(os.environ["OCTOSURF_BUILD"])
_folder = tempfile.TemporaryDirectory(prefix="octosurf_python_")
FOLDER = pathlib.Path(_folder.name)


def command(*arguments):
    program = os.environ["OCTOSURF"] + ("-lab" if arguments[0] == "simulate" else "")
    subprocess.run([program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


@functools.cache
def recording():
    """Ten depth images of a simulated room."""
    folder = FOLDER / "room"
    command("simulate", "room", "--seed", 3, "--frames", 10, "-o", folder)
    return folder
