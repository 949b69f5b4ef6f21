"""The ground about the robot at its controller's rate."""

import time

import numpy as np
import octosurf
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float32MultiArray

from octosurf_ros import messages
from octosurf_ros.publications import rules_of

MAP_AGE_S = 0.1  # the map is read as often; the robot's pose is that of each patch


class Patches:
    def __init__(self, node, mapping):
        self.mapping, self.options = mapping, node.options
        length, width, self.cell = node.options.patch_length, node.options.patch_width, node.options.patch_cell
        self.heading = octosurf.PatchLayout.grid(length, width, self.cell)
        self.square = octosurf.PatchLayout.grid(max(length, width), max(length, width), self.cell)
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.patch = node.advertise("patch", "grid_map_msgs/GridMap", qos)
        self.heights = node.advertise("heights", "std_msgs/Float32MultiArray", qos)
        self.view, self.looked = None, 0.0
        node.every(1 / node.options.patch_rate, self.publish_patches)

    def publish_patches(self):
        wanted = [one is not None and one.get_subscription_count() > 0 for one in (self.patch, self.heights)]
        if not any(wanted):
            return
        if time.monotonic() - self.looked > MAP_AGE_S:
            snapshot, ground = self.mapping.moment[:2]
            self.view = ground.view(snapshot, rules_of(self.options, ground.up, snapshot.resolution))
            self.looked = time.monotonic()
        T_map_base, stamp_ns = self.mapping.base_pose()
        if wanted[1]:
            heights = self.view.patch(T_map_base, self.heading).height
            rows = len(np.unique(self.heading.points[:, 0]))
            self.heights.publish(messages.cdr(Float32MultiArray, messages.multi_array(
                heights, (("x", rows), ("y", len(heights) // rows)))))
        if wanted[0]:
            level = np.eye(4)
            level[:3, 3] = T_map_base[:3, 3]
            patch = self.view.patch(level, self.square)
            side = round(len(patch.height) ** 0.5)
            values = {"elevation": patch.height + level[2, 3], "cell": patch.cell, "slope": patch.slope_rad,
                      "edge": patch.edge_m}
            # From x and y ascending to descending.
            layers = {name: value.reshape(side, side)[::-1, ::-1].astype("f4") for name, value in values.items()}
            grid = messages.grid_map(layers, level[:2, 3], self.cell, self.options.frame, stamp_ns)
            self.patch.publish(messages.cdr(self.patch.msg_type, grid))
