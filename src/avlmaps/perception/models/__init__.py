"""Where the files of large models come from, on which device they run, and in which precision."""
