"""Units that studies usually have, with their factors to SI: pint, which knows all others, takes 0.2 s to load."""

from __future__ import annotations

FACTORS: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "cm": 1e-2},
    "m^2": {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6},
    "m^4": {"m^4": 1.0, "cm^4": 1e-8},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295, "°": 0.017453292519943295},
    "rad/s": {"rad/s": 1.0, "rpm": 0.10471975511965977},
    "s": {"s": 1.0, "min": 60.0, "h": 3600.0},
    "N": {"N": 1.0, "kN": 1e3},
    "N*m": {"N*m": 1.0, "Nm": 1.0, "kN*m": 1e3},
    "N*m/rad": {"N*m/rad": 1.0},
    "N/m": {"N/m": 1.0, "N/mm": 1e3},
    "N/m^2": {"N/m^2": 1.0, "N/mm^2": 1e6},
    "N*s/m": {"N*s/m": 1.0},
    "Pa": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9, "N/mm^2": 1e6},
    "1/m^2": {"MPa/kN": 1e3},
    "1/m^3": {"MPa/Nm": 1e6, "MPa/(N*m)": 1e6},
    "kg": {"kg": 1.0, "g": 1e-3},
    "kg*m^2": {"kg*m^2": 1.0},
    "kg/m^3": {"kg/m^3": 1.0},
    "1": {"": 1.0, "%": 1e-2, "ppm": 1e-6},
}
"""By SI unit, the units as they are written: the value times the factor has the bits that pint gives it."""
