"""The event-exact integrator of the reduced model, compiled.

A recording goes through event_integrator sample by sample: cuts -> maps (nothing happens; calm: for many samples) or
checks -> events, located on flow or series; every state in a mode (state, modes) under forces and laws. Beside it
fixed_steps (a shaft that twists beside a bristle) and tangents (how a motion changes with the model).
"""
