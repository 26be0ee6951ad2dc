"""Fatigue of each joint: damage sums and damage-equivalent loads over the duty cycle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tolstat.analysis import cycles, strength
from tolstat.analysis.sample import Sample
from tolstat.common.channels import unit_of
from tolstat.common.errors import input_error
from tolstat.common.late import pandas as pd
from tolstat.common.loads import FloatArray
from tolstat.common.strict import did_you_mean
from tolstat.questions.fatigue.counting import settings_of
from tolstat.questions.fatigue.loads import channels, damage_sums, load_cycles
from tolstat.questions.fatigue.parts import evaluated, load_stresses
from tolstat.store.view import View


def quantity(view: View, name: str) -> Sample:
    """Damage sum of each joint in the service life, by the name of a load with an S-N line or of a point of a part."""
    lines, points = settings_of(view).lines, settings_of(view).points
    frame = fatigue_by_joint(view, [name] if name in lines else list(lines)[:1] or None)
    column = f"damage {name}"
    if column not in frame:
        known = [*lines, *(point.name for point in points)]
        remedy = did_you_mean(name, known) if known else "give the study S-N lines, see [fatigue]"
        raise input_error(column, "has no S-N line", remedy)
    return Sample.of(frame[column].to_numpy(), view.status, view.design, name=column, unit="1")


def fatigue_by_joint(view: View, names: str | Sequence[str] | None = None) -> pd.DataFrame:
    """Damage sums and damage-equivalent loads of each joint in the service life, over the duty cycle.

    Parameters
    ----------
    view : View
        A campaign.
    names : str or sequence of str, optional
        Channels whose equivalent loads are wanted, or patterns: ``cross*.F_t``, ``cross1.F at 30 deg``; by default the
        components of the bushing loads.

    Returns
    -------
    pandas.DataFrame
        Index ``row``: row of the campaign. Columns ``damage NAME`` for each load with an S-N line and each point of a
        part (at the median strength), ``NAME m=5`` (N or N m) for the equivalent loads of each exponent of
        ``[fatigue]``. NaN for joints without results; ``attrs["units"]``.

    Raises
    ------
    InputError
        When the shares of the operating points are not known, or a channel is none.
    """
    if not isinstance(view, View):
        raise input_error("fatigue_by_joint", f"{type(view).__name__} is no view", "give store.view()")
    patterns = [names] if isinstance(names, str) else names
    loading = load_cycles(view, None if patterns is None else channels(patterns, view.mechanism))
    settings, columns, units = loading.settings, dict[str, FloatArray](), dict[str, str]()
    columns |= {f"damage {name}": sums for name, sums in damage_sums(loading.cycles, settings).items()}
    if settings.points:
        at_points = evaluated(load_stresses(view).cycles, settings)
        named = zip(settings.points, at_points, strict=True)
        columns |= {f"damage {point.name}": strength.damage_at(*of_point) for point, of_point in named}
    units |= dict.fromkeys(columns, "1")
    for m in settings.exponents:
        worst = loading.cycles.worst(m)
        loads = cycles.equivalent_load(worst, m, settings.revolutions, settings.reference_cycles)
        equivalent = dict(zip((f"{name} m={m:g}" for name in worst.channels), loads.T, strict=True))
        units |= dict(zip(equivalent, (unit_of(name, view.mechanism) for name in worst.channels), strict=True))
        columns |= equivalent
    frame = pd.DataFrame(columns, index=pd.Index(view.rows(np.arange(view.n)), name="row"))
    frame.attrs["units"] = units
    return frame
