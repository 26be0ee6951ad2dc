"""Words of the trade that are no keys, and what to write in their place."""

from __future__ import annotations

_RINGS = 'thrust: thrust = { end_play = "0.02 mm", k = "1e8 N/m" } under [joint]'
_MEANT = {
    "snap ring, circlip, retaining ring, washer, thrust washer, cup": f"snap rings and cups are {_RINGS}",
    "axial play, axial clearance, end float": "this play of the cross is thrust.end_play under [joint]",
    "preload": "preload is a negative thrust.end_play under [joint]",
    "friction coefficient, coefficient of friction, cof": "this is friction.mu under [joint]",
    "c0, c0r, static load rating": "the static load rating is used nowhere: leave it out; C is the dynamic one",
    "cr, dynamic load rating, load rating": "this is bearing.C under [joint]",
    "imbalance, balance, balance grade": "this is shaft.unbalance under [joint]",
    "spline, slip joint, length compensation": (
        'write shaft.axial = "free" under [joint], and where it sticks shaft.spline = { mu = 0.1, diameter = "40 mm" }'
    ),
    "spider, trunnion, journal": "the cross has pins: cross and pin under [joint], pin1 to pin4 elsewhere",
    "yoke": "the arms of a yoke are arm under [joint], their holes hole1 to hole4 elsewhere",
    "roller, needle bearing": "this is bearing under [joint], with needles and needle_length",
    "backlash, play": "this is contact.clearance under [joint], pin1.clearance in tolerances",
}
_REMEDIES = {word.replace(" ", ""): remedy for words, remedy in _MEANT.items() for word in words.split(", ")}


def remedy(word: str) -> str:
    """Remedy for a word of the trade, in the singular or plural, with any signs between its parts; else empty."""
    plain = "".join(sign for sign in word.lower() if sign.isalnum())
    return _REMEDIES.get(plain) or _REMEDIES.get(plain.removesuffix("s"), "")
