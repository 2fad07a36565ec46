"""`avlmaps bench live`: a live map at the pace of a robot, beside the build of the same recording, and under kills."""
