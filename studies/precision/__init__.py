"""Speed against error: CPU time a joint of the solver and of other integrators over the error of its loads."""
