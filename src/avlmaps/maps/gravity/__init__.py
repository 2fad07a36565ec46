"""Up and the floor: the up direction in a recording, and how high the floor lies under the camera."""
