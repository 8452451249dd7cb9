"""The kernel of the forest that judges boundaries."""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.trig import exp


@njit(cache=True, nogil=True)
def probabilities(evidence, features, thresholds, leaves, base):
    """Return the probability of each row by a forest of complete trees, stored level by level."""
    inner = features.shape[1]
    found = np.empty(len(evidence))
    for k in range(len(evidence)):
        total = base
        for tree in range(len(features)):
            node = 0
            while node < inner:
                right = evidence[k, features[tree, node]] > thresholds[tree, node]
                node = 2 * node + 1 + right
            total += leaves[tree, node - inner]
        found[k] = 1 / (1 + exp(-total))
    return found
