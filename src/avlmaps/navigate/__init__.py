"""Driving a robot to what a command names: planner, controller, bodies, and the skills that programs call."""
