"""Numbers that kernels share: codes of `common.tables` as plain integers, and what a joint keeps from step to step."""

from tolstat.common.tables import Fidelity, Method, Start, Status

OK, NOT_SETTLED, NEWTON_FAILED = int(Status.OK), int(Status.NOT_SETTLED), int(Status.NEWTON_FAILED)
NOT_FINITE, OUTSIDE_MODEL = int(Status.NOT_FINITE), int(Status.OUTSIDE_MODEL)
TR_BDF2 = int(Method.TR_BDF2)
RAMP = int(Start.RAMP)
DYNAMIC, QUASISTATIC = int(Fidelity.DYNAMIC), int(Fidelity.QUASISTATIC)

H_OLD, AHEAD, STAGED_STEP, LAST_ITERATION_BELOW, TOLERANCE, FORCE, TORQUE, TRAPEZOIDAL, MASSLESS = range(9)
MEMORY = 9
"""Indices into ``memory`` of a joint's motion: last accepted step, s; whether ``ahead`` is used (1); length of the last
step if its first stage is kept (else 0); weighted residual up to which one more iteration needs no check; for
error-controlled steps: tolerance, and the force (N) and torque (N m) that errors are relative to; whether BDF2 gives
way to the trapezoidal rule (1); number of steps left that neglect inertia, see `course.MASSLESS_SHARE`."""
