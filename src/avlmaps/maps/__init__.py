"""The map: fusing frames into voxels, choosing keyframes, hearing sounds, keeping it all on disk."""
