"""The plant in MuJoCo: bodies -> forces -> staging make the MJCF, plant is the whole, stepping runs it.

A play is built in plant, its joint in bodies, its numbers written in forces. sampled runs a plant a sample at a time,
looped within a firmware's loop; joint gives the lines for a joint of one's own; mjcf_folder finds mjcf/.
"""
