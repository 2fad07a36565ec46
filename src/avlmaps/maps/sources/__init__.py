"""Where sounds came from: evidence of microphones along the walk, over the surfaces of a map."""
