"""Jitted mechanics on plain arrays: no units, no files, no Python objects, failures as a status.

An argument means what stands here in every function whose docstring does not say otherwise, or, for some folders and
files, in their docstrings. "Read as lanes" means that each number of a record is one per joint, see `simd.lane`.

Arguments
---------
t : float
    Time, s; theta is omega t.
h : float
    Length of a step, s.
q, v, a : ndarray, shape (dof,)
    Unknowns and their first and second derivatives; m and rad, per s, per s^2. Textbook equations have (n,).
cv, ca : float
    dv/dq (1/s) and da/dq (1/s^2) of the integration formula.
level : int
    Number of times that a step of the output grid, or a cell of the mesh, is halved.
stage : int
    Stage of the integration method, from 0.
fresh : bool
    Whether the last correction was made with a new tangent.
par : record of PARAM
    The joint, in SI units, and the numbers of its mechanism (`common.mechanism`).
rows : ndarray of PARAM, shape (n,)
    Several joints.
options : Options
    Numerical settings.
work : record of WORK
    Scratch of an evaluation: bodies, stations, loads, blocks of the tangent.
samples : ndarray of SAMPLE, shape (steps_per_rev,)
    The last revolution; point k of the output grid is sample k modulo its length.
notes : record of NOTES
    Closure errors.
fine : ndarray of SAMPLE, shape (3,)
    Last parts of a closer look, or of a cell.
past : Past
    What error-controlled and explicit steps keep from one revolution to the next.
trail : Trail
    Loads that decide and statistics of the last revolutions.
turns : record of TURNS
    Number of the revolution, and what has been found so far.
out : ndarray, or record of KERNEL_RESULT
    Written: the result.
lane : int
    Number of the lane; 0 for a single joint.
body : int
    Number of the body: lumps, then shafts.
base : int
    Number of the body that holds a bushing.
bushing, pin, hinge, shaft, joint : int
    Number of the bushing; of the pair of pin and hole; of the hinge; of the shaft; of the Cardan joint.
mechanism : Mechanism
    What the joints are.
status : int
    How a joint has ended, a `Status`.
loads : ndarray, shape (n,)
    Values of all loads at one instant, N, N m or 1.
mask : bool, read as lanes
    Joints that the function applies to.
"""
