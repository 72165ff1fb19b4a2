"""Where the reduced model stops being valid: both plants under the same voltages, in cases and in maps."""
