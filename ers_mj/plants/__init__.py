"""The electric rudder system as models that turn voltages into motion.

reduced      Eq. (1)/(5)/(6) with effects: event_integrator (the event-exact main loop) over flow, events, modes and
             maps; fixed_steps where a shaft twists beside a bristle; tangents (how a motion changes with the model)
mechanical   MuJoCo: skeletons, staging and writing make the MJCF, mujoco_stepping runs it
compiled     what numba makes of both: pieces called by symbol, laws by address (laws), kept in code_folder
"""

from ers_mj.errors import InputError

try:
    import mujoco  # noqa: F401
except Exception as error:  # it looks for MUJOCO_GL's libraries here, which fail in as many ways as they have
    raise InputError(
        f"MuJoCo does not start ({' '.join(str(error).split())[:100]}): unset MUJOCO_GL or install what it asks for "
        "(Debian, Ubuntu: egl libegl1 libgl1-mesa-dri, osmesa libosmesa6)"
    ) from None
