"""A judge of paths on an overlay: scipy's Dijkstra on the integer costs of all legal moves."""

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

UNITS = 1 << 14


class WeightedJudge:
    """The least costs between cells, from the definition: length times the mean of two factors."""

    def __init__(self, free, factor):
        self.free = free
        self.factor = factor
        units = np.floor(factor * UNITS).astype(np.int64)
        self._exact = self._graph(factor / 2, np.sqrt(2.0))
        self._whole = self._graph(units, None)

    def _graph(self, weight, root):
        rows, cols = self.free.shape
        flat = np.arange(rows * cols).reshape(rows, cols)
        tails, heads, costs = [], [], []
        for row_step, col_step in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here, there = _shifted(rows, row_step), _shifted(cols, col_step)
            tail = np.ix_(here[0], there[0])
            head = np.ix_(here[1], there[1])
            sides = np.ix_(here[1], there[0]), np.ix_(here[0], there[1])
            legal = self.free[tail] & self.free[head] & self.free[sides[0]] & self.free[sides[1]]
            total = weight[tail] + weight[head]
            if row_step and col_step:
                total = total * 1482910 >> 20 if root is None else total * root
            tails.append(flat[tail][legal])
            heads.append(flat[head][legal])
            costs.append(total[legal].astype(np.float64))
        entries = np.concatenate(costs), (np.concatenate(tails), np.concatenate(heads))
        return csr_matrix(entries, shape=(flat.size, flat.size))

    def least(self, start):
        """Least costs from a cell to all, in cells: of the factors, and of their whole units."""
        flat = start[0] * self.free.shape[1] + start[1]
        exact, whole = (
            dijkstra(graph, directed=False, indices=flat).reshape(self.free.shape)
            for graph in (self._exact, self._whole)
        )
        return exact, whole / (2 * UNITS)

    def check(self, found, start, goal, *, epsilon=0.0):
        """Assert that a path is legal, costs what it states, and is as good as proved."""
        exact, whole = (costs[tuple(goal)] for costs in self.least(start))
        if np.isinf(exact):
            assert found.cells is None
            assert found.lower_bound_cells == np.inf
            return
        cells = found.cells
        np.testing.assert_array_equal(cells[[0, -1]], [start, goal])
        assert self.free[tuple(cells.T)].all()
        here, there = cells[:-1], cells[1:]
        assert (np.abs(there - here).max(axis=1, initial=1) == 1).all()
        assert self.free[here[:, 0], there[:, 1]].all()
        assert self.free[there[:, 0], here[:, 1]].all()
        factor = self.factor[tuple(cells.T)]
        cost = (np.hypot(*(there - here).T) * (factor[1:] + factor[:-1]) / 2).sum()
        np.testing.assert_allclose(found.cost_cells, cost, rtol=1e-12)
        assert found.lower_bound_cells <= min(exact, found.cost_cells) * (1 + 1e-12) + 1e-12
        assert found.cost_cells <= found.lower_bound_cells * (1 + 1e-4) * (1 + epsilon) + 1e-12
        if epsilon == 0:
            assert found.lower_bound_cells == whole


def _shifted(size, step):
    """Indices of cells along one axis, and of those a step further."""
    here = np.arange(max(-step, 0), size - max(step, 0))
    return here, here + step
