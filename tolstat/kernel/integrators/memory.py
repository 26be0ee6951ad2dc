"""Numbers that a joint keeps from step to step: indices into ``memory`` of its motion."""

H_OLD, AHEAD, STAGED_STEP, LAST_ITERATION_BELOW, TOLERANCE, FORCE, TORQUE, TRAPEZOIDAL = range(8)
MEMORY = 8
"""Last accepted step, s; whether ``ahead`` is used (1); length of the last step if its first stage is kept (else 0);
weighted residual up to which one more iteration needs no check; for error-controlled steps: tolerance, and the force
(N) and torque (N m) that errors are relative to; whether BDF2 gives way to the trapezoidal rule (1)."""
