"""Install the node, its launch file, parameters and the configuration of RViz."""

from pathlib import Path

from setuptools import setup

setup(
    name="avlmaps_node",
    version="0.3.0",
    packages=["avlmaps_node"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/avlmaps_node"]),
        ("share/avlmaps_node", ["package.xml"]),
        *(
            (f"share/avlmaps_node/{folder}", [str(file) for file in sorted(Path(folder).iterdir())])
            for folder in ("launch", "config", "rviz")
        ),
    ],
    install_requires=["setuptools", "avlmaps"],
    description="An audio-visual-language map in ROS 2",
    license="MIT",
    entry_points={"console_scripts": ["map_node = avlmaps_node.node:main"]},
)
