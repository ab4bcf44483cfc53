"""Between which heights of the hip a leg can stand: reach and joint limits, eq. (8), in closed form.

Where a foot is level and points forward, and the pelvis is level, the limits of the leg's joints are circles in
the plane of the leg, so that the hip's place over the ground leaves it an interval of heights. Those of the yaw are
not among them.
"""

from __future__ import annotations

import math

from jet_gym.leg import Leg
from jet_gym.utils.compilation import inlined

_FROM_STRAIGHT = 2e-5  # [m] kept from where the leg is straight: a nearly straight knee turns without end
_FROM_LIMIT = 1e-4  # [rad] kept from the limits of the joints


@inlined
def hip_heights(leg: Leg, dx: float, dy: float) -> tuple[float, float]:
    """Return the least and the largest height of the hip over the ankle [m]; none is left where the least is more.

    Args:
        leg: The leg; its knee bends forward and lies straight below the hip at zero posture, as Jet-HR1's does.
        dx: The hip's place relative to the ankle, forward [m].
        dy: Likewise to the left [m].
    """
    thigh, shank, lateral = -leg.thigh[2], -leg.shank[2], leg.shank[1]
    across = lateral * lateral - dy * dy
    reach = (thigh + shank) * (thigh + shank)
    highest_squared = reach - dx * dx  # in the plane of the leg, as what follows
    # a leg that leans back so far that its thigh is at the limit when it is straight has to bend
    tilt = leg.upper[2] - _FROM_LIMIT
    knee_ahead = dx - thigh * math.sin(tilt)
    tilted = thigh * math.cos(tilt) + math.sqrt(max(shank * shank - knee_ahead * knee_ahead, 0.0))
    leans_back = dx > (thigh + shank) * math.sin(tilt)
    highest_squared = min(highest_squared, tilted * tilted) if leans_back else highest_squared
    highest = math.sqrt(max(highest_squared + across, 0.0)) - _FROM_STRAIGHT

    roll_left, roll_right = -leg.lower[5] - _FROM_LIMIT, leg.upper[5] - _FROM_LIMIT
    lowest = max(
        (dy * math.cos(roll_right) - lateral) / math.sin(roll_right),
        (lateral - dy * math.cos(roll_left)) / math.sin(roll_left),
    )

    flexion = leg.upper[3] - _FROM_LIMIT
    folded_squared = thigh * thigh + shank * shank + 2.0 * thigh * shank * math.cos(flexion) - dx * dx
    # the hip is on a circle about the knee when the ankle is pitched as far as it goes, the knee in front
    lean = -leg.lower[4] - _FROM_LIMIT
    knee_ahead = dx - shank * math.sin(lean)
    above_knee = math.sqrt(max(thigh * thigh - knee_ahead * knee_ahead, 0.0))
    leaning = shank * math.cos(lean) + above_knee if above_knee > 0.0 else 0.0
    # the knee is on a circle about the ankle when the hip is pitched as far as it goes, the knee in front
    lift = -leg.lower[2] - _FROM_LIMIT
    knee_from_ankle = dx + thigh * math.sin(lift)
    knee_up = math.sqrt(max(shank * shank - knee_from_ankle * knee_from_ankle, 0.0))
    lifted = thigh * math.cos(lift) + knee_up if knee_up > 0.0 else 0.0

    bent = max(leaning, lifted, 0.0)
    least_squared = max(folded_squared, bent * bent)  # in the plane of the leg
    return max(lowest, math.sqrt(max(least_squared + across, 0.0))), highest
