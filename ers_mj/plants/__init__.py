"""The electric rudder system as models that turn voltages into motion."""
