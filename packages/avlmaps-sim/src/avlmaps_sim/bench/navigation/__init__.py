"""The navigation benchmark: the paper's Tables I, II and VI and its list of commands, driven in homes made by rule."""
