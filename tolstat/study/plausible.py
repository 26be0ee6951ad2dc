"""Values of a study that can be simulated but are probably not meant: warnings with place and remedy."""

from __future__ import annotations

import math
from collections.abc import Iterator

from tolstat.common import units
from tolstat.common.errors import Fault
from tolstat.study.study import Study
from tolstat.study.tolerances.zones import short_axes

WIDE = 10.0
"""Standard deviation of an error of position over the radial clearance, at which nearly every pin binds."""
LEAST_CLEARANCE = 1e-5
"""Clearance (m) that errors are compared with where a joint has less: pins without clearance are preloaded."""
FAST = 30_000.0
"""Speed times misalignment, rpm deg, beyond what makers of joint shafts allow."""
ROUNDING = 1e-9
"""Relative error of a product of converted quantities: 2500 rpm at 12 deg is not beyond 30000."""


def warnings(study: Study) -> Iterator[Fault]:
    """Warnings about a study: short common axes, errors far wider than the clearance, speeds far too high."""
    yield from (study.fault(*warning) for warning in short_axes(study.entries, study.joint.contact.z))
    yield from _wide_bands(study)
    yield from _fast_points(study)


def _wide_bands(study: Study) -> Iterator[Fault]:
    """Entries whose positions and angles across a pin leave no room for it in its hole."""
    contact = study.joint.contact
    for entry in study.entries:
        sizes = []
        for site, model in entry.models:
            for meaning in model.meaning(site):
                keys = {name.partition(".")[2] for name in meaning.errors}
                across = meaning.sigma if keys & {"offset_t", "offset_z"} else 0.0
                sizes.append(0.5 * contact.z * meaning.sigma if keys & {"tilt_t", "tilt_z"} else across)
        ratio = max(sizes, default=0.0) / max(contact.clearance, LEAST_CLEARANCE)
        if ratio > WIDE:
            room = units.shown(contact.clearance, "m")
            found = (
                f"moves the end of a pin by {units.shown(max(sizes), 'm')} (standard deviation), {ratio:.0f} times the "
                f"radial clearance of {room}: nearly every pin binds"
            )
            yield study.fault(
                f"tolerances.{entry.pattern}", found, "check its unit, and contact.clearance of the joint"
            )


def _fast_points(study: Study) -> Iterator[Fault]:
    """Operating points whose speed is far beyond that of any joint shaft at their misalignment."""
    for number, point in enumerate(study.points):
        rpm, alpha = point.operation.speed * 30.0 / math.pi, math.degrees(point.operation.alpha)
        product = abs(rpm) * alpha
        if product > FAST * (1.0 + ROUNDING):
            at = f" at {point.name}" if point.name else ""
            found = (
                f"{rpm:.4g} rpm at {alpha:.3g} deg{at}: speed times angle, {product:.0f} rpm deg, is beyond the "
                f"{FAST:g} that makers of joint shafts allow"
            )
            key = f"operation[{number}].speed" if point.name else "operation.speed"
            yield study.fault(key, found, "check it and alpha, and their units")
