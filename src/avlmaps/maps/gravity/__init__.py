"""Up and the floor: which way is up in a recording, and how high the floor lies under the camera."""
