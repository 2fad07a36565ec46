"""The suite `avlmaps bench sources`: where sounds came from, against the truth of rooms."""
