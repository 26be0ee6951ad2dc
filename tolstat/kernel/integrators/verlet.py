"""Velocity Verlet: explicit steps with one evaluation of the accelerations each, of order 2 (Swope et al. 1982).

    w = v + h/2 a,  q+ = q + h w,  a+ = f(t + h, q+, w + h/2 a),  v+ = w + h/2 a+

Forces that depend on velocities are evaluated at the velocity that the last acceleration extrapolates. On
M q'' + C q' + K q = 0 with symmetric C and K the velocities at half steps then obey Stoermer's rule with the damping of
the two-step Adams-Bashforth formula. The roots of its characteristic polynomial lie in the unit circle while every
eigenvalue of M^-1 (h^2/4 K + h C) is below 1 (Jury's criterion); at 1, one root is -1.
"""

from tolstat.kernel.simd.jit import njit


@njit
def predict(h, motion):
    """Write q at the end of a step `h` (s), the velocity for the forces there to `v`, and that at half time to `v0`."""
    half = 0.5 * h
    for i in range(motion.q.shape[0]):
        change = half * motion.a[i]
        middle = motion.v[i] + change
        motion.q[i] = motion.q[i] + h * middle
        motion.v0[i], motion.v[i] = middle, middle + change


@njit
def correct(h, motion):
    """Write the velocity at the end of a step `h` (s) from the accelerations there."""
    half = 0.5 * h
    for i in range(motion.q.shape[0]):
        motion.v[i] = motion.v0[i] + half * motion.a[i]
