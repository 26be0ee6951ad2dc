"""The Cardan joint as an RCCC linkage: with manufacturing errors, but rigid and without clearance.

Cirelli et al. (2021), section 1, replace the overconstrained joint by a linkage of four links, one revolute and three
cylindrical pairs. The paper does not say which pair is which. Here the links and pairs are

    frame -R- input fork -C- cross -C- output fork -C- frame

(as in Ciornei et al., IOP Conf. Ser.: Mater. Sci. Eng. 477, 2019, 012037), because (1) the paper turns revolute
joints into cylindrical ones and keeps one revolute pair, which must be the bearing of the input shaft: this shaft is
driven and its bearing is rigid (`docs/model.md`), so the bearing holds the linkage along its axis; (2) pins slide
freely along their holes, so both pairs of the cross are cylindrical; (3) the output shaft must then be free to slide:
if it were held too, the linkage would be overconstrained by one, and errors would lock it.

Of the two opposite pins in each fork one is kept as the pair, the other is left out as redundant. Parameters select
the kept pins: pin 3 (in arm 1) or 4 (in arm 2) on the input side, pin 1 (in arm 4) or 2 (in arm 3) on the output side.
By default pins 3 and 1 are kept; the paper's errors are those of pin 1 and the hole of arm 4. Errors of a pin or hole
left out have no effect; neither have diameters.

    revolution = rccc.solve(joint, errors[i], theta)
    revolution.psi, revolution.output_angle, revolution.reactions
    rccc.mobility(revolution.lines, "RRRR").dof

Three cylindrical pairs whose axes are not parallel to one plane transmit no force, so a torque reaches the output as a
couple alone, normal to both axes of the cross. The shafts' rotation depends on tilts alone, and only on those that
change a right angle between neighbouring axes (a pin about z, a hole about t); the other tilts shift the output angle
by a constant or do not change it, and position errors only make the pairs slide. All other effects of errors in a real
joint come from the pins left out here.
"""

from tolstat.joint.rccc.linkage import Revolution, solve
from tolstat.joint.rccc.statics import (
    FREEDOMS,
    Lines,
    Mobility,
    Reactions,
    constraint_jacobian,
    kutzbach,
    mobility,
    react,
)

__all__ = [
    "FREEDOMS",
    "Lines",
    "Mobility",
    "Reactions",
    "Revolution",
    "constraint_jacobian",
    "kutzbach",
    "mobility",
    "react",
    "solve",
]
