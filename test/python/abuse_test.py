"""Every callable of the module with None and with what else does not fit, and every object's pickle, in a child process
each: none may end the interpreter."""

import itertools
import os
import pickle
import signal
import tempfile
import unittest

import numpy as np

import octosurf
from world import floor_mapper

SLOW_S = 60


class Raising:
    """As an array."""

    def __array__(self, *_, **__):
        raise KeyError("its own")


def in_child(work):
    """The signal that ends a child which does this, and what it wrote last; None if it exits."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(SLOW_S)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        work(lambda words: os.write(write, f"{words}\n".encode()))
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as said:
        last = said.read().decode().splitlines()[-1:]
    status = os.waitpid(child, 0)[1]
    ended = os.WTERMSIG(status) if os.WIFSIGNALED(status) else None
    return None if ended in (None, signal.SIGALRM) else (signal.Signals(ended).name, *last)


class WhatDoesNotFit(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.addClassCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)  # some of them write files
        mapper = floor_mapper(resolution=0.05)
        mapper.share_octree()
        snapshot = mapper.snapshot()
        (surface,) = snapshot.surfaces
        cls.objects = [mapper, mapper.map(), snapshot, surface, snapshot.octree, octosurf.SurfaceIndex(snapshot),
                       octosurf.GroundView(snapshot, snapshot.octree), octosurf.Biped(), octosurf.Parameters(),
                       octosurf.Transforms(), octosurf.Scan(np.ones((3, 3)), np.eye(4))]
        cls.values = [None, 0.1, "x", [0, 0, 0], np.eye(4), Raising(), *cls.objects[1:8]]

    def callables(self):
        yield from ((name, one) for name, one in vars(octosurf).items() if callable(one) and not name.startswith("_"))
        for object in self.objects:
            for name in dir(object):
                if callable(one := getattr(object, name)) and not name.startswith("_"):
                    yield f"{type(object).__name__}.{name}", one

    def test_ends_no_interpreter(self):
        ended, count = {}, 0
        for name, one in self.callables():
            def work(say):
                for arguments in itertools.chain(itertools.product(self.values, repeat=1), itertools.product(self.values, repeat=2),
                                                 itertools.product(self.values[:5:4] + self.values[7:10], repeat=3)):
                    say([type(value).__name__ for value in arguments])
                    try:
                        one(*arguments)
                    except Exception:
                        pass
            count += 1
            if how := in_child(work):
                ended[name] = how
        self.assertGreater(count, 150)
        self.assertEqual(ended, {})

    def test_is_not_pickled_or_comes_back(self):
        for object in self.objects:
            def work(say):
                for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
                    say(protocol)
                    try:
                        pickle.loads(pickle.dumps(object, protocol))
                    except TypeError:
                        pass
                for reduce in (object.__reduce__, lambda: object.__reduce_ex__(0)):
                    try:
                        reduce()
                    except TypeError:
                        pass
            self.assertIsNone(in_child(work), type(object))

    def test_raises_its_own(self):
        for call in (lambda: octosurf.Scan(Raising(), np.eye(4)), lambda: self.objects[3].to_map(Raising())):
            self.assertRaisesRegex(KeyError, "its own", call)


if __name__ == "__main__":
    unittest.main()
