"""Where the search for the start of each joint begins, computed joint by joint.

The lock-step does not compute it, so that it has no equations of motion for plain numbers to compile.
"""

from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.revolution.quasistatic import angle_time
from tolstat.kernel.revolution.simulate import DYNAMIC, RAMP, acceleration, inside_model, rigid_guess
from tolstat.kernel.simd.jit import njit


@njit
def write_starts(rows, options, work, state, starts):
    """Write the unknowns of the rigid cross that just touches all holes; with a torque ramp, the accelerations at rest.

    Parameters
    ----------
    rows : ndarray of PARAM, shape (n,)
        The joints.
    options : Options
        Numerical settings.
    work, state : records of WORK and State
        Scratch.
    starts : ndarray, shape (n, 56)
        Written, except for joints outside the model; m and rad, or m/s^2 and rad/s^2.
    """
    ramp = options.fidelity == DYNAMIC and options.start == RAMP
    t = 0.0
    for i in range(len(rows)):
        par = rows[i]
        if not inside_model(par):
            continue
        if ramp:
            state.q0[:] = 0.0
            state.v0[:] = 0.0
            acceleration(t, state.q0, state.v0, par, options, work, state.a0)
            copy(state.a0, starts[i])
        else:
            if options.fidelity != DYNAMIC:
                t = angle_time(0, options.steps_per_rev, par)
            rigid_guess(t, par, work, state)
            copy(state.q0, starts[i])
