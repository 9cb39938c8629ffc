"""
A filtered orientation in a pose graph (GTSAM)
==============================================

A drone's camera looks down at 60°. Its inertial sensor knows which way is up, within half a degree, but not where north
is. A pose graph shall find the heading from a few position fixes along a straight flight, and take the inclination from
the filter: its covariance goes into the graph as the noise of a prior.

GTSAM writes a perturbed rotation as R Exp(φ): φ is a small rotation in the axes of the *body*, and of the six numbers
of a pose's perturbation the rotation comes first. A 3×3 covariance about the axes of the *world* has the same shape and
goes in without a word. What it does there is shown last.
"""

import gtsam
import matplotlib.pyplot as plt
import numpy as np

from bingham import Bingham, ImuFilter, ImuRecording
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate, to_rotation_vector

# %%
# What the filter knows
# ---------------------
# Two seconds at rest, no magnetometer. The orientation rotates body vectors into the world (east, north, up).

rng = np.random.default_rng(3)
north_east, down_60 = from_rotation_vector([0.0, 0.0, 0.9]), from_rotation_vector([0.0, np.radians(60.0), 0.0])
truth = compose(north_east, down_60)
t = np.arange(200) / 100.0
up = rotate(conjugate(truth), [0.0, 0.0, 9.81])
still = ImuRecording("hover", t, 1e-3 * rng.standard_normal((200, 3)), up + 0.05 * rng.standard_normal((200, 3)))
track = ImuFilter().run(still)
orientation = track.modes[-1]
in_world, in_body = (track.covariance(frame=frame)[-1] for frame in ("world", "body"))
print("standard deviations, degrees, about")
print("  east, north, up:", np.degrees(np.sqrt(np.diag(in_world))).round(1))
print("  the body's axes:", np.degrees(np.sqrt(np.diag(in_body))).round(1))

# %%
# GTSAM's side of the convention, checked rather than believed: the coordinates of a rotation rotated by φ in its own
# axes are φ. Its quaternions have w first, too.

start = gtsam.Rot3.Quaternion(*orientation)
phi = np.array([0.01, -0.02, 0.03])
rotated = gtsam.Rot3.Quaternion(*compose(orientation, from_rotation_vector(phi)))
assert np.allclose(start.localCoordinates(rotated), phi)
assert np.allclose(start.retract(phi).matrix(), rotated.matrix())

# %%
# The graph
# ---------
# A prior for the first pose, odometry between the poses (``BetweenFactorPose3``; metres and radians in the body's axes)
# and position fixes good to 0.3 m. The flight goes straight on: fixes on a line say nothing of turning around it.

step = gtsam.Pose3(gtsam.Rot3(), rotate(conjugate(down_60), [4.0, 0.0, 0.0]))  # 4 m forward
poses = [gtsam.Pose3(gtsam.Rot3.Quaternion(*truth), np.zeros(3))]
for _ in range(8):
    poses.append(poses[-1].compose(step))
odometry_noise = np.diag([2e-3**2] * 3 + [0.02**2] * 3)
moves = [step.retract(rng.multivariate_normal(np.zeros(6), odometry_noise)) for _ in range(8)]
fixes = [pose.translation() + 0.3 * rng.standard_normal(3) for pose in poses]


def solve(covariance):
    """Return the estimated poses and the marginal covariances of their rotations."""
    graph = gtsam.NonlinearFactorGraph()
    prior = np.diag([0.0] * 3 + [10.0**2] * 3)
    prior[:3, :3] = covariance
    first = gtsam.Pose3(start, np.zeros(3))
    graph.add(gtsam.PriorFactorPose3(0, first, gtsam.noiseModel.Gaussian.Covariance(prior)))
    for k, move in enumerate(moves):
        noise = gtsam.noiseModel.Gaussian.Covariance(odometry_noise)
        graph.add(gtsam.BetweenFactorPose3(k, k + 1, move, noise))
    for k, fix in enumerate(fixes):
        graph.add(gtsam.GPSFactor(k, fix, gtsam.noiseModel.Isotropic.Sigma(3, 0.3)))
    guess = gtsam.Values()
    for k in range(len(poses)):
        guess.insert(k, first)
        first = first.compose(moves[k]) if k < len(moves) else first
    found = gtsam.LevenbergMarquardtOptimizer(graph, guess).optimize()
    marginals = gtsam.Marginals(graph, found)
    return [found.atPose3(k) for k in range(len(poses))], [marginals.marginalCovariance(k) for k in range(len(poses))]


# %%
# Out again
# ---------
# The rotation's block of a marginal covariance is a covariance in the body's axes, and with the pose a Bingham
# distribution.


def quaternion(pose):
    """Return the orientation of a pose, (w, x, y, z)."""
    q = pose.rotation().toQuaternion()
    return np.array([q.w(), q.x(), q.y(), q.z()])


results = {"body (right)": solve(in_body), "world (wrong)": solve(in_world)}
for name, (found, covariances) in results.items():
    distribution = Bingham.from_covariance(quaternion(found[-1]), covariances[-1][:3, :3], frame="body")
    reported = np.degrees(np.sqrt(np.diag(distribution.covariance(frame="world"))))
    error = np.degrees(to_rotation_vector(compose(quaternion(found[-1]), conjugate(truth))))
    print(f"{name:14} error about east, north, up {error.round(1)}°, reported {reported.round(1)}°")

# %%
# Told that the camera's z axis is the uncertain one, the graph turns it about that to follow the fixes: it rolls over
# by some 40°, and states 2° (two standard deviations) for it.

figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.8), layout="constrained")
path = np.array([pose.translation() for pose in poses])
left.plot(path[:, 0], path[:, 1], color="0.6", linewidth=4.0, label="true")
left.plot(*np.array(fixes).T[:2], "k+", label="position fixes")
for k, (name, (found, covariances)) in enumerate(results.items()):
    colour = f"C{k}"
    estimate = np.array([pose.translation() for pose in found])
    left.plot(estimate[:, 0], estimate[:, 1], "o-", markersize=3, color=colour, label=f"covariance: {name}")
    # Inclination: the angle between the true vertical and the estimated one, as seen from the body.
    seen = np.array([rotate(conjugate(quaternion(pose)), [0.0, 0.0, 1.0]) for pose in found])
    lean = np.degrees(np.arccos(np.clip(seen @ (up / 9.81), -1.0, 1.0)))
    turn = [pose.rotation().matrix() for pose in found]
    spread = [np.trace((r @ c[:3, :3] @ r.T)[:2, :2]) for r, c in zip(turn, covariances, strict=True)]
    right.plot(lean, "o-", markersize=3, color=colour, label=f"error, {name}")
    right.plot(2.0 * np.degrees(np.sqrt(spread)), "--", color=colour, label=f"reported, 2σ, {name}")
left.set(xlabel="east, m", ylabel="north, m", title="From above", aspect="equal")
right.set(xlabel="pose", ylabel="inclination, °", title="Where is up?", yscale="log", ylim=(0.03, 100.0))
left.legend(frameon=False, fontsize=8)
right.legend(frameon=False, fontsize=8, ncols=2, loc="center left", bbox_to_anchor=(0.0, 0.75))
for panel in (left, right):
    panel.spines[["top", "right"]].set_visible(False)
