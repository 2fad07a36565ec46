"""Start the map's node, the watchdog and, with rviz:=true, RViz with its configuration."""
# pyright: reportMissingImports=false

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return what to start."""
    share = get_package_share_directory("avlmaps_node")
    return LaunchDescription(
        [
            DeclareLaunchArgument("map", description="folder of the map (NAME.avlmap)"),
            DeclareLaunchArgument("robot_file", default_value="", description="JSON file of the robot's frames"),
            DeclareLaunchArgument("rviz", default_value="false", description="start RViz"),
            DeclareLaunchArgument("watchdog", default_value="false", description="start the watchdog (on the robot)"),
            Node(
                package="avlmaps_node",
                executable="map_node",
                name="avlmaps",
                output="screen",
                parameters=[
                    f"{share}/config/avlmaps.yaml",
                    {"map": LaunchConfiguration("map"), "robot_file": LaunchConfiguration("robot_file")},
                ],
            ),
            ExecuteProcess(
                cmd=["avlmaps-watchdog", "--silence", "2.0"],
                respawn=True,
                output="screen",
                condition=IfCondition(LaunchConfiguration("watchdog")),
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", f"{share}/rviz/avlmaps.rviz"],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
