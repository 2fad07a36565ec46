"""A map in the browser: `avlmaps view`. One page, which `serve` serves, or written into one file."""
