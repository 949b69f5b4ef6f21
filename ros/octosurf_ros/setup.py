from glob import glob

from setuptools import setup

setup(
    name="octosurf_ros",
    version="0.1.0",
    packages=["octosurf_ros"],
    data_files=[("share/ament_index/resource_index/packages", ["resource/octosurf_ros"]),
                ("share/octosurf_ros", ["package.xml"]),
                ("share/octosurf_ros/config", glob("config/*")),
                ("share/octosurf_ros/launch", glob("launch/*")),
                ("share/octosurf_ros/rviz", glob("rviz/*"))],
    entry_points={"console_scripts": ["octosurf_mapping = octosurf_ros.node:main"]},
)
