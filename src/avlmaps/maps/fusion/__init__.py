"""Fusing frames into voxels: measuring a frame, adding it up, and the sums over voxels."""
