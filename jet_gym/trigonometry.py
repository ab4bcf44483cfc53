"""Sine, cosine and arctangent in straight-line arithmetic.

The functions of a mathematical library are calls, and a loop with a call in it does not run in SIMD lanes. These
are the polynomials of Moshier's Cephes library without its branches, right to a few units in the last place.
"""

from __future__ import annotations

import math

from jet_gym.utils.compilation import inlined

_TINY = 1e-300


@inlined
def sine_cosine(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle within [-pi, pi] rad."""
    x = 0.25 * angle
    z = x * x
    s = 1.58962301576546568060e-10
    s = s * z - 2.50507477628578072866e-8
    s = s * z + 2.75573136214857245213e-6
    s = s * z - 1.98412698295895385996e-4
    s = s * z + 8.33333333332211858878e-3
    s = s * z - 1.66666666666666307295e-1
    s = x + x * z * s
    twice = 2.0 * s * math.sqrt(1.0 - s * s)
    cosine = 1.0 - 2.0 * s * s
    return 2.0 * twice * cosine, 1.0 - 2.0 * twice * twice


@inlined
def arctangent(y: float, x: float) -> float:
    """Return the angle of the vector (x, y) from the x axis in [-pi, pi] rad; 0 for no vector."""
    long, short = max(abs(x), abs(y)), min(abs(x), abs(y))
    steep = short > 0.41421356237309503 * long  # tan(pi / 8): from there on, count from pi / 4
    ratio = (short - long if steep else short) / max(short + long if steep else long, _TINY)
    z = ratio * ratio
    p = -8.750608600031904122785e-1
    p = p * z - 1.615753718733365076637e1
    p = p * z - 7.500855792314704667340e1
    p = p * z - 1.228866684490136173410e2
    p = p * z - 6.485021904942025371773e1
    q = z + 2.485846490142306297962e1
    q = q * z + 1.650270098316988542046e2
    q = q * z + 4.328810604912902668951e2
    q = q * z + 4.853903996359136964868e2
    q = q * z + 1.945506571482613964425e2
    angle = ratio + ratio * (z * p / q)
    angle = 0.25 * math.pi + angle if steep else angle
    angle = 0.5 * math.pi - angle if abs(y) > abs(x) else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle
