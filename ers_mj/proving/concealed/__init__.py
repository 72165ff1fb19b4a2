"""What the independent simulators can hide in a servo: one family of effects a file, by where it acts.

base (what an entry is, how numbers are drawn) -> drive, transmission, friction, load, sensor, outside (of every list)
"""
