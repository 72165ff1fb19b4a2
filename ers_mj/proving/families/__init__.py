"""Families of servos that the proof draws, one a file; `proving.world` knows them all."""
