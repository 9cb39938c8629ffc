"""The Bingham distribution as an immutable value."""

from __future__ import annotations

from operator import index
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, NoReturn, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.algebra import compose_spectra, noise_parts, sample_rows, sorted_spectrum, spectral
from bingham.distributions.libraries import elsewhere
from bingham.distributions.normalizer import log_normalizer, moments, solve_moments, solve_spectrum
from bingham.distributions.uncertainty import (
    covariance,
    credible_angle,
    frame_required,
    moment_from_covariance,
    standard_errors,
)
from bingham.errors import InvalidArgumentError
from bingham.notebook import Pictured
from bingham.rotations import compose, conjugate
from bingham.validation import as_generator, as_numbers, check_kind, check_number, integer, unit_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["Bingham", "StandardErrors"]

FloatArray = NDArray[np.float64]


class StandardErrors(NamedTuple):
    """Standard errors of a maximum-likelihood fit.

    ``concentrations`` (..., d): of zᵢ, 0 for the largest, which is 0 by convention. ``axes`` (..., d, d): in rad, of
    the angle by which principal axes i and j may turn towards each other; infinite where zᵢ = zⱼ, 0 on the diagonal.
    """

    concentrations: FloatArray
    axes: FloatArray


class Bingham(Pictured):
    """Distribution of a random axis or rotation x on S^{d−1}: f(x) = exp(xᵀ A x) / F(z), A = M diag(z) Mᵀ.

    f is a density with respect to surface area and f(x) = f(−x). The parameters are kept in spectral form: z ascending
    with its last entry 0, the columns of M in the same order. Leading axes are a batch. Values are immutable.

    Parameters
    ----------
    z : (..., d) array_like
        Concentrations in any order; a common offset changes nothing.
    M : (..., d, d) array_like
        Orthogonal matrix (within 1e-6; rounding is removed), columns in the order of z.

    Raises
    ------
    InvalidArgumentError
        If shapes do not fit, z is not finite or M is not orthogonal.

    Examples
    --------
    >>> import numpy as np
    >>> p = Bingham([-8.0, 0.0], np.eye(2))
    >>> p.mode
    array([0., 1.])
    >>> p.dim
    2

    References
    ----------
    Bingham, Ann. Statist. 2 (1974) 1201; Kurz, Gilitschenski, Julier & Hanebeck, JAIF 9(2), 2014, Definition 1.
    """

    __slots__ = ("_M", "_log_f", "_w", "_z")
    _z: FloatArray
    _M: FloatArray
    _log_f: Any
    _w: FloatArray | None

    def __init__(self, z: ArrayLike, M: ArrayLike) -> None:
        spectrum, frame = sorted_spectrum(z, M)
        self._set(spectrum, frame, None, None)

    def _set(self, z: FloatArray, frame: FloatArray, log_f: Any, w: FloatArray | None) -> None:
        z.setflags(False)  # pyright: ignore[reportCallIssue]  (write; by keyword it takes twice as long)
        frame.setflags(False)  # pyright: ignore[reportCallIssue]
        _put_z(self, z)
        _put_m(self, frame)
        _put_log_f(self, log_f)
        _put_w(self, w)

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"Bingham is immutable: cannot set {name!r}; make a new one")

    def __reduce__(self) -> tuple[Any, ...]:
        return (Bingham.from_spectrum, (np.array(self._z), np.array(self._M)))

    def __repr__(self) -> str:
        if self.shape:
            return f"<Bingham: a batch {self.shape} of distributions, d = {self.dim}>"
        z, mode = (np.array2string(a, threshold=8, max_line_width=200) for a in (self._z, self.mode))
        return f"Bingham(z={z}, mode={mode})"

    def __eq__(self, other: object) -> bool:
        """Whether z and the principal axes are the same numbers, axes up to sign; those of z = 0 do not matter."""
        return isinstance(other, Bingham) and self.shape == other.shape and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> bytes:
        """Return the bytes that equal distributions share; + 0.0 makes one zero of two."""
        first = np.take_along_axis(self._M, np.abs(self._M).argmax(axis=-2, keepdims=True), axis=-2)
        axes = np.where(self._z[..., None, :] == 0.0, 0.0, self._M * np.sign(first))
        single = np.count_nonzero(self._z == 0.0, axis=-1)[..., None] == 1
        axes[..., -1] = np.where(single, (self._M * np.sign(first))[..., -1], 0.0)
        return (self._z + 0.0).tobytes() + (axes + 0.0).tobytes()

    # Construction

    @classmethod
    def from_spectrum(cls, z: FloatArray, M: FloatArray, log_f: Any = None, moments: FloatArray | None = None) -> Self:
        """Wrap float64 arrays that are in canonical spectral form already, unchecked; the arrays become read-only."""
        self = cls.__new__(cls)
        self._set(z, M, log_f, moments)
        return self

    @classmethod
    def from_matrix(cls, A: ArrayLike) -> Self:
        """Return the distribution with density ∝ exp(xᵀ A x) for a symmetric A (..., d, d); A + c I is the same.

        Raises
        ------
        InvalidArgumentError
            If A is not finite, square or symmetric within 1e-8 of its size.
        """
        z, frame = spectral(A, "A")
        return cls.from_spectrum(np.ascontiguousarray(z - z[..., -1:]), frame)

    @classmethod
    def from_moment(cls, S: ArrayLike) -> Self:
        """Return the distribution with E[x xᵀ] = S, the maximum-entropy distribution of that second moment.

        Parameters
        ----------
        S : (..., d, d) array_like
            Symmetric, positive definite, trace 1 (within 1e-8).

        Raises
        ------
        InvalidArgumentError
            If S is no such matrix; a singular S describes a distribution on a smaller sphere and is rejected.
        """
        w, frame = cls._checked_moment(S)
        z, log_f, _ = solve_moments(w)
        return cls.from_spectrum(z, frame, log_f)

    @staticmethod
    def _checked_moment(S: ArrayLike, *, compiled: bool = True) -> tuple[FloatArray, FloatArray]:
        """Return the eigenvalues, ascending with sum 1, and eigenvectors of the argument of `from_moment`."""
        w, frame = spectral(S, "S", compiled=compiled)
        d = w.shape[-1]
        if not np.all(w[..., 0] > d * np.finfo(np.float64).eps * w[..., -1]):
            raise InvalidArgumentError(
                "S",
                "a positive definite second moment",
                f"smallest eigenvalue {w[..., 0].min():.3g}",
                "the data lie on a smaller sphere; drop that axis or add their noise variance",
            )
        total = w.sum(axis=-1)
        if not np.all(np.abs(total - 1.0) <= 1e-8):
            raise InvalidArgumentError("S", "trace 1 within 1e-8", total, "divide by the trace")
        return w / total[..., None], frame

    @classmethod
    def fit(
        cls,
        x: ArrayLike | Rotation,
        weights: ArrayLike | None = None,
        *,
        bias_corrected: bool = False,
        prior: float = 0.0,
    ) -> Self:
        """Return the maximum-likelihood distribution of unit vectors x; signs of rows do not matter.

        Its moment equals the weighted sample moment Σ wₙ xₙ xₙᵀ / Σ wₙ (Bingham 1974). `standard_errors` gives the
        uncertainty of the parameters.

        Parameters
        ----------
        x : (..., n, d) array_like or Rotation
            Unit vectors (within 1e-6).
        weights : (..., n) array_like, optional
            Non-negative, not all zero; only their ratios matter.
        bias_corrected : bool
            Take the concentrations that maximise their likelihood with the axes integrated out
            (`bingham.distributions.marginal`). Maximum likelihood overstates the steepest concentration of 10 axes
            1.7 to 2.3 times, this one by a third less and in the median hardly at all.
        prior : float
            Weight of a weak prior: that many further axes, spread evenly over all directions (the conjugate prior
            exp(prior (tr A/d − log F))). With 0.1 to 1 any sample has a fit, even a single axis.

        Raises
        ------
        InvalidArgumentError
            If x or the weights are malformed, or the sample lies on a smaller sphere (fewer than d different axes).
        """
        a = sample_rows(x)
        n = a.shape[-2]
        if weights is None:
            w = np.full(a.shape[:-1], 1.0 / max(n, 1))
        else:
            w = as_numbers(weights, "weights")
            try:
                w = np.broadcast_to(w, a.shape[:-1])
            except ValueError:
                raise InvalidArgumentError("weights", f"one for each sample, shape {a.shape[:-1]}", w.shape) from None
            total = w.sum(axis=-1, keepdims=True)
            if not (np.all(w >= 0.0) and np.all(np.isfinite(w)) and np.all(total > 0.0)):
                raise InvalidArgumentError("weights", "finite, non-negative, not all zero", weights)
            w = w / total
        if n == 0:
            raise InvalidArgumentError("x", "at least d samples", "none")
        moment = np.einsum("...ni,...n,...nj->...ij", a, w, a)
        moment /= np.trace(moment, axis1=-2, axis2=-1)[..., None, None]
        count = 1.0 / np.sum(w**2, axis=-1)  # Kish's n, n for equal weights
        if prior != 0.0:
            check_number(prior, "prior", "a number of axes ≥ 0", minimum=0.0)
            share = (prior / (count + prior))[..., None, None]
            moment, count = (1.0 - share) * moment + share * np.eye(a.shape[-1]) / a.shape[-1], count + prior
        try:
            w, frame = cls._checked_moment(moment, compiled=False)
        except InvalidArgumentError:
            hint = "add samples" if n < a.shape[-1] else "drop the axis they lack or add their noise variance"
            expected = f"at least d = {a.shape[-1]} different axes that span the space"
            raise InvalidArgumentError("x", expected, f"{n} samples on a smaller sphere", hint) from None
        z, log_f = solve_spectrum(w)
        fitted = cls.from_spectrum(z, frame, log_f)
        return fitted if not bias_corrected else cls.from_spectrum(*_corrected(fitted, count))

    @classmethod
    def uniform(cls, d: int) -> Self:
        """Return the uniform distribution on S^{d−1}."""
        integer(d, "d", 2)
        return cls.from_spectrum(np.zeros(d), np.eye(d))

    # Parameters

    @property
    def z(self) -> FloatArray:
        """Concentrations (..., d), ascending, the last one 0."""
        return self._z

    @property
    def M(self) -> FloatArray:
        """Orthogonal matrix (..., d, d); column i is the principal axis of zᵢ."""
        return self._M

    @property
    def matrix(self) -> FloatArray:
        """A = M diag(z) Mᵀ (..., d, d), negative semidefinite."""
        return (self._M * self._z[..., None, :]) @ np.swapaxes(self._M, -1, -2)

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        return self._z.shape[-1]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch; () for a single distribution."""
        return self._z.shape[:-1]

    @property
    def mode(self) -> FloatArray:
        """Last column of M (..., d): ± this vector has the largest density.

        Where z_{d−1} = 0 too (a girdle, the uniform distribution) the mode is not unique: every unit vector of the
        span of the columns with z = 0 is one. This is then any of them, for `uniform` the last unit vector, and says
        nothing about the distribution.
        """
        return self._M[..., :, -1]

    @property
    def log_normalizer(self) -> Any:
        """Log F(z) (...)."""
        if self._log_f is None:
            object.__setattr__(self, "_log_f", log_normalizer(self._z))
        return self._log_f

    @property
    def axis_moments(self) -> FloatArray:
        """ω (..., d) = E[(mᵢᵀ x)²] of the principal axes, ascending, sum 1."""
        if self._w is None:
            object.__setattr__(self, "_w", moments(self._z))
        assert self._w is not None
        return self._w

    def __getitem__(self, index: Any) -> Bingham:
        """Return part of a batch."""
        if not self.shape:
            raise InvalidArgumentError("index", "a batch of distributions", "a single distribution")
        index = index if isinstance(index, tuple) else (index,)
        part = (*index, ...) if not any(i is Ellipsis for i in index) else index
        return Bingham.from_spectrum(
            np.array(self._z[(*part, slice(None))]), np.array(self._M[(*part, slice(None), slice(None))])
        )

    # Density and moments

    def logpdf(self, x: ArrayLike | Rotation) -> Any:
        """Return log f(x) (...) for unit vectors x (..., d), broadcast against the batch.

        A tensor of PyTorch or JAX gives a tensor, differentiable by x.

        Raises
        ------
        InvalidArgumentError
            If a row of x is not of unit length within 1e-6.
        """
        there = elsewhere(x, "logpdf")
        if there is not None:
            return there(self.matrix, x)
        a = unit_rows(x, self.dim, "x")
        t = np.einsum("...ij,...i->...j", self._M, a)
        return (np.einsum("...j,...j,...j->...", self._z, t, t) - self.log_normalizer)[()]

    def pdf(self, x: ArrayLike | Rotation) -> Any:
        """Return f(x) (...) for unit vectors x (..., d); see `logpdf`."""
        there = elsewhere(x, "pdf")
        return np.exp(self.logpdf(x)) if there is None else there(self.matrix, x)

    def moment(self) -> FloatArray:
        """Return S = E[x xᵀ] (..., d, d), trace 1."""
        return (self._M * self.axis_moments[..., None, :]) @ np.swapaxes(self._M, -1, -2)

    def rvs(self, size: int | tuple[int, ...] | None = None, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples ``(*shape, *size, d)``.

        Parameters
        ----------
        size : int or tuple of int, optional
            Number or shape of the samples of each distribution; None for one without an axis of its own.
        rng : None, int or numpy.random.Generator
            Passed to ``numpy.random.default_rng``; the same seed gives the same samples.
        """
        from bingham.kernels.envelope import sample

        generator = as_generator(rng)
        try:
            dims = () if size is None else tuple(map(index, np.atleast_1d(size)))
        except TypeError:
            dims = (-1,)
        if min(dims, default=0) < 0:
            raise InvalidArgumentError("size", "an integer ≥ 0 or a tuple of them", repr(size))
        count = int(np.prod(dims, dtype=np.int64))
        z, rows = self._z.reshape(-1, self.dim), np.swapaxes(self._M, -1, -2).reshape(-1, self.dim, self.dim)
        out = np.empty((len(z), count, self.dim))
        for i in range(len(z)):
            sample(z[i], np.ascontiguousarray(rows[i]), generator, out[i])
        return out.reshape(*self.shape, *dims, self.dim)

    def entropy(self) -> Any:
        """Return −E[log f(x)] = log F − Σ zᵢ ωᵢ (...), in nats relative to surface area."""
        return self.log_normalizer - np.sum(self._z * self.axis_moments, axis=-1)

    def cross_entropy(self, other: Bingham) -> Any:
        """Return −E[log g(x)], x ~ self, g = other: log F_g − tr(A_g S_f) (...)."""
        self._check_same_dimension(other)
        # tr(A_g S_f) axis by axis: every term has one sign, so narrow distributions lose no digits.
        square = np.einsum("...ki,...kj->...ij", self._M, other._M) ** 2
        return other.log_normalizer - np.einsum("...i,...ij,...j->...", self.axis_moments, square, other._z)

    def kl_divergence(self, other: Bingham) -> Any:
        """Return KL(self ‖ other) = tr((A_f − A_g) S_f) + log F_g − log F_f (...), in nats, not negative."""
        return np.maximum(self.cross_entropy(other) - self.entropy(), 0.0)

    # Algebra

    def multiply(self, other: Bingham) -> Bingham:
        """Return the distribution with density ∝ f(x) g(x): the matrices add (Kurz et al. 2014, Lemma 1)."""
        self._check_same_dimension(other)
        return Bingham.from_matrix(self.matrix + other.matrix)

    def compose(self, other: Bingham) -> Bingham:
        """Return the Bingham with the second moment of x ⊕ y, x ~ self, y ~ other, independent; d = 2 or 4.

        S' = Σ_m ω_m R_m S R_mᵀ with R_m the right-multiplication matrix of the m-th axis of `other` (Glover &
        Kaelbling 2013, A.9.2). The distribution of x ⊕ y itself is not Bingham: see `composed_logpdf`.

        Examples
        --------
        >>> import numpy as np
        >>> p = Bingham([-800.0, -800.0, -800.0, 0.0], np.eye(4)[:, ::-1])
        >>> p.compose(p).z.round(3)
        array([-400.753, -400.753, -400.753,    0.   ])
        """
        self._check_group()
        self._check_same_dimension(other)
        return Bingham.from_spectrum(
            *compose_spectra(self._z, self._M, noise_parts(other._z, other._M, other.axis_moments))
        )

    def composed_logpdf(self, other: Bingham, x: ArrayLike | Rotation) -> Any:
        """Return the log-density of the true distribution of a ⊕ b at x (..., d), a ~ self, b ~ other; d = 2 or 4.

        f(x) = ∫ f_a(x ⊕ b*) f_b(b) db = F(C(x)) / (F_a F_b) with C(x) = Qᵀ A_a Q + A_b, x ⊕ b* = Q b
        (Glover & Kaelbling 2013, eq. 15).
        """
        self._check_group()
        self._check_same_dimension(other)
        a = unit_rows(x, self.dim, "x")
        # x ⊕ b* = L(x) D b with D the conjugation.
        q = compose(a[..., None, :], conjugate(np.eye(self.dim)))
        joint = np.einsum("...ia,...ab,...jb->...ij", q, self.matrix, q) + other.matrix
        values = np.linalg.eigvalsh(joint)
        return log_normalizer(values) - self.log_normalizer - other.log_normalizer

    def inverse(self) -> Bingham:
        """Return the distribution of x* (conjugate), x ~ self; d = 2 or 4."""
        self._check_group()
        frame = np.array(self._M)
        frame[..., 1:, :] *= -1.0
        return Bingham.from_spectrum(np.array(self._z), frame, self._log_f, self._w)

    def rotate(self, *, left: ArrayLike | Rotation | None = None, right: ArrayLike | Rotation | None = None) -> Bingham:
        """Return the distribution of left ⊕ x ⊕ right, x ~ self, for fixed unit left and right (..., d); d = 2 or 4."""
        self._check_group()
        axes = np.swapaxes(self._M, -1, -2)
        if left is not None:
            axes = compose(unit_rows(left, self.dim, "left")[..., None, :], axes)
        if right is not None:
            axes = compose(axes, unit_rows(right, self.dim, "right")[..., None, :])
        frame = np.ascontiguousarray(np.swapaxes(axes, -1, -2))
        z = np.array(np.broadcast_to(self._z, frame.shape[:-1]))
        return Bingham.from_spectrum(z, frame, self._log_f, self._w if frame.shape == self._M.shape else None)

    # Uncertainty out

    def standard_errors(self, n: float) -> StandardErrors:
        """Return the asymptotic standard errors of a fit to n independent samples (Kish's n for weighted ones).

        Fisher information: n ∂²log F/∂z² for the concentrations and 2n (zᵢ − zⱼ)(ωᵢ − ωⱼ) for the angle between
        axes i and j.
        """
        return StandardErrors(*standard_errors(self._z, n))

    def credible_angle(self, p: ArrayLike) -> Any:
        """Return the angle α in [0, π/2] with P(angle(x, ±mode) ≤ α) = p, in rad.

        It is the angle on the sphere, arccos |xᵀ mode|; `credible_rotation_angle` gives that of a rotation (d = 4).
        p (...) in [0, 1] broadcasts against the batch.
        """
        return credible_angle(self._z, p)

    def credible_rotation_angle(self, p: ArrayLike) -> Any:
        """Return the rotation angle α in [0, π] with P(angle of the rotation from the mode to x ≤ α) = p, rad; d = 4.

        The angle of mode* ⊗ x, 2 arccos |xᵀ mode|: twice `credible_angle`. p (...) in [0, 1] broadcasts.

        Examples
        --------
        >>> import numpy as np
        >>> p = Bingham.from_covariance([1.0, 0, 0, 0], np.radians(2.0) ** 2 * np.eye(3), frame="body")
        >>> float(np.degrees(p.credible_rotation_angle(0.95)).round(2))
        5.59
        """
        if self.dim != 4:
            raise InvalidArgumentError("distribution", "one of rotations, d = 4", f"d = {self.dim}")
        return 2.0 * credible_angle(self._z, p)

    @frame_required
    def covariance(
        self, *, frame: Literal["body", "world"], undefined: Literal["raise", "nan"] = "raise"
    ) -> FloatArray:
        """Return the 3×3 covariance (..., 3, 3), rad², of the rotation vector about the mode; d = 4.

        C = 4 E[v vᵀ] with v the vector part of mode* ⊗ q (frame="body") or q ⊗ mode* (frame="world"): the covariance of
        the rotation vector up to third order in the angle. `from_covariance` is its exact inverse.

        Parameters
        ----------
        frame : {"body", "world"}
            Axes in which the small rotation is expressed; there is no default.
        undefined : {"raise", "nan"}
            What to do where the mode is not twice as heavy (E[(mᵀx)²]) as every other axis, that is near girdles and
            the uniform distribution, where a covariance about one mode says nothing.
        """
        return covariance(self._M, self.axis_moments, frame, undefined)

    @classmethod
    @frame_required
    def from_covariance(
        cls, mode: ArrayLike | Rotation, covariance: ArrayLike, *, frame: Literal["body", "world"]
    ) -> Self:
        """Return the distribution about the unit quaternion mode (..., 4) with `covariance` (..., 3, 3), rad²."""
        w, axes = moment_from_covariance(unit_rows(mode, 4, "mode"), covariance, frame)
        z, log_f = solve_spectrum(w)
        return cls.from_spectrum(z, axes, log_f)

    def _check_same_dimension(self, other: Bingham) -> None:
        check_kind(other, Bingham, "other")
        if other.dim != self.dim:
            raise InvalidArgumentError("other", f"a distribution of dimension {self.dim}", other.dim)

    def _check_group(self) -> None:
        if self.dim not in (2, 4):
            raise InvalidArgumentError("distribution", "dimension 2 or 4, where unit vectors form a group", self.dim)


# What an immutable object is filled by, at two thirds of what `object.__setattr__` takes.
_put_z, _put_m, _put_log_f, _put_w = (vars(Bingham)[name].__set__ for name in ("_z", "_M", "_log_f", "_w"))


def _corrected(fitted: Bingham, n: Any) -> tuple[FloatArray, FloatArray]:
    """Return (z, M) with the concentrations that are most likely for the moments of a fit to n (...) axes."""
    from bingham.distributions.marginal import marginal_fit

    z, _ = marginal_fit(fitted.axis_moments, n, np.array(fitted.z))
    return z, np.array(fitted.M)
