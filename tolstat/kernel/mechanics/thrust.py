"""Thrust faces, on which pins stop along their holes (docs/model.md, "Thrust faces")."""

from tolstat.kernel.mechanics.contact import in_hole, push, smooth_step, smooth_step_slope
from tolstat.kernel.mechanics.vector import add, axpy, dot, row, scale, sub, turn
from tolstat.kernel.mechanics.work import DAMPING, DELTA, FORCE, NORMAL, POINT, SLOPE, TANGENT
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where


@njit
def thrust_load(face, par, work):
    """Add the force of a thrust face to pin and hole; write ``work.face[face]``."""
    pin, end = par.face_pair[face], 1.0 * par.face_end[face]
    body, hole, kind, of_face = par.pin[pin], par.hole[pin], par.pair_kind[pin], work.face[face]
    on_pin = axpy(par.face_at[face, 0], row(par.pin_axis, pin), row(par.pin_point, pin))
    on_hole = axpy(par.face_at[face, 1], row(par.hole_axis, pin), row(par.hole_point, pin))
    point, velocity = in_hole(pin, turn(work.rot, body, on_pin), par, work)
    normal = scale(end, turn(work.rot, hole, row(par.hole_axis, pin)))
    delta = dot(sub(point, add(row(work.pos, hole), turn(work.rot, hole, on_hole))), normal)
    steepness, rate = 1 / par.delta_d[kind], dot(velocity, normal)
    damping = par.face_c[kind] * smooth_step(delta * steepness)
    slope = par.face_k[kind] + par.face_c[kind] * smooth_step_slope(delta * steepness) * steepness * rate
    force = par.face_k[kind] * delta + damping * rate
    pressed = (delta > 0) & (force > 0)
    of_face[DELTA], of_face[FORCE] = delta, where(pressed, force, 0.0)
    of_face[SLOPE], of_face[DAMPING] = where(pressed, slope, 0.0), where(pressed, damping, 0.0)
    for k in range(3):
        of_face[POINT + k], of_face[NORMAL + k], of_face[TANGENT + k] = point[k], normal[k], 0.0 * normal[k]
    push(pin, point, scale(of_face[FORCE], normal), par, work)
