"""Values of the joint for the provenance of the page: those that differ from the joint that comes with tolstat."""

from __future__ import annotations

from typing import Any

from tolstat.common import notation, units
from tolstat.common.strict import validate
from tolstat.display import text
from tolstat.display.blocks import Listing
from tolstat.joint import Joint, load
from tolstat.joint.derived import DERIVED, UNITS
from tolstat.joint.model import TOLD
from tolstat.joint.overrides import leaves
from tolstat.joint.reading import DEFAULT_JOINT, examples
from tolstat.joint.sections import quantities
from tolstat.store import Reader

UNIT = UNITS | quantities(Joint)
DIGITS = 5


def listing(store: Reader) -> Listing:
    """Table of the values that differ from those of `DEFAULT_JOINT`, with the formula of those that were not given.

    Raises
    ------
    InputError
        When this version cannot read the joint in the file.
    """
    joint = validate(Joint, store.joint, f"{store.path}: joint")
    given, own, default = leaves(joint.given()), _values(joint), _values(load(DEFAULT_JOINT, {}, DEFAULT_JOINT))
    rows = [
        (key, value, default.get(key, "-"), "given" if key in given else DERIVED[key].formula)
        for key, value in own.items()
        if value != default.get(key) and (key in given or key in DERIVED)
    ]
    title = f"The joint: values that differ from {DEFAULT_JOINT}"
    if not rows:
        return Listing(title, f"none: it is {DEFAULT_JOINT}")
    return Listing(title, text.align([("key", "value", DEFAULT_JOINT, "by"), *rows], [True, False, False, True]))


def _values(joint: Joint) -> dict[str, str]:
    """Values by dotted key, in the unit in which a joint file has them."""
    found = leaves(joint.model_dump(exclude=set(TOLD)))
    return {key: _written(key, value) for key, value in found.items() if value is not None}


def _written(key: str, value: Any) -> str:
    if not isinstance(value, (float, tuple)):
        return str(value)
    unit = UNIT.get(key, "1")
    like = examples().get(key, units.EXAMPLES[unit])
    numbers, name = [], ""
    for one in value if isinstance(value, tuple) else (value,):
        read = notation.read(str(units.written(one, unit, like[0] if isinstance(like, list) else like)))
        if read is not None:
            numbers.append(f"{read.number:.{DIGITS}g}")
            name = read.unit
    return f"{', '.join(numbers)} {name}".rstrip()
