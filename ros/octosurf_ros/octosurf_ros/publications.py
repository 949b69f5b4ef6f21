"""The map about the robot, latched: published when it has changed and somebody listens."""

import functools
import threading
import time

import numpy as np
import octosurf
from nav_msgs.msg import OccupancyGrid
from octomap_msgs.msg import Octomap
from octosurf_msgs.msg import SurfaceChanges, Surfaces
from rclpy.qos import QoSProfile

from octosurf_ros import messages, terrain

NOTHING = set(), set()
BOX_FOLLOWS = 0.125  # share of the radius that the robot moves before the box around it does
TOPICS = {"surfaces": "octosurf_msgs/Surfaces", "stairs": "octosurf_msgs/Stairs",
          "markers": "visualization_msgs/MarkerArray", "octomap_binary": "octomap_msgs/Octomap",
          "octomap_full": "octomap_msgs/Octomap", "grid_map": "grid_map_msgs/GridMap",
          "planar_terrain": "convex_plane_decomposition_msgs/PlanarTerrain", "storey": "nav_msgs/OccupancyGrid"}


def rules_of(options, up, resolution):
    """Of the ground that is published."""
    rules = octosurf.GroundRules.of(octosurf.Quadruped(), resolution)
    rules.foot = octosurf.ContactShape.disc(options.foot_radius)
    rules.limits.up, rules.limits.max_slope_rad = up, np.radians(options.max_slope)
    rules.limits.clearance_m = options.clearance
    if options.clearance <= 0:
        rules.limits.obstacle_margin_m = rules.limits.unknown_to_m = 0
    return rules


class Publications:
    def __init__(self, node, mapping):
        self.mapping, self.options, self.log = mapping, node.options, node.get_logger()
        self.topics = {topic: there for topic, word in TOPICS.items() if (there := node.advertise(topic, word))}
        # Changes need each other, so that none makes way for the next.
        self.changes = self.topics["surface_changes"] = node.advertise(
            "surface_changes", "octosurf_msgs/SurfaceChanges", QoSProfile(depth=100))
        self.bytes, self.ms, self.lock, self.all_within = 0, 0.0, threading.Lock(), None
        # Of the thread that publishes: what was sent last on each topic, the box's middle, the octree looked at; the
        # map and its revision when what is in the box had last changed, and the ids of that.
        self.sent, self.middle, self.octree, self.version, self.problems = {}, None, None, 0, {}
        self.ground, self.since, self.had, self.receivers = None, 0, NOTHING, 0
        node.every(node.options.publish, self.publish_map)

    def publish_all(self, radius):
        """The next publication is on all topics, and of what is within so many m; 0: everything."""
        with self.lock:
            self.all_within = radius

    def publish_map(self):
        began = time.monotonic()
        with self.lock:
            within, self.all_within = self.all_within, None
        every, radius = within is not None, self.options.radius if within is None else within
        receivers, self.receivers = self.receivers, self.changes.get_subscription_count()
        if not every and not any(one.get_subscription_count() for one in self.topics.values()):
            return
        moment = self.mapping.moment
        snapshot, ground, frame, stamp_ns = moment.snapshot, moment.ground, self.options.frame, moment.stamp_ns
        box = self.box_of(moment, radius)
        corners = () if box is None else tuple(box)
        space = octosurf.ConvexSpace.box(*corners) if corners else octosurf.ConvexSpace([])
        cylinders = [one for one in snapshot.cylinders if box is None or meets(box, *extent_of(one))]
        near = set(ground.index(snapshot).inside(space)), {one.id for one in cylinders}
        surfaces = functools.cache(lambda: [snapshot.find(id) for id in sorted(near[0])])
        whole = every or self.receivers > receivers or self.ground is not ground  # who comes later has nothing
        since, had = (0, NOTHING) if whole else (self.since, self.had)
        ids = [*messages.changed_ids(snapshot, since, near, had)]
        changed = whole or any(map(any, ids))
        if changed:
            self.ground, self.since, self.had = ground, snapshot.revision, near
        if changed or snapshot.octree.changed_in(self.octree, *corners):
            self.version += 1
        self.octree = snapshot.octree
        look = self.version, None if box is None else box.tolist()

        def publish(topic, make):
            to = self.topics.get(topic)
            if to is None or not every and (self.sent.get(topic) == look or to.get_subscription_count() == 0):
                return
            try:
                if message := make():
                    to.publish(message)
                    self.bytes += len(message)
                self.sent[topic] = look
                self.problems.pop(topic, None)
            except Exception as error:  # a grid of too many cells, for example: said once in a row
                if self.problems.get(topic) != str(error):
                    self.log.warning(f"not published: {topic}: {error}")
                self.problems[topic] = str(error)

        def near_steps(stair_steps):
            return box is None or any(meets(box, np.min(one.edge, 0), np.max(one.edge, 0)) for one in stair_steps)

        def stairs():
            found = ground.bare(snapshot).stairs()
            return messages.stairs_message(snapshot.revision, [one for one in found.stairs if near_steps(one.steps)],
                                           [one for one in found.single_steps if near_steps([one])], frame, stamp_ns)

        def octomap(full):
            if snapshot.octree.resolution > 0:
                data = np.frombuffer(snapshot.octree.octomap_data(*corners, full=full), "i1")
                return messages.cdr(Octomap, {"header": messages.header(frame, stamp_ns), "binary": not full,
                                              "id": "OcTree", "resolution": snapshot.resolution, "data": data})

        publish("surface_changes", lambda: changed and messages.cdr(
            SurfaceChanges, messages.surface_changes(snapshot, since, ids, frame, stamp_ns)))
        publish("surfaces", lambda: messages.cdr(
            Surfaces, messages.surfaces(snapshot, surfaces(), cylinders, frame, stamp_ns)))
        publish("stairs", stairs)
        publish("markers", lambda: messages.markers_message(surfaces(), frame, stamp_ns))
        publish("octomap_binary", lambda: octomap(full=False))
        publish("octomap_full", lambda: octomap(full=True))
        kept = Terrain(snapshot, ground, sorted(near[0]), box, self.options)
        publish("grid_map", lambda: kept.grid_map(stamp_ns))
        publish("planar_terrain", lambda: kept.planar_terrain(stamp_ns))
        if moment.place is not None:
            publish("storey", lambda: kept.storey(moment))
        self.ms = (time.monotonic() - began) * 1e3

    def box_of(self, moment, radius):
        """Two corners; None: everything. It moves with the robot, but not with every scan."""
        if radius <= 0 or moment.place is None:
            return None
        if self.middle is None or np.linalg.norm(self.middle - moment.place) > BOX_FOLLOWS * radius:
            self.middle = moment.place
        return np.array([self.middle - radius, self.middle + radius])


