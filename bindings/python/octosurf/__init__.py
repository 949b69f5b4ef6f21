"""Contact surfaces on an OctoMap for legged robots.

Metres, radians, seconds; poses are 4x4 arrays, T_a_b from frame b to frame a. Arrays that are views keep alive what they
look into and cannot be written to; the docstrings say which are copies. Points are rows. Results have to_dict(); settings
can be pickled, too. What fails raises octosurf.Error, in a line that says what, where and the hint. Objects of the library may be
shared between threads; mapping, planning, loading and saving let other Python threads run.

    mapper = octosurf.Mapper(resolution=0.02)
    for scan in octosurf.open_scans("kitchen"):
        mapper.insert(scan)
    for surface in mapper.snapshot().surfaces:
        print(surface)
    octosurf.save_map(mapper.map(), "maps/kitchen")
"""

from octosurf import _octosurf
from octosurf._octosurf import *  # noqa: F403

__version__: str = _octosurf.__version__

__all__ = [name for name in dir(_octosurf) if not name.startswith("_")]
