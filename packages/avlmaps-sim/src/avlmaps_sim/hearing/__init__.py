"""The sounds of a scene: which things sound, when, and how it reaches the microphone."""
