"""How the embedded pixel and view encoders are made: rendered worlds, a small network, calibration, export."""
