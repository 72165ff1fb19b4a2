"""The electric rudder system as models that turn voltages into motion.

reduced     Eq. (1)/(5)/(6) with effects, by the event-exact integrator of kernel/; sampled_reduced a sample at a time
mujoco/     the same plant as MJCF, stepped by MuJoCo
compiling/  what numba makes of the kernels, and where it is kept
firmware runs a servo within its firmware's loop, bare_gap and printed_play are plays of their own kind
"""

from ers_mj.errors import InputError

try:
    import mujoco  # noqa: F401
except Exception as error:  # it looks for MUJOCO_GL's libraries here, which fail in as many ways as they have
    raise InputError(
        f"MuJoCo does not start ({' '.join(str(error).split())[:100]}): unset MUJOCO_GL or install what it asks for "
        "(Debian, Ubuntu: egl libegl1 libgl1-mesa-dri, osmesa libosmesa6)"
    ) from None
