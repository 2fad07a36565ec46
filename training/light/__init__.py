"""How the files of the profile ``light`` are made from published checkpoints; `README.md` says how to run it."""
