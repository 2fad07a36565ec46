"""Encoders and matchers: what turns pictures, sounds and words into features."""
