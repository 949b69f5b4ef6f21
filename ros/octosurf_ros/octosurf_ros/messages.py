"""ROS 2's messages out of the map, as bytes: a map has more points than Python should make objects of."""

import functools
import importlib
import re
import struct

import numpy as np
import octosurf
from octosurf_msgs.msg import Stairs
from visualization_msgs.msg import MarkerArray

NUMBERS = {"boolean": "?", "octet": "B", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I",
           "int32": "i", "uint64": "Q", "int64": "q", "float": "f", "double": "d"}
POINTS = {"geometry_msgs/Point": "<f8", "geometry_msgs/Vector3": "<f8",
          "convex_plane_decomposition_msgs/Point2d": "<f4"}


def cdr(kind, value):
    """A message of the class `kind`, of dicts, lists and arrays (points by rows); what is left out is 0 or empty."""
    out = bytearray()
    _of_class(kind)(out, value)
    return b"\0\1\0\0" + out


def class_of(word):
    package, name = word.split("/")
    return getattr(importlib.import_module(package + ".msg"), name)


def _align(out, size):
    out.extend(bytes(-len(out) % size))


def _write_text(out, value):
    text = (value or "").encode() + b"\0"
    _align(out, 4)
    out.extend(struct.pack("<I", len(text)) + text)


@functools.cache
def _of_class(kind):
    """Writes a message: a function of the bytes so far and the value."""
    fields = [(name, _writer(word)) for name, word in kind.get_fields_and_field_types().items()]
    fields = fields or [("", _writer("uint8"))]  # an empty structure is a byte

    def write(out, value):
        if value is None:
            value = {}
        elif not isinstance(value, dict):  # the numbers of a point
            value = dict(zip((name for name, _ in fields), value))
        for name, write_field in fields:
            write_field(out, value.get(name))

    return write


@functools.cache
def _writer(word):
    """Likewise by the name of a type, such as sequence<geometry_msgs/Point>."""
    if word in NUMBERS:
        one = struct.Struct("<" + NUMBERS[word])

        def write_number(out, value):
            _align(out, one.size)
            out.extend(one.pack(value or 0))

        return write_number
    if word == "string":
        return _write_text
    listed = re.fullmatch(r"sequence<(.+)>|(.+)\[(\d+)\]", word)
    if not listed:
        return _of_class(class_of(word))
    element, length = listed[1] or listed[2], listed[3]
    code = POINTS.get(element) or "<" + NUMBERS.get(element, "")
    dtype = np.dtype(code) if code != "<" else None
    write_element = _writer(element)

    def write_list(out, value):
        if value is None:
            value = np.zeros(int(length or 0)) if dtype else ()
        if not length:
            _align(out, 4)
            out.extend(struct.pack("<I", len(value)))
        if dtype and len(value):
            _align(out, dtype.itemsize)
            out.extend(np.asarray(value, dtype).tobytes())
        elif not dtype:
            for one in value:
                write_element(out, one)

    return write_list


