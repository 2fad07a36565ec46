"""The demonstration: record a room, map it, ask it, and write a report with pictures."""

from avlmaps_sim.demo.run import run_demo

__all__ = ["run_demo"]
