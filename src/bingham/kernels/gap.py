"""Missing gyroscope samples: what is a gap, and how far the rate in it is unknown."""

from __future__ import annotations

from bingham.kernels.compile import compiled

__all__ = ["LONG_GAP", "PACE_STATE", "bridge_gaps", "gap_variance", "is_gap", "usual_step"]

LONG_GAP = 0.25  # s without a sample that are a gap at any sampling rate
GAP_STEPS = 5.0  # usual steps that are one
GAP_RATE = 1.0  # rad/s, standard deviation of the rate in a long gap, whatever the samples around it say
PACE = 0.02
# Running median of the steps, last rate (3).
PACE_STATE = 4


@compiled(inline=True)
def usual_step(usual, dt):
    """Return the running median of the steps after one more of dt seconds; 0 before the first."""
    if usual <= 0.0:
        return dt
    return usual * (1.0 + PACE if dt > usual else 1.0 - PACE)


@compiled(inline=True)
def is_gap(dt, usual):
    """Whether samples are missing between two that are dt seconds apart."""
    return dt >= LONG_GAP or (usual > 0.0 and dt > GAP_STEPS * usual)


@compiled(inline=True)
def gap_variance(dt, change2):
    """Return the variance (rad² per axis) of the rotation over a gap of dt seconds.

    change2 (rad²/s²) is how much the rate has changed around the gap, summed over the axes. The longer the gap, the
    more may have happened that the samples around it do not show.
    """
    rate = GAP_RATE * min(1.0, dt / LONG_GAP)
    return (rate * rate + change2 / 3.0) * dt * dt


@compiled()
def bridge_gaps(steps, gyroscope, pace, variances):
    """Write `gap_variance` of every step to variances (T,), 0 without a gap; a gap's rate becomes that around it.

    steps (T,) seconds, 0 for no step; gyroscope (T, 3) rad/s, changed in place; pace (`PACE_STATE`,) carries on.
    """
    for t in range(steps.size):
        dt = steps[t]
        variances[t] = 0.0
        gap = dt > 0.0 and is_gap(dt, pace[0])
        if dt > 0.0:
            pace[0] = usual_step(pace[0], dt)
        change2 = 0.0
        for i in range(3):
            rate = gyroscope[t, i]
            if gap:
                change2 += (rate - pace[1 + i]) ** 2
                gyroscope[t, i] = 0.5 * (rate + pace[1 + i])
            pace[1 + i] = rate
        if gap:
            variances[t] = gap_variance(dt, change2)
