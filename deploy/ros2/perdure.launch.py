"""Starts perdure-ros2 and RViz: ros2 launch /usr/share/perdure/ros2/perdure.launch.py

The other services of Perdure run beside it (systemctl start perdure.target, or deploy/demo --keep).
"""

import pathlib

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

HERE = pathlib.Path(__file__).resolve().parent


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("config", default_value="/etc/perdure/ros2.yaml",
                              description="configuration of perdure-ros2"),
        DeclareLaunchArgument("clock", default_value="false",
                              description="true for a recorded drive: publish /clock, and let RViz use it"),
        DeclareLaunchArgument("rviz", default_value="true", description="start RViz as well"),
        ExecuteProcess(cmd=["perdure-ros2", "--config", LaunchConfiguration("config"),
                            "--set", ["out.clock=", LaunchConfiguration("clock")]],
                       output="screen"),
        Node(package="rviz2", executable="rviz2", arguments=["-d", str(HERE / "perdure.rviz")],
             parameters=[{"use_sim_time": LaunchConfiguration("clock")}],
             condition=IfCondition(LaunchConfiguration("rviz"))),
    ])
