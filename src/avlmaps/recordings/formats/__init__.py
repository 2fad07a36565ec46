"""The readers: one module for each format, all opened by ``recordings.open``."""
