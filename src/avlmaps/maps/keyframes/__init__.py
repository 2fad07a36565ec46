"""Keyframes: which frames they are, and their keypoints, places and views."""
