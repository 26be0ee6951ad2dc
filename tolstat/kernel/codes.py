"""Codes of `common.tables` as plain integers, which compiled code compares."""

from tolstat.common.tables import Fidelity, Method, Start, Status

OK, NOT_SETTLED, NEWTON_FAILED = int(Status.OK), int(Status.NOT_SETTLED), int(Status.NEWTON_FAILED)
NOT_FINITE, OUTSIDE_MODEL = int(Status.NOT_FINITE), int(Status.OUTSIDE_MODEL)
TR_BDF2 = int(Method.TR_BDF2)
RAMP = int(Start.RAMP)
DYNAMIC, QUASISTATIC = int(Fidelity.DYNAMIC), int(Fidelity.QUASISTATIC)
