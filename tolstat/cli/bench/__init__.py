"""``tolstat bench``: a file an instrument. The first is meant where none is named."""

from collections.abc import Callable

from tolstat.cli.bench import cost, coverage, precision, scale

INSTRUMENTS: dict[str, Callable[..., None]] = {
    "bench": cost.cost,
    "bench precision": precision.precision,
    "bench coverage": coverage.coverage,
    "bench scale": scale.scale,
}
"""Functions by the words that call them."""
SEE_ALSO = f"Measurements, each with --help: {', '.join(f'tolstat {words}' for words in INSTRUMENTS)}."
