"""Generalised-alpha (Chung, Hulbert 1993) in the form of Arnold and Bruels (2007).

The equations of motion are satisfied at the new point; q, v and a are of order 2. rho_inf is the spectral radius at
infinite frequency.
"""

from tolstat.kernel.simd.jit import njit


@njit
def parameters(rho):
    """Return alpha_m, alpha_f, gamma_nm, beta_nm for the spectral radius `rho` (Chung and Hulbert, eq. 25)."""
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma_nm = 0.5 + alpha_f - alpha_m
    return alpha_m, alpha_f, gamma_nm, 0.25 * (gamma_nm + 0.5) ** 2


@njit
def predict(h, state, options):
    """Write a trial point that satisfies the formulas of a step `h` (s); return cv = dv/dq and ca = da/dq."""
    alpha_m, alpha_f, gamma_nm, beta_nm = parameters(options.rho_inf)
    for i in range(state.q.size):
        aux = state.aux[i]
        state.q[i] = state.q0[i] + h * (state.v0[i] + 0.5 * h * aux)
        state.v[i] = state.v0[i] + h * aux
        state.a[i] = (aux - alpha_f * state.a0[i]) / (1 - alpha_f)
    return gamma_nm / (beta_nm * h), (1 - alpha_m) / ((1 - alpha_f) * beta_nm * h * h)


@njit
def accept(h, state, options):
    """Update the algorithmic acceleration ``state.aux`` after an accepted step."""
    alpha_m, alpha_f, _, _ = parameters(options.rho_inf)
    for i in range(state.q.size):
        state.aux[i] = ((1 - alpha_f) * state.a[i] + alpha_f * state.a0[i] - alpha_m * state.aux[i]) / (1 - alpha_m)
