"""Fourier coefficients of the loads over a revolution, and the loads restored from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.channels import BUSHING_LOADS, LOAD_HISTORIES
from tolstat.common.tables import HistorySpec


def specs(kept: int) -> dict[str, HistorySpec]:
    """Describe what `of_loads` gives for a joint, as histories of a result file; `kept`: number of coefficients."""
    result: dict[str, HistorySpec] = {}
    for history in LOAD_HISTORIES:
        shape, axes = (*history.shape, kept), (*history.axes, "harmonic")
        text = f"part of the Fourier coefficients c_h: {history.meaning}; "
        text += "load(theta) = Re(c_0 + 2 sum c_h exp(i h theta))"
        error = "largest deviation of the load so restored, relative to the largest |F| and |T| of the joint"
        result |= {
            f"{history.prefix}coefficients_real": HistorySpec(shape, "f4", "N, N*m", f"real {text}", axes),
            f"{history.prefix}coefficients_imag": HistorySpec(shape, "f4", "N, N*m", f"imaginary {text}", axes),
            f"{history.prefix}harmonics_error": HistorySpec((2,), "f8", "1", error, ("load",)),
        }
    return result


def of_loads(loads: Mapping[str, NDArray[np.float64]], kept: int) -> dict[str, NDArray[Any]]:
    """Fourier coefficients of the loads of a joint.

    Parameters
    ----------
    loads : mapping of str to ndarray
        By name of `LOAD_HISTORIES`, (samples, places, components) each, N and N m.
    kept : int
        Number of coefficients, the mean included.

    Returns
    -------
    dict
        By name of `specs`. Errors of all loads are relative to the largest bushing force and torque.
    """
    bushing = loads[BUSHING_LOADS.name]
    size = [np.linalg.norm(bushing[..., k : k + 3], axis=-1).max() for k in (0, 3)]
    coefficients: dict[str, NDArray[Any]] = {}
    for history in LOAD_HISTORIES:
        values = loads[history.name]
        spectrum = np.moveaxis(np.fft.rfft(values, axis=0) / len(values), 0, -1)[..., :kept]
        real, imag = spectrum.real.astype("f4"), spectrum.imag.astype("f4")
        difference = np.abs(restore(real, imag, len(values)) - values).max(axis=(0, 1))
        error = [difference[k : k + 3].max() / s if s > 0 else 0.0 for k, s in zip((0, 3), size, strict=True)]
        parts = {"coefficients_real": real, "coefficients_imag": imag, "harmonics_error": np.array(error)}
        coefficients |= {f"{history.prefix}{name}": part for name, part in parts.items()}
    return coefficients


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
