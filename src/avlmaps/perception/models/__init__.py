"""What published models share, on torch or not: files, names, prompts, sizes of pictures and sounds."""
