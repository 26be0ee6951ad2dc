"""What holds the output shaft along its axis, and the contact law, in words: what every number of a joint stands on."""

from __future__ import annotations

from collections.abc import Sequence

from tolstat.joint.sections import FREE, RIGID

RIGID_SHAFTS = "shafts rigid along their axes"
FREE_SHAFT = "output shaft free along its axis"


def in_words(axial: Sequence[float | str], laws: Sequence[str]) -> str:
    """Mounting and contact law of a joint, or of several variants.

    Parameters
    ----------
    axial : sequence of float or str
        ``shaft.axial`` of each variant: ``"rigid"``, ``"free"``, or a stiffness, N/m.
    laws : sequence of str
        ``contact.law`` of each variant.

    Returns
    -------
    str
        ``"output shaft free along its axis; contact law mode"``.
    """
    stiffness = [value for value in axial if not isinstance(value, str)]
    rigid, free = (list(axial).count(word) for word in (RIGID, FREE))
    kinds = {RIGID_SHAFTS: rigid, FREE_SHAFT: free, _held(stiffness): len(stiffness)}
    said = {text: number for text, number in kinds.items() if number}
    shafts = ", ".join(
        said if len(said) == 1 else (f"{text} in {n} of {len(axial)} variants" for text, n in said.items())
    )
    own = list(dict.fromkeys(laws))
    return f"{shafts}; contact law{'' if len(own) == 1 else 's'} {', '.join(own)}"


def _held(stiffness: Sequence[float]) -> str:
    if not stiffness:
        return ""
    ends = dict.fromkeys(f"{end:.4g}" for end in (min(stiffness), max(stiffness)))
    return f"output shaft held with {' to '.join(ends)} N/m along its axis"
