"""ros2 launch octosurf_ros octosurf.launch.py depth:=/camera/depth/image_rect_raw output:=maps/lab [rviz:=true]

Or config:=FILE, parameters as in config/robot.yaml. Every parameter: ros2 param describe /octosurf NAME.
"""

import os

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "config": "file of parameters; those that are given here win",
    "depth": "topic of depth images",
    "cloud": "topic of point clouds",
    "output": "the map's files, without ending [octosurf_map]",
    "resume": "go on with the map that is there [true]",
    "frame": "the map's, in tf",
    "base": "the robot's, in tf",
    "resolution": "m",
}


def mapping(context):
    given = {name: yaml.safe_load(text) for name in ARGUMENTS if (text := LaunchConfiguration(name).perform(context))}
    usual = given.pop("config", {"output": "octosurf_map", "resume": True})
    return [Node(package="octosurf_ros", executable="octosurf_mapping", name="octosurf", output="screen",
                 parameters=[one for one in (usual, given) if one])]


def generate_launch_description():
    view = os.path.join(get_package_share_directory("octosurf_ros"), "rviz", "octosurf.rviz")
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value="", description=text) for name, text in ARGUMENTS.items()),
        DeclareLaunchArgument("rviz", default_value="false"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="of RViz; the node goes by stamps"),
        OpaqueFunction(function=mapping),
        Node(package="rviz2", executable="rviz2", arguments=["-d", view], condition=IfCondition(LaunchConfiguration("rviz")),
             parameters=[{"use_sim_time": LaunchConfiguration("use_sim_time")}]),
    ])
