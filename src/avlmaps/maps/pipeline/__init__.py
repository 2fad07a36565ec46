"""The build of a map, stage by stage: plan, check, estimate, encode and fuse, keyframes, sounds, write."""
