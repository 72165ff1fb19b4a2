"""Recordings: read, checked, locked, and prepared for a fit."""
