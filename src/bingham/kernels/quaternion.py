"""Hamilton quaternions (w, x, y, z), scalar first, as scalars, for compiled loops."""

from __future__ import annotations

import math

from bingham.kernels.compile import compiled

__all__ = ["from_rotation_vector", "product", "rotate_rows"]


@compiled(inline=True)
def product(aw, ax, ay, az, bw, bx, by, bz):
    """Return a ⊗ b (Kurz et al. 2014, eq. 34)."""
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@compiled(inline=True)
def from_rotation_vector(x, y, z):
    """Return exp(r/2), the unit quaternion of the rotation vector r = (x, y, z) in rad."""
    angle2 = x * x + y * y + z * z
    if angle2 < 1e-4:
        # sin(θ/2)/θ and cos(θ/2) to order θ⁶: exact in a double below 1e-2 rad.
        s = 0.5 - angle2 * (1.0 / 48.0 - angle2 * (1.0 / 3840.0))
        c = 1.0 - angle2 * (0.125 - angle2 * (1.0 / 384.0 - angle2 * (1.0 / 46080.0)))
    else:
        angle = math.sqrt(angle2)
        s, c = math.sin(0.5 * angle) / angle, math.cos(0.5 * angle)
    return c, s * x, s * y, s * z


@compiled(inner=True)
def rotate_rows(frame, q, left):
    """Replace every row f of frame (n, 4) by f ⊗ q (left: q ⊗ f), in place."""
    s = -1.0 if left else 1.0
    w, x, y, z = q[0], q[1], q[2], q[3]
    for j in range(frame.shape[0]):
        a, b, c, d = frame[j, 0], frame[j, 1], frame[j, 2], frame[j, 3]
        frame[j, 0] = a * w - b * x - c * y - d * z
        frame[j, 1] = a * x + b * w + s * (c * z - d * y)
        frame[j, 2] = a * y + c * w + s * (d * x - b * z)
        frame[j, 3] = a * z + d * w + s * (b * y - c * x)
