"""Install the node, its launch file, parameters and the configuration of RViz."""

from pathlib import Path

from setuptools import setup

setup(
    name="avlmaps_ros",
    version="0.3.0",
    packages=["avlmaps_ros"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/avlmaps_ros"]),
        ("share/avlmaps_ros", ["package.xml"]),
        *(
            (f"share/avlmaps_ros/{folder}", [str(file) for file in sorted(Path(folder).iterdir())])
            for folder in ("launch", "config", "rviz")
        ),
    ],
    install_requires=["setuptools", "avlmaps"],
    description="An audio-visual-language map in ROS 2",
    license="MIT",
    entry_points={"console_scripts": ["map_node = avlmaps_ros.node:main"]},
)
