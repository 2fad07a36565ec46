"""Whether a recording agrees with itself: depth, poses, intrinsics and colour of frames that see the same place."""
