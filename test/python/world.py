"""What the tests of the Python package share: the checkout, the command, a simulated recording, a mapped floor."""

import functools
import os
import pathlib
import subprocess
import tempfile

import numpy as np
import octosurf

SOURCE = pathlib.Path(os.environ["OCTOSURF_SOURCE"])
BUILD = pathlib.Path(os.environ["OCTOSURF_BUILD"])
_folder = tempfile.TemporaryDirectory(prefix="octosurf_python_")
FOLDER = pathlib.Path(_folder.name)


def command(*arguments):
    program = os.environ["OCTOSURF"] + ("-lab" if arguments[0] in ("simulate", "evaluate") else "")
    subprocess.run([program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


@functools.cache
def recording():
    """Six depth images of a simulated room."""
    folder = FOLDER / "room"
    command("simulate", "room", "--seed", 3, "--frames", 6, "-o", folder)
    return folder


def grid(x, y, z):
    """Points of a height field over two axes, (N, 3)."""
    x, y = np.meshgrid(x, y)
    return np.stack(np.broadcast_arrays(x, y, z(x, y)), axis=-1).reshape(-1, 3)


def floor(size=1.0, step=0.01):
    """A level square as a sensor 1 m above it sees it, in the sensor's frame, which is the map's but for the height."""
    axis = np.arange(-size / 2, size / 2, step)
    return grid(axis, axis, lambda x, y: -1)


def at(*position):
    """A pose."""
    pose = np.eye(4)
    pose[:3, 3] = position
    return pose


ABOVE = at(0, 0, 1)


def floor_mapper(**keywords):
    mapper = octosurf.Mapper(**keywords)
    mapper.share_octree()
    mapper.insert_points(floor(), ABOVE)
    return mapper


@functools.cache
def mapped_floor():
    """The same, to be looked at only."""
    return floor_mapper()
