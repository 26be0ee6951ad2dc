"""Ideal motion of members that have a place in their parents (docs/model.md, "A mechanism").

A member turns about its own z, by the input angle or by a Fourier series of it, in a frame that is fixed in its parent.
"""

from tolstat.common.mechanism import DRIVEN, HELD
from tolstat.kernel.mechanics.trigonometry import sine_cosine
from tolstat.kernel.mechanics.vector import add, axpy, cross, dot, of_column, put, row, scale, sub, turn, turn_back
from tolstat.kernel.simd.jit import njit


@njit
def angle_of(member, theta, par):
    """Angle of a member about its z (rad) at the input angle `theta`, its first and second derivative by it."""
    zero = 0.0 * theta
    if par.motion[member] == HELD:
        return zero, zero, zero
    if par.motion[member] == DRIVEN:
        return theta, 1.0 + zero, zero
    angle, slope, bend = par.angle[member, 0] + par.angle[member, 1] * theta, par.angle[member, 1] + zero, zero
    sine, cosine = sine_cosine(theta)
    s, c = zero, 1.0 + zero
    for k in range(par.wave.shape[1]):
        s, c = s * cosine + c * sine, c * cosine - s * sine
        order, of_cosine, of_sine = k + 1.0, par.wave[member, k, 0], par.wave[member, k, 1]
        turned = of_cosine * c + of_sine * s
        angle += turned
        slope += order * (of_sine * c - of_cosine * s)
        bend -= order * order * turned
    return angle, slope, bend


@njit
def place_members(theta, par, work):
    """Write pose and motion of the members at the input angle `theta` to `work`, parents first."""
    zero = 0.0 * theta
    omega, domega, still = work.drive[0], work.drive[1], (zero, zero, zero)
    for member in range(par.pivot.shape[0]):
        angle, slope, bend = angle_of(member, theta, par)
        rate, change = slope * omega, bend * omega * omega + slope * domega
        sine, cosine = sine_cosine(angle)
        first, second, z = (
            of_column(par.mount, member, 0),
            of_column(par.mount, member, 1),
            of_column(par.mount, member, 2),
        )
        x, y = axpy(cosine, first, scale(sine, second)), axpy(cosine, second, scale(-sine, first))
        parent, pivot = par.parent[member], row(par.pivot, member)
        w = dw = velocity = acceleration = still
        if parent >= 0:
            w, dw = row(work.frame_w, parent), row(work.frame_dw, parent)
            carried = cross(w, pivot)
            velocity = add(row(work.origin_v, parent), turn(work.attitude, parent, carried))
            acceleration = add(row(work.origin_a, parent), add(cross(dw, pivot), cross(w, carried)))
            put(work.origin, member, add(row(work.origin, parent), turn(work.attitude, parent, pivot)))
        else:
            put(work.origin, member, add(pivot, still))
        put(work.origin_v, member, velocity)
        put(work.origin_a, member, (dot(x, acceleration), dot(y, acceleration), dot(z, acceleration)))
        along_x, along_y = dot(x, w), dot(y, w)
        put(work.frame_w, member, (along_x, along_y, dot(z, w) + rate))
        put(work.frame_dw, member, (dot(x, dw) + rate * along_y, dot(y, dw) - rate * along_x, dot(z, dw) + change))
        put_attitude(member, (x, y, z), par, work)


@njit
def put_attitude(member, axes, par, work):
    """Write the attitude of `member`; `axes`: its axes in its parent."""
    parent = par.parent[member]
    for j in range(3):
        axis = axes[j]
        if parent >= 0:
            axis = turn(work.attitude, parent, axis)
        for k in range(3):
            work.attitude[member, k, j] = axis[k]


@njit
def relate(hinge, par, work):
    """Write how a pin's member lies and moves in a hole's."""
    pin, hole = par.hinge_pin[hinge], par.hinge_hole[hinge]
    for j in range(3):
        axis = turn_back(work.attitude, hole, of_column(work.attitude, pin, j))
        for k in range(3):
            work.into_hole[hinge, k, j] = axis[k]
    w = row(work.frame_w, hole)
    place = turn_back(work.attitude, hole, sub(row(work.origin, pin), row(work.origin, hole)))
    velocity = turn_back(work.attitude, hole, sub(row(work.origin_v, pin), row(work.origin_v, hole)))
    put(work.place, hinge, place)
    put(work.place_v, hinge, sub(velocity, cross(w, place)))
    put(work.relative_w, hinge, sub(turn(work.into_hole, hinge, row(work.frame_w, pin)), w))
