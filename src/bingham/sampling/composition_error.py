"""How far the Bingham distribution that stands for a composition is from the true one."""

from __future__ import annotations

import numpy as np

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.sampling.riemannian import transported

__all__ = ["composition_error"]


def composition_error(p: Bingham, q: Bingham, *, reverse: bool = False, nodes: int | None = None) -> float:
    """Return KL(f_B ‖ f_true), nats, f_B the moment-matched distribution of x ⊕ y, x ~ p, y ~ q; d = 2 or 4.

    Glover & Kaelbling (2013), A.9.3, with cubature in place of finite elements: Gauss–Hermite nodes of the standard
    normal are carried to f_B, quantile by quantile, and r = f_true/f_B is smooth there. E_B[r − 1 − log r] is the
    divergence, as E_B[r] = 1, and loses no digits when it is small.

    Parameters
    ----------
    p, q : Bingham
        Single distributions of dimension 2 or 4.
    reverse : bool
        KL(f_true ‖ f_B) in its place, which moment matching minimises: E_B[r log r − r + 1].
    nodes : int, optional
        Nodes for each dimension of the sphere; 24 (d = 4) or 200 (d = 2) give 0.3 % of the divergence, or better.

    Examples
    --------
    >>> near = np.eye(4)[:, ::-1]
    >>> wide, narrow = (Bingham([z, z, z, 0.0], near) for z in (-10.0, -300.0))
    >>> composition_error(wide, wide) > 1e3 * composition_error(narrow, narrow) > 0.0
    True
    """
    if p.dim not in (2, 4) or p.shape or q.shape:
        raise InvalidArgumentError("p, q", "single distributions of dimension 2 or 4", f"{p!r}, {q!r}")
    matched = p.compose(q)
    n = p.dim - 1
    t, w = np.polynomial.hermite_e.hermegauss(nodes or (24 if n == 3 else 200))
    grid = np.stack(np.meshgrid(*[t] * n, indexing="ij"), axis=-1).reshape(-1, n)
    weights = np.prod(np.stack(np.meshgrid(*[w / w.sum()] * n, indexing="ij"), axis=-1).reshape(-1, n), axis=1)
    x = transported(np.ascontiguousarray(grid), np.array(matched.z), symmetric=False) @ matched.M.T
    log_r = p.composed_logpdf(q, x) - matched.logpdf(x)
    excess = np.expm1(log_r)
    values = (1.0 + excess) * log_r - excess if reverse else excess - log_r
    return float(weights @ values)
