"""Words of the trade that are no keys, and what to write in their place."""

from __future__ import annotations

_RINGS = 'thrust: thrust = { end_play = "0.02 mm", k = "1e8 N/m" } under [joint]'
_MEANT = {
    "snap ring, circlip, retaining ring, washer, thrust washer, cup": f"snap rings and cups are {_RINGS}",
    "end play, axial play, axial clearance, end float": "this play of the cross is thrust.end_play under [joint]",
    "preload": "preload is a negative thrust.end_play under [joint]",
    "friction, mu, friction coefficient, coefficient of friction, cof": "this is friction.mu under [joint]",
    "c0r, static load rating": "give bearing.C0, or leave it out: it follows from the dimensions",
    "cr, dynamic load rating, load rating": "this is bearing.C under [joint]",
    "unbalance, imbalance, balance, balance grade": (
        "this is shaft.unbalance under [joint], of tubes tube.unbalance in [shaft]"
    ),
    "spline, slip joint, length compensation": (
        'write shaft.axial = "free" under [joint], and where it sticks shaft.spline = { mu = 0.1, diameter = "40 mm" }'
    ),
    "partner, second joint, intermediate shaft": (
        "a drive shaft of two joints is simulated as one: give its joint 2, tube and spline in [shaft]"
    ),
    "spider, trunnion, journal": "the cross has pins: cross and pin under [joint], pin1 to pin4 elsewhere",
    "yoke": "the arms of a yoke are arm under [joint], their holes hole1 to hole4 elsewhere",
    "roller, needle bearing": "this is bearing under [joint], with needles and needle_length",
    "backlash, play": "this is contact.clearance under [joint], pin1.clearance in tolerances",
    "lot, batch": "give sampling.joints_per_lot, and lot = { share = 0.3 } in an entry of [tolerances]",
    "temperature, heat, thermal expansion": "the model leaves out what heat does to clearances: remove it",
    "interference, press fit": "the model leaves out interference fits: remove it",
    "roundness, circularity, cylindricity, straightness, form, form error, roughness, surface roughness, ra, rz": (
        "the model leaves out form errors and roughness: remove it"
    ),
    "run out, runout, total runout, concentricity, coaxiality, eccentricity": (
        "the model has pins and holes whose axes are moved and tilted: give position, offset_t, tilt_t, ... of them"
    ),
    "wear": "the model leaves out wear: remove it",
    "grease, lubricant, lubrication, oil, viscosity": (
        "the oil film is contact.c_t, what lubrication does to the life is bearing.a_iso, under [joint]"
    ),
    "gravity, weight": "the model leaves out gravity: remove it",
    "vibration, noise, acceleration": "the model gives loads, no vibration: limit cross1.F, output.lateral, ...",
}
_REMEDIES = {word.replace(" ", ""): remedy for words, remedy in _MEANT.items() for word in words.split(", ")}


def remedy(word: str) -> str:
    """Remedy for a word of the trade, in the singular or plural, with any signs between its parts; else empty."""
    plain = "".join(sign for sign in word.lower() if sign.isalnum())
    return _REMEDIES.get(plain) or _REMEDIES.get(plain.removesuffix("s"), "")