class Terrain:
    """Grid map and planar terrain, of one height grid."""

    def __init__(self, snapshot, ground, near, box, options):
        self.snapshot, self.ground, self.near, self.box, self.options = snapshot, ground, near, box, options
        self.cell, self.made = max(options.grid_cell, snapshot.resolution), None

    def view(self):
        return self.ground.view(self.snapshot, rules_of(self.options, self.ground.up, self.snapshot.resolution))

    def grid(self):
        if self.made is None:
            view = self.view()
            solid = view.solid().only(self.near)
            self.made = view, solid, octosurf.height_grid(
                solid, cell=self.cell, up=self.ground.up, max_slope_rad=np.radians(self.options.max_slope),
                within=None if self.box is None else self.box[:, :2])
        return self.made

    def grid_map(self, stamp_ns):
        grid = self.grid()[2]
        if not grid.elevation.size:  # nothing level yet
            return None
        layers = {"elevation": grid.elevation, **dict(zip(("normal_x", "normal_y", "normal_z"), grid.normal)),
                  "surface_id": grid.surface}
        return messages.cdr(messages.class_of(TOPICS["grid_map"]), messages.grid_map(
            layers, grid.center, grid.cell, self.options.frame, stamp_ns))

    def planar_terrain(self, stamp_ns):
        view, solid, grid = self.grid()
        if not grid.elevation.size:
            return None
        surfaces = octosurf.planner_surfaces(solid, view.rules.foot, limits=view.rules.limits,
                                             octree=self.snapshot.octree)
        return messages.cdr(messages.class_of(TOPICS["planar_terrain"]), terrain.planar_terrain(
            surfaces, grid, self.options.frame, stamp_ns))

    def storey(self, moment):
        """The one that the robot is on, whole: with ground nearest beneath the place of the last scan."""
        def distance(one):
            rows, columns = np.divmod(np.flatnonzero(one.elevation < moment.place[2]), one.columns)
            at = one.origin + one.cell_m * (np.stack([columns, rows], axis=1) + 0.5)
            return np.linalg.norm(at - moment.place[:2], axis=1).min(initial=np.inf), -one.height_m

        limits = octosurf.StoreyLimits(radius_m=self.options.robot_radius, headroom_m=self.options.headroom,
                                       cell_m=self.cell)
        one = min(octosurf.find_storeys(self.view(), limits), key=distance, default=None)
        if one is None:
            return None
        corner = {"position": (*one.origin, one.height_m), "orientation": (0, 0, 0, 1)}
        return messages.cdr(OccupancyGrid, {
            "header": messages.header(self.options.frame, moment.stamp_ns),
            "info": {"resolution": one.cell_m, "width": one.columns, "height": one.rows, "origin": corner},
            "data": np.array([-1, 0, 100], "i1")[one.cells]})


def meets(box, low, high):
    return bool(np.all(low <= box[1]) and np.all(high >= box[0]))


def extent_of(cylinder):
    half = cylinder.axis * cylinder.length_m / 2
    around = cylinder.radius_m * np.sqrt(np.maximum(0, 1 - cylinder.axis**2))
    ends = np.array([cylinder.axis_point - half, cylinder.axis_point + half])
    return ends.min(0) - around, ends.max(0) + around
