"""The Cardan joint as an RCCC linkage: with manufacturing errors, but rigid and without clearance.

Cirelli et al. (2021), section 1, put a linkage of four links, one revolute and three cylindrical pairs, in place of
the overconstrained joint. The paper does not say which pair is which. Here the links and pairs are

    frame -R- input fork -C- cross -C- output fork -C- frame

(as Ciornei et al., IOP Conf. Ser.: Mater. Sci. Eng. 477, 2019, 012037, have it), because (1) the paper turns the
revolute joints into cylindrical ones, which leaves one revolute pair, and only the input shaft's can be it: that shaft
is driven and its bearing is rigid (`docs/model.md`), so it holds the linkage along its axis; (2) pins slide freely
along their holes, so both pairs of the cross are cylindrical; (3) the output shaft must then be free to slide: held
too, it would make one constraint more than the linkage can stand, and errors would lock it.

Of the two opposite pins in each fork one is kept as the pair, the other is left out as redundant. Which is a
parameter: pin 3 (in arm 1) or 4 (in arm 2) on the input side, pin 1 (in arm 4) or 2 (in arm 3) on the output side. By
default pins 3 and 1; the paper's errors sit on pin 1 and the hole of arm 4. Errors of a pin or hole left out have no
effect, nor have diameters.

    revolution = rccc.solve(joint, errors[i], theta)
    revolution.psi, revolution.output_angle, revolution.reactions
    rccc.mobility(revolution.lines, "RRRR").dof

Three cylindrical pairs whose axes are not parallel to one plane pass on no force, so a torque reaches the output as a
couple alone, normal to both axes of the cross. The shafts' rotation depends on tilts alone, and only on those that turn
a right angle between neighbouring axes into another (a pin about z, a hole about t); the other tilts shift the output
angle by a constant or do nothing to it, and position errors make the pairs slide and no more. What else errors do to a
real joint they do through the pins left out here.
"""

from tolstat.joint.rccc.constraints import FREEDOMS, Lines, constraint_jacobian
from tolstat.joint.rccc.linkage import Revolution, solve
from tolstat.joint.rccc.mobility import Mobility, kutzbach, mobility
from tolstat.joint.rccc.statics import Reactions, react

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
