"""The main job: recordings in, the missing physics out."""
