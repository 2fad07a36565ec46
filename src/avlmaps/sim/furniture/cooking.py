"""Stoves, microwaves, dishwashers and range hoods."""
