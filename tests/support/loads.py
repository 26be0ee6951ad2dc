"""Largest loads of one joint, made up."""

import numpy as np

from tests.support.of_cardan import SPAN


def largest_loads(force, torque, contact, psi):
    """Largest loads with one value for all of each kind; 1 of other kinds."""
    values = {"F": force, "T": torque, "contact": contact, "psi": psi}
    return np.concatenate([np.full(span.stop - span.start, values.get(kind, 1.0)) for kind, span in SPAN.items()])
