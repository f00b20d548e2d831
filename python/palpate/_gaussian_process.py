"""Gaussian-process regression with the interface of scikit-learn, which is optional."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _palpate

if TYPE_CHECKING:

    class _Base:
        def get_params(self, deep: bool = True) -> dict[str, Any]: ...
        def set_params(self, **params: Any) -> GaussianProcess: ...
        def score(self, X: npt.ArrayLike, y: npt.ArrayLike) -> float: ...

else:
    try:
        from sklearn.base import BaseEstimator, RegressorMixin

        class _Base(RegressorMixin, BaseEstimator):
            """Base class for scikit-learn."""

    except ImportError:
        from ._estimator import Estimator as _Base

__all__ = ["GaussianProcess"]

_Array = npt.NDArray[np.float64]


class GaussianProcess(_Base):
    """Exact Gaussian-process regression with maximum-likelihood hyperparameters within ranges.

    A fit scans the whole range of hyperparameters (for more than three inputs at 125 points of a Sobol sequence)
    and optimises from the local maxima. It needs no restarts and is deterministic.

    Args:
        kernel: "squared_exponential", "matern_52" or "matern_32", with a length scale per input.
        mean: "zero", "data" (the average of y), or "constant" (fitted).
        length_scale: range (low, high) of each length scale, as a fraction of that input's span.
        noise: range of the noise's standard deviation, as a fraction of the signal's.
        signal: range of the signal's standard deviation, as a fraction of the root mean square of y.

    Attributes:
        length_scales_: length scales, shape (d,), in the units of X.
        signal_sd_, noise_sd_, mean_: hyperparameters in the unit of y.
        log_marginal_likelihood_value_: log marginal likelihood of the fit.
        n_features_in_: number of inputs d.
    """

    def __init__(
        self,
        kernel: str = "squared_exponential",
        mean: str = "constant",
        length_scale: tuple[float, float] = (0.005, 10.0),
        noise: tuple[float, float] = (1e-4, 10.0),
        signal: tuple[float, float] = (1e-3, 1e3),
    ) -> None:
        self.kernel = kernel
        self.mean = mean
        self.length_scale = length_scale
        self.noise = noise
        self.signal = signal

    def fit(self, X: npt.ArrayLike, y: npt.ArrayLike) -> GaussianProcess:
        """Fits the process of maximum likelihood to observations y (n,) at places X (n, d).

        Raises:
            ValueError: if a shape or range is invalid, or a value is not finite.
        """
        if y is None:
            raise ValueError("fit requires y to be passed, but the target y is None")
        places, heights = self._checked(X, y)
        for name in ("length_scale", "noise", "signal"):
            low, high = getattr(self, name)
            if not 0 < low <= high < np.inf:
                raise ValueError(f"{name} = {(low, high)}: allowed is 0 < low <= high")
        spans = np.ptp(places, axis=0)
        spans[spans == 0] = 1.0
        scale = float(np.sqrt(np.mean(heights**2))) or 1.0
        low, high = self.length_scale
        self._fitted = _palpate.Fitted(
            places,
            heights,
            self.kernel,
            self.mean,
            [(low * span, high * span) for span in spans],
            self.noise,
            (self.signal[0] * scale, self.signal[1] * scale),
        )
        self.length_scales_ = np.array(self._fitted.length_scales)
        self.signal_sd_ = self._fitted.signal_sd
        self.noise_sd_ = self._fitted.noise_sd
        self.mean_ = self._fitted.mean_height
        self.log_marginal_likelihood_value_ = self._fitted.log_likelihood
        return self

    def predict(
        self, X: npt.ArrayLike, return_std: bool = False
    ) -> _Array | tuple[_Array, _Array]:
        """Returns the mean (n,) at places X (n, d); with `return_std` also the standard deviation without noise."""
        places = self._checked(X)[0]
        if not return_std:
            return self._fitted.mean(places)
        means, variances = self._fitted.predict(places)
        return means, np.sqrt(np.maximum(variances, 0.0))

    def _checked(self, X: npt.ArrayLike, y: npt.ArrayLike | None = None) -> tuple[_Array, _Array]:
        fits = y is not None
        try:
            from sklearn.utils.validation import check_is_fitted, validate_data
        except ImportError:
            from ._estimator import check_is_fitted, validate_data
        if not fits:
            check_is_fitted(self, "_fitted")
            places = validate_data(self, X, dtype=np.float64, reset=False)
            return np.ascontiguousarray(places), np.empty(0)
        places, heights = validate_data(self, X, y, dtype=np.float64, y_numeric=True)
        return np.ascontiguousarray(places), np.ascontiguousarray(heights, dtype=np.float64)
