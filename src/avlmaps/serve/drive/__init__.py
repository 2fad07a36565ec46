"""The driving server: commands and programs for one robot, planned, confirmed and logged (`avlmaps serve --drive`).

It is off by default and apart from the server of maps: an application of its own under ``/drive``, with its own tools
under ``/drive/mcp``. It takes words and programs, never velocities. ``orders`` decides what may move.
"""
