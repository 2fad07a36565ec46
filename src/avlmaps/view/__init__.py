"""A map in the browser: `avlmaps view`. One page, served by this machine or written into one file."""
