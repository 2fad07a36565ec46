"""The weights of the probability that a first goal is right, fitted on homes that no table uses."""
