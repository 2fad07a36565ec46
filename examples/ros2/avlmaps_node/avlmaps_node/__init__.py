"""An audio-visual-language map in ROS 2: topics to look at and services to query."""
