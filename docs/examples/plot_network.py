"""
A network that knows how sure it is
===================================

A small network looks at eight noisy points of a body and says how the body is turned. It puts out ten numbers, the
matrix of a Bingham distribution, and is trained by the likelihood. The noise differs from picture to picture and is not
told: the network has to read its own uncertainty off the points.

The task is chosen because its true answer is known. For Gaussian noise of known size the posterior of the rotation *is*
a Bingham distribution, so the best possible loss is known too. Beside the Bingham head stand a matrix Fisher head, the
same family in other numbers, and a plain quaternion loss, which says nothing of its uncertainty.
"""

import time

import matplotlib.pyplot as plt
import numpy as np
import torch
from torch import nn
from torch.nn.functional import normalize

from bingham.torch import (
    Bingham,
    BinghamMixtureNLLLoss,
    BinghamNLLLoss,
    MatrixFisher,
    from_numbers,
    negative_log_likelihood,
)

torch.manual_seed(0)
torch.set_num_threads(1)
start = time.process_time()
body = torch.randn(8, 3)


def rotation_matrix(q):
    w, x, y, z = q.unbind(-1)
    rows = [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]  # fmt: skip
    return torch.stack(rows, -1).unflatten(-1, (3, 3))


def pictures(count, points=body, low=0.2, high=0.8):
    """Orientations (count, 4), measured points (count, 8, 3), and their noise (count,)."""
    q = normalize(torch.randn(count, 4), dim=-1)
    noise = low * (high / low) ** torch.rand(count)
    seen = points @ rotation_matrix(q).mT + noise[:, None, None] * torch.randn(count, 8, 3)
    return q, seen, noise


class Network(nn.Module):
    """Numbers (n, outputs) = e^s (linear + layers): sharpness apart from shape, so that either may be learned first."""

    def __init__(self, outputs):
        super().__init__()
        self.linear = nn.Linear(24, outputs)
        self.layers = nn.Sequential(
            nn.Linear(24, 128), nn.SiLU(), nn.Linear(128, 128), nn.SiLU(), nn.Linear(128, outputs + 1)
        )

    def forward(self, seen):
        x = seen.flatten(1)
        shape, sharpness = self.layers(x).split((self.linear.out_features, 1), -1)
        return sharpness.exp() * (self.linear(x) + shape)


def train(model, loss, draw=pictures, steps=1500):
    optimizer = torch.optim.Adam(model.parameters(), 2e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 4e-3, total_steps=steps)
    for _ in range(steps):
        q, seen, _ = draw(256)
        optimizer.zero_grad()
        loss(model(seen), q).backward()
        nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        optimizer.step()
        schedule.step()
    return model.eval().requires_grad_(False)


# %%
# Three heads, one loop
# ---------------------
# The networks put out numbers of order one; times 20, they are concentrations that small errors need. A linear part
# and a common factor let a network learn shape and sharpness apart.

SCALE = 20.0
bingham_loss = BinghamNLLLoss()
bingham_net = train(Network(10), lambda v, q: bingham_loss(from_numbers(SCALE * v), q))
fisher_net = train(Network(9), lambda v, q: -MatrixFisher(SCALE / 4 * v.unflatten(-1, (3, 3)), validate_args=False)
                   .log_prob(rotation_matrix(q)).mean())  # fmt: skip
plain_net = train(Network(4), lambda v, q: (1 - (normalize(v, dim=-1) * q).sum(-1) ** 2).mean())

q, seen, noise = pictures(4000)
ours = Bingham(from_numbers(SCALE * bingham_net(seen)), validate_args=False)
fisher = MatrixFisher(SCALE / 4 * fisher_net(seen).unflatten(-1, (3, 3)), validate_args=False).bingham
exact = MatrixFisher(seen.mT @ body / noise[:, None, None] ** 2, validate_args=False).bingham


def angle_deg(a, b):
    """Angles of the rotations between orientations, degrees."""
    return torch.rad2deg(2 * torch.acos((a * b).sum(-1).abs().clamp(max=1.0)))


def pit(sample, log_prob, truth, draws=199):
    """Rank of the truth's log-density among samples: uniform where the distribution is right."""
    below = (log_prob(sample(draws)) < log_prob(truth)).sum(0)
    return (below + 1.0) / (draws + 1.0)


def coverage(ranks, level=0.95):
    """How often the set of highest density that holds ``level`` of the probability holds the truth."""
    return f"{level:.0%} sets hold {(ranks > 1.0 - level).double().mean():.1%}"


