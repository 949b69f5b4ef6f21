"""ros2 launch octosurf_ros octosurf.launch.py depth:=/camera/depth/image_rect_raw output:=maps/lab [rviz:=true]

Every parameter of the node: ros2 param describe /octosurf NAME; here those that one gives most often.
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer, Node
from launch_ros.descriptions import ComposableNode

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
    parameters = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    mapping = ComposableNode(package="octosurf_ros", plugin="octosurf::ros::MappingNode", name="octosurf", parameters=[parameters])
    view = os.path.join(get_package_share_directory("octosurf_ros"), "rviz", "octosurf.rviz")
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()),
        DeclareLaunchArgument("rviz", default_value="false"),
        ComposableNodeContainer(package="rclcpp_components", executable="component_container", name="octosurf_container",
                                namespace="", composable_node_descriptions=[mapping], output="screen"),
        Node(package="rviz2", executable="rviz2", arguments=["-d", view], condition=IfCondition(LaunchConfiguration("rviz"))),
    ])
