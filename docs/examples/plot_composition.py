"""
How good is the composed distribution?
======================================

The product of two Bingham rotations is not Bingham. The filter uses the Bingham distribution with the same second
moment; the true density is known too, and so is the price: the Kullback–Leibler divergence between them. It is
estimated from exact samples of the product as the mean of r − 1 − log r with r the ratio of the densities, of which no
term is negative.
"""

import matplotlib.pyplot as plt
import numpy as np

from bingham import Bingham
from bingham.rotations import compose

identity = np.eye(4)[:, [1, 2, 3, 0]]
spread = np.degrees(1.0 / np.sqrt(0.5 * np.geomspace(1.0, 800.0, 12)))
price = []
for z in np.geomspace(1.0, 800.0, 12):
    p = Bingham([-z, -z, -z, 0.0], identity)
    q = Bingham([-4.0 * z, -z, -0.25 * z, 0.0], identity)
    x = compose(p.rvs(20_000, rng=1), q.rvs(20_000, rng=2))
    log_ratio = p.compose(q).logpdf(x) - p.composed_logpdf(q, x)
    terms = np.expm1(log_ratio) - log_ratio
    price.append((terms.mean(), terms.std() / np.sqrt(len(x))))
price = np.array(price)

figure, panel = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
panel.errorbar(spread, price[:, 0], 2.0 * price[:, 1], fmt="o-", markersize=3, linewidth=1.0, capsize=2)
panel.set(xscale="log", yscale="log", xlabel="standard deviation of the first rotation, °", ylabel="divergence, nats")
panel.set_xticks([3, 10, 30, 80], ["3", "10", "30", "80"])
panel.minorticks_off()
panel.spines[["top", "right"]].set_visible(False)
print(f"largest divergence {price[:, 0].max():.4f} nats")
