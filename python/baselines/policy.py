"""Trained planner: touches the place with the highest score of a small network.

    palpate run toy --planner policy:Trained

The network consists of a few convolutions along the zone, with the same weights at every place. Its only information
about position is the distance to an end of the zone. It runs with numpy alone.
"""

from pathlib import Path

import numpy as np

#: Scored places along the zone.
# heuristic: fine enough for the toy's bumps.
PLACES = 81

#: Weights file written by train.py.
FILE = Path(__file__).with_name("toy.npz")


def features(mean, sd):
    """Returns the network's input, shape (..., 2, places), with heights in units of half the zone's widest side."""
    return np.stack([mean, 0.5 * np.log10(np.maximum(sd, 1e-6)) + 1.0], axis=-2).astype(np.float32)


class Trained:
    """Planner for zones with one coordinate."""

    def __init__(self, zone):
        self.places = zone.grid(PLACES)
        self.unit_m = 0.5 * float(np.max(zone.upper - zone.lower))
        with np.load(FILE) as saved:
            self.layers = [(saved[f"weight{i}"], saved[f"bias{i}"]) for i in range(len(saved) // 2)]

    def plan(self, belief):
        mean, variance = belief.mean(self.places), belief.variance(self.places)
        sd = np.sqrt(np.maximum(variance, 0.0))
        return self.places[np.argmax(self.scores(features(mean / self.unit_m, sd / self.unit_m)))]

    def scores(self, seen):
        """Returns the score of each place from features of shape (2, places)."""
        for i, (weight, bias) in enumerate(self.layers):
            seen = np.maximum(seen, 0.0) if i else seen
            half = weight.shape[2] // 2
            padded = np.pad(seen, ((0, 0), (half, half)))
            windows = np.lib.stride_tricks.sliding_window_view(padded, weight.shape[2], axis=1)
            seen = np.einsum("oik,ipk->op", weight, windows) + bias[:, None]
        return seen[0]
