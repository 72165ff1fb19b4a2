"""Loops over frequency.

linear (a plant about one point), describing (what is not linear, at one amplitude) -> loop (margins), cycle (limit
cycles) -> study (all of one call) -> telling (in words)
"""
