"""Replacements for scikit-learn's functions if it is not installed."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
import numpy.typing as npt


class Estimator:
    """Base class with get_params, set_params and the score of a regressor."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns the parameters of the constructor."""
        names = list(inspect.signature(type(self)).parameters)
        return {name: getattr(self, name) for name in names}

    def set_params(self, **params: Any) -> Any:
        """Sets parameters and returns the estimator.

        Raises:
            ValueError: if a parameter does not exist.
        """
        known = self.get_params()
        for name, value in params.items():
            if name not in known:
                raise ValueError(f"parameter {name!r}: allowed are {', '.join(known)}")
            setattr(self, name, value)
        return self

    def score(self, X: npt.ArrayLike, y: npt.ArrayLike) -> float:
        """Returns R² = 1 - (residual sum of squares) / (total sum of squares)."""
        heights = np.asarray(y, dtype=float)
        residual = np.sum((heights - self.predict(X)) ** 2)  # type: ignore[attr-defined]
        return float(1.0 - residual / np.sum((heights - heights.mean()) ** 2))


def check_is_fitted(estimator: Any, attribute: str) -> None:
    """Raises ValueError if the estimator is not fitted."""
    if not hasattr(estimator, attribute):
        raise ValueError(f"this {type(estimator).__name__} is not fitted yet: call fit first")


def validate_data(estimator: Any, X: npt.ArrayLike, y: Any = None, **how: Any) -> Any:
    """Returns X, or X and y, as arrays of consistent shapes.

    Raises:
        ValueError: if shapes do not match, or a value is not finite.
    """
    places = np.asarray(X, dtype=float)
    if places.ndim != 2 or places.size == 0:
        raise ValueError(f"X has shape {places.shape}; allowed is (n, d)")
    if not np.isfinite(places).all():
        raise ValueError("X holds NaN or infinity")
    if y is None:
        if places.shape[1] != estimator.n_features_in_:
            raise ValueError(f"X has {places.shape[1]} features, fitted were {estimator.n_features_in_}")
        return places
    heights = np.asarray(y, dtype=float)
    if heights.shape != (len(places),) or not np.isfinite(heights).all():
        raise ValueError(f"y has shape {heights.shape}; allowed is ({len(places)},), finite")
    estimator.n_features_in_ = places.shape[1]
    return places, heights
