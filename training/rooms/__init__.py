"""How the tables of the contents of rooms were made: ``python -m training.rooms --help``."""
