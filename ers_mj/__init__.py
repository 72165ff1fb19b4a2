"""ers-mj: find, name and model the physics that a servo simulation leaves out."""

__version__ = "0.1.0"
