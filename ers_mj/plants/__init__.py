"""The electric rudder system as models that turn voltages into motion."""

from ers_mj.errors import InputError

try:
    import mujoco  # noqa: F401
except Exception as error:  # it looks for MUJOCO_GL's libraries here, which fail in as many ways as they have
    raise InputError(
        f"MuJoCo does not start ({' '.join(str(error).split())[:100]}): unset MUJOCO_GL or install what it asks for "
        "(Debian, Ubuntu: egl libegl1 libgl1-mesa-dri, osmesa libosmesa6)"
    ) from None
