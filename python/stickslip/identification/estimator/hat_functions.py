"""Curves of linear pieces as sums of hat functions, whose weights are the values at the nodes."""

from __future__ import annotations

import numpy as np

from stickslip.files.arrays import Array


def hats_at(x: Array, nodes: Array) -> Array:
    """The hat function of each node at each x, shape (x, nodes); outside the nodes that of the nearest is 1.

    >>> hats_at(np.array([0.0, 0.25, 3.0]), np.array([0.0, 1.0]))
    array([[1.  , 0.  ],
           [0.75, 0.25],
           [0.  , 1.  ]])
    """
    return np.stack([np.interp(x, nodes, unit) for unit in np.eye(len(nodes))], axis=1)