def header(frame, stamp_ns):
    return {"stamp": {"sec": stamp_ns // 10**9, "nanosec": stamp_ns % 10**9}, "frame_id": frame}


def pose(matrix):
    """geometry_msgs/Pose of a 4x4 array: the quaternion from the largest of four sums (Shepperd)."""
    r = matrix[:3, :3]
    trace = np.trace(r)
    squares = np.append(np.diag(r) * 2 - trace, trace) + 1
    most = int(np.argmax(squares))
    x, y, z = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    rows = np.array([[squares[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], x],
                     [r[0, 1] + r[1, 0], squares[1], r[1, 2] + r[2, 1], y],
                     [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[2], z],
                     [x, y, z, squares[3]]])
    return {"position": matrix[:3, 3], "orientation": rows[most] / np.linalg.norm(rows[most])}


def polygons(surface, of):
    """octosurf_msgs/Polygon[] of outlines (u, v) on a surface."""
    return [{"outer": {"points": surface.to_map(one.outer)},
             "holes": [{"points": surface.to_map(hole)} for hole in one.holes]} for one in of]


def colour(rgb, alpha):
    return dict(zip("rgba", (*rgb, alpha)))


def surfaces(snapshot, of, cylinders, frame, stamp_ns):
    """octosurf_msgs/Surfaces, a dict: of some surfaces and cylinders of a snapshot."""
    return {"header": header(frame, stamp_ns), "revision": snapshot.revision, "resolution": snapshot.resolution,
            "surfaces": [{"id": one.id, "color": colour(one.color, 1), "normal": one.plane.normal,
                          "offset": one.plane.offset, "pose": pose(one.T_map_surface),
                          "polygons": polygons(one, one.polygons), "area": one.area_m2, "inliers": one.inliers,
                          "rms": one.rms_m, "covariance": one.covariance.ravel(), "born": one.born,
                          "revision": one.revision, "parents": one.parents} for one in of],
            "cylinders": [{"id": one.id, "axis_point": one.axis_point, "axis": one.axis, "radius": one.radius_m,
                           "length": one.length_m, "start": one.start, "span": one.span_rad, "inliers": one.inliers,
                           "rms": one.rms_m, "born": one.born, "revision": one.revision} for one in cylinders]}


def changed_ids(snapshot, since, near=(None, None), had=(None, None)):
    """(changed, gone, merged) of surfaces since a revision, then of cylinders. Pairs of sets of ids, if they are known:
    `near`, what is looked at; `had`, what the receiver has."""
    of = octosurf.changes_since(snapshot, since)
    both = (({*of.appeared, *of.changed}, of.gone, of.merged),
            ({*of.cylinders_appeared, *of.cylinders_changed}, of.cylinders_gone, of.cylinders_merged))
    for (changed, gone, merged), near, had in zip(both, near, had):
        if near is not None:
            changed &= near
        if had is not None:
            changed, merged = changed | near - had, [one for one in merged if one[0] in had]
            gone = had - near - {before for before, _ in merged}
        yield sorted(changed), sorted(gone), merged


def surface_changes(snapshot, since, ids, frame, stamp_ns):
    """octosurf_msgs/SurfaceChanges, a dict: of changed_ids()."""
    (changed, gone, merged), (cylinders, cylinders_gone, cylinders_merged) = ids
    return {"since": since, "gone": gone, "merged": merged, "cylinders_gone": cylinders_gone,
            "cylinders_merged": cylinders_merged, "changed": surfaces(
                snapshot, [snapshot.find(id) for id in changed],
                [one for one in snapshot.cylinders if one.id in cylinders], frame, stamp_ns)}


def step(one):
    return {"lower": one.lower, "upper": one.upper, "riser": one.riser_m, "width": one.width_m,
            "heading": one.heading_rad, "left": one.edge[0], "right": one.edge[1]}


def stairs_message(revision, stairs, single_steps, frame, stamp_ns):
    return cdr(Stairs, {
        "header": header(frame, stamp_ns), "revision": revision, "single_steps": [step(one) for one in single_steps],
        "stairs": [{"id": one.id, "kind": one.kind, "steps": [step(riser) for riser in one.steps], "treads": one.treads,
                    "landing_below": one.landing_below, "landing_above": one.landing_above, "riser": one.riser.mean_m,
                    "riser_std": one.riser.std_m, "tread": one.tread.mean_m, "tread_std": one.tread.std_m,
                    "width": one.width_m, "heading": one.heading_rad, "turn": one.turn_rad} for one in stairs]})


def markers_message(of, frame, stamp_ns):
    """Each surface as triangles in its colour, after all that was shown before is deleted."""
    triangle_list, delete_all = 11, 3
    every = {"header": header(frame, stamp_ns), "ns": "surfaces", "pose": pose(np.eye(4)), "scale": np.ones(3)}
    markers = [{**every, "action": delete_all}]
    for one in of:
        mesh = one.mesh()
        markers.append({**every, "id": one.id, "type": triangle_list, "color": colour(one.color, 0.9),
                        "points": mesh.vertices[mesh.triangles.ravel()]})
    return cdr(MarkerArray, {"markers": markers})


def multi_array(values, sizes):
    """std_msgs/Float32MultiArray; `sizes`: labels and sizes of its dimensions, the slowest first."""
    strides = np.cumprod([size for _, size in reversed(sizes)])[::-1]
    return {"data": values, "layout": {"dim": [{"label": label, "size": size, "stride": int(stride)}
                                               for (label, size), stride in zip(sizes, strides)]}}


def grid_map(layers, center, cell, frame, stamp_ns):
    """grid_map_msgs/GridMap, a dict: rows run against x, columns against y, stored column by column."""
    rows, columns = next(iter(layers.values())).shape
    place = np.eye(4)
    place[:2, 3] = center
    return {"header": header(frame, stamp_ns), "layers": list(layers), "basic_layers": ["elevation"],
            "info": {"resolution": cell, "length_x": cell * rows, "length_y": cell * columns, "pose": pose(place)},
            "data": [multi_array(layer.ravel("F"), (("column_index", columns), ("row_index", rows)))
                     for layer in layers.values()]}
