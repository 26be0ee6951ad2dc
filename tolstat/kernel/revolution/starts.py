"""Where the search for the start of each joint begins, computed joint by joint.

The lock-step does not compute it, so that it has no equations of motion for plain numbers to compile.
"""

from tolstat.kernel.cardan.guess import rigid_guess
from tolstat.kernel.codes import DYNAMIC, RAMP
from tolstat.kernel.mechanics.dynamics import acceleration
from tolstat.kernel.revolution.outcome import inside_model
from tolstat.kernel.revolution.quasistatic import angle_time
from tolstat.kernel.simd.jit import njit


@njit
def write_starts(rows, options, work, at_rest, starts):
    """Write the unknowns of the rigid cross that just touches all holes; with a torque ramp, the accelerations at rest.

    Parameters
    ----------
    rows : ndarray of PARAM, shape (n,)
        The joints.
    options : Options
        Numerical settings.
    work : record of WORK
        Scratch.
    at_rest : ndarray, shape (dof,)
        Zeros.
    starts : ndarray, shape (n, dof)
        Written, except for joints outside the model; m and rad, or m/s^2 and rad/s^2.
    """
    ramp = options.fidelity == DYNAMIC and options.start == RAMP
    t = 0.0
    for i in range(len(rows)):
        par = rows[i]
        if not inside_model(par):
            continue
        if ramp:
            acceleration(t, at_rest, at_rest, par, options, work, starts[i])
        else:
            if options.fidelity != DYNAMIC:
                t = angle_time(0, options.steps_per_rev, par)
            rigid_guess(t, at_rest, par, work, starts[i])
