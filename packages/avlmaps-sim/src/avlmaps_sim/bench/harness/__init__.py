"""Parts that the suites share: scenes made ready, work in several processes, files, intervals and output."""
