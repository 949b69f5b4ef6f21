"""ros2 launch octosurf_ros octosurf.launch.py depth:=/camera/depth/image_rect_raw output:=maps/lab [rviz:=true]

Every parameter of the node: ros2 param describe /octosurf NAME; here those that one gives most often.
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    "depth": ("", "topic of depth images; or:"),
    "cloud": ("", "topic of point clouds"),
    "output": ("octosurf_map", "the map's files, without ending"),
    "resume": ("true", "go on with the map that is there"),
    "frame": ("map", "the map's, in tf"),
    "base": ("base_link", "the robot's, in tf"),
    "resolution": ("0.02", "m"),
}


def generate_launch_description():
    kinds = {"resume": bool, "resolution": float}
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kinds.get(name, str)) for name in ARGUMENTS}
    view = os.path.join(get_package_share_directory("octosurf_ros"), "rviz", "octosurf.rviz")
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()),
        DeclareLaunchArgument("rviz", default_value="false"),
        Node(package="octosurf_ros", executable="octosurf_mapping", name="octosurf", parameters=[parameters], output="screen"),
        Node(package="rviz2", executable="rviz2", arguments=["-d", view], condition=IfCondition(LaunchConfiguration("rviz"))),
    ])