heads = {"Bingham": ours, "matrix Fisher": fisher}
ranks = {name: pit(lambda n, p=p: p.sample((n,)), p.log_prob, q) for name, p in heads.items()}
for name, p in {"exact": exact, **heads}.items():
    loss, error = -p.log_prob(q).mean(), angle_deg(p.mode, q).median()
    covered = f", {coverage(ranks[name])}" if name in ranks else ""
    print(f"{name:14s} loss {loss:6.3f} nats, median error {error:4.1f}°{covered}")
print(f"{'quaternion':14s} median error {angle_deg(normalize(plain_net(seen), dim=-1), q).median():4.1f}°")

# %%
# A body with a symmetry
# ----------------------
# Half a turn about the body's z-axis changes nothing that can be seen: either of two orientations is right, at random.
# One Bingham distribution has to cover both and what lies between them. A mixture of two does not.

half_turn = torch.tensor([0.0, 0.0, 0.0, 1.0])
paired = torch.cat([body[:4], body[:4] * torch.tensor([-1.0, -1.0, 1.0])])


def symmetric_pictures(count):
    q, seen, noise = pictures(count, paired)
    w, x, y, z = q.unbind(-1)
    turned = torch.stack([-z, y, -x, w], -1)  # q ⊗ half_turn
    return torch.where(torch.rand(count, 1) < 0.5, q, turned), seen, noise


def parts(v):
    return v[..., :2], SCALE * from_numbers(v[..., 2:].unflatten(-1, (2, 10)))


mixture_loss = BinghamMixtureNLLLoss()
one_net = train(Network(10), lambda v, q: bingham_loss(from_numbers(SCALE * v), q), symmetric_pictures)
two_net = train(Network(22), lambda v, q: mixture_loss(*parts(v), q), symmetric_pictures)
q2, seen2, _ = symmetric_pictures(4000)
one = Bingham(from_numbers(SCALE * one_net(seen2)), validate_args=False)
logits, matrices = parts(two_net(seen2))
components = Bingham(matrices, validate_args=False)


def mixture_log_prob(x):
    return torch.logsumexp(torch.log_softmax(logits, -1) - negative_log_likelihood(matrices, x[..., None, :]), -1)


def mixture_sample(n):
    chosen = torch.distributions.Categorical(logits=logits).sample((n,))
    return components.sample((n,)).take_along_dim(chosen[..., None, None], -2)[..., 0, :]


ranks["one, symmetric body"] = pit(lambda n: one.sample((n,)), one.log_prob, q2)
ranks["mixture, symmetric body"] = pit(mixture_sample, mixture_log_prob, q2)
for name, log_prob in {"one, symmetric body": one.log_prob, "mixture, symmetric body": mixture_log_prob}.items():
    print(f"{name:24s} loss {-log_prob(q2).mean():6.3f} nats, {coverage(ranks[name])}")

# %%
# What it has never seen
# ----------------------
# Points that belong to no turned body, and more noise than in training: entropy is what a network tells them by.

strange = torch.randn(4000, 8, 3) * seen.std()
loud = pictures(4000, low=1.0, high=2.0)[1]
entropies = {
    "as trained": ours.entropy(),
    "more noise": Bingham(from_numbers(SCALE * bingham_net(loud)), validate_args=False).entropy(),
    "no such body": Bingham(from_numbers(SCALE * bingham_net(strange)), validate_args=False).entropy(),
}
for name in ("more noise", "no such body"):
    other = entropies[name][:, None] > entropies["as trained"][None]
    print(f"{name}: entropy higher than of a picture as trained in {other.double().mean():.1%} of pairs")

figure, panels = plt.subplots(1, 3, figsize=(10.0, 3.2), layout="constrained")
for name, r in ranks.items():
    panels[0].plot(np.linspace(0, 1, len(r)), np.sort(r), label=name, linewidth=1.2)
panels[0].plot([0, 1], [0, 1], color="0.7", linewidth=0.8, zorder=0)
panels[0].set(xlabel="uniform", ylabel="PIT", title="calibration")
panels[0].legend(frameon=False, fontsize=7)
spread = torch.rad2deg(2 * torch.sqrt(1 - torch.linalg.eigvalsh(ours.second_moment)[:, -1]))
panels[1].scatter(noise, spread, s=2, alpha=0.3, label="root mean square, reported")
panels[1].scatter(noise, angle_deg(ours.mode, q), s=2, alpha=0.3, label="error")
panels[1].set(
    xscale="log",
    yscale="log",
    ylim=(0.5, 180),
    xlabel="noise of the points",
    ylabel="angle, °",
    title="reads its noise",
)
panels[1].legend(frameon=False, fontsize=7)
for name, e in entropies.items():
    panels[2].hist(e.numpy(), bins=60, density=True, histtype="step", label=name)
panels[2].set(xlabel="entropy, nats", yticks=[], title="out of distribution")
panels[2].legend(frameon=False, fontsize=7)
print(f"{time.process_time() - start:.0f} s of processor time")
