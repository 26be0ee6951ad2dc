"""From parameters to results, row by row: the stage between `joint.perturb` and the store."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tolstat.tables import RESULT, HistorySpec, Options, Simulation, Status

if TYPE_CHECKING:
    from tolstat.kernel.simulate import Scratch

Histories = Literal["none", "harmonics", "full"]


def history_specs(options: Options, histories: Histories, n_harmonics: int) -> dict[str, HistorySpec]:
    """Describe the load histories that are kept of each joint.

    Parameters
    ----------
    options : Options
        ``steps_per_rev`` gives the number of samples; sample k belongs to the input angle 2 pi k / steps_per_rev.
    histories : {"none", "harmonics", "full"}
        What is kept.
    n_harmonics : int
        Highest multiple of the input speed that ``"harmonics"`` keeps.

    Returns
    -------
    dict of str to HistorySpec
    """
    n = options.steps_per_rev
    loads = "force e, t, z (N), torque e, t, z (N m) of bushings cross 1-4, fork 1-4 on the lump, in base marker axes"
    if histories == "full":
        return {
            "loads": HistorySpec((n, 8, 6), "f4", "N, N*m", loads),
            "contact": HistorySpec((n, 4, 2), "f4", "N", "normal force on the outer and inner half of pins 1-4"),
            "mode": HistorySpec(
                (n, 4), "u1", "1", "contact mode of pins 1-4: 0 none, 1 one-point, 2 two-point, 3 uniform"
            ),
            "tau": HistorySpec((n,), "f8", "1", "speed ratio"),
        }
    if histories == "harmonics":
        shape = (8, 6, min(n_harmonics, (n - 1) // 2) + 1)
        text = f"part of the Fourier coefficients c_h: {loads}; load(theta) = Re(c_0 + 2 sum c_h exp(i h theta))"
        error = "largest deviation of the load so restored, relative to the largest |F| and |T| of the joint"
        return {
            "coefficients_real": HistorySpec(shape, "f4", "N, N*m", f"real {text}"),
            "coefficients_imag": HistorySpec(shape, "f4", "N, N*m", f"imaginary {text}"),
            "harmonics_error": HistorySpec((2,), "f8", "1", error),
        }
    return {}


def restore(real: NDArray[Any], imag: NDArray[Any], samples: int) -> NDArray[np.float64]:
    """Restore load histories from their harmonics.

    Parameters
    ----------
    real, imag : ndarray, shape (..., harmonics + 1)
        Fourier coefficients as stored, N and N m.
    samples : int
        Number of equally spaced input angles, from zero.

    Returns
    -------
    ndarray, shape (samples, ...)
    """
    spectrum = np.zeros((*real.shape[:-1], samples // 2 + 1), complex)
    kept = min(real.shape[-1], spectrum.shape[-1])
    spectrum[..., :kept] = real[..., :kept] + 1j * imag[..., :kept].astype(np.float64)
    return np.moveaxis(np.fft.irfft(spectrum * samples, samples), -1, 0)


def _harmonics(loads: NDArray[np.float64], kept: int) -> dict[str, NDArray[Any]]:
    spectrum = np.moveaxis(np.fft.rfft(loads, axis=0) / len(loads), 0, -1)[..., :kept]
    real, imag = spectrum.real.astype("f4"), spectrum.imag.astype("f4")
    difference = np.abs(restore(real, imag, len(loads)) - loads).max(axis=(0, 1))
    size = [np.linalg.norm(loads[..., k : k + 3], axis=-1).max() for k in (0, 3)]
    error = [difference[k : k + 3].max() / s if s > 0 else 0.0 for k, s in zip((0, 3), size, strict=True)]
    return {"coefficients_real": real, "coefficients_imag": imag, "harmonics_error": np.array(error)}


@cache
def scratch(options: Options) -> Scratch:
    """Work arrays of this process for `options`; importing the kernel here keeps it out of light commands."""
    from tolstat.kernel.simulate import make_scratch

    return make_scratch(options)


def simulate_rows(
    params: NDArray[np.void], options: Options, histories: Histories = "none", n_harmonics: int = 16
) -> Simulation:
    """Simulate joints one after the other; row i of the result is joint i.

    Parameters
    ----------
    params : ndarray of PARAM, shape (n,)
        The joints.
    options : Options
        Numerical settings.
    histories : {"none", "harmonics", "full"}
        Load histories to keep, see `history_specs`.
    n_harmonics : int
        Highest harmonic kept by ``"harmonics"``.

    Returns
    -------
    Simulation
        Results, and histories; NaN (mode: 0) where a joint has none.
    """
    from tolstat.kernel.simulate import simulate_joint

    work, state, ring = scratch(options)
    rows = params.view(np.recarray)
    results = np.zeros(len(params), RESULT).view(np.recarray)
    specs = history_specs(options, histories, n_harmonics)
    kept = {name: spec.blank(len(params)) for name, spec in specs.items()}
    for i in range(len(params)):
        simulate_joint(rows[i], options, work, state, ring, results[i])
        if kept and results[i].status in (Status.OK, Status.NOT_SETTLED):
            if histories == "full":
                sample = {name: getattr(ring, name) for name in kept}
            else:
                sample = _harmonics(ring.loads, kept["coefficients_real"].shape[-1])
            for name, values in sample.items():
                kept[name][i] = values
    return Simulation(results.view(np.ndarray), kept)


def is_compiled() -> bool:
    """Whether compiled kernels lie in the cache, so that `warm_up` only has to load them."""
    from pathlib import Path

    from tolstat.kernel._jit import CACHE_DIRECTORY

    return any(Path(CACHE_DIRECTORY).rglob("simulate.simulate_joint*.nbc"))


def warm_up() -> None:
    """Compile the kernels, or load them from the cache, by simulating a joint that has no clearance to run in."""
    from tolstat.kernel.simulate import simulate_joint
    from tolstat.tables import PARAM

    params = np.zeros(1, PARAM).view(np.recarray)
    params.clearance[:] = -1.0
    results = np.zeros(1, RESULT).view(np.recarray)
    options = Options()
    simulate_joint(params[0], options, *scratch(options), results[0])
