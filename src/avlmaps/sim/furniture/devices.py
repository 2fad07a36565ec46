"""Printers, loudspeakers, keyboards, telephones and clocks."""
