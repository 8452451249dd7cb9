#!/bin/sh
# numba counts references to an array that a called kernel only reads, by atomic steps, if its while loop ends by
# `break`; with `return` in that place, which answers the same, it counts none. The calls take about three times as long.
# Most people expect that reading an array counts nothing, and that the two words cost the same.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 llvmlite==0.50.0 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
import time

import llvmlite
import numba
import numpy as np


@numba.njit
def by_break(parent, node):
    while parent[node] != node:
        node = parent[node]
        if node == 7:
            break
    return node


@numba.njit
def by_return(parent, node):
    while parent[node] != node:
        node = parent[node]
        if node == 7:
            return node
    return node


def sum_of(root):
    @numba.njit
    def total(parent):
        found = 0
        for node in range(parent.size):
            found += root(parent, node)
        return found

    return total


def seconds(total):
    start = time.process_time()
    total(parent)
    return time.process_time() - start


rng = np.random.default_rng(0)
parent = np.arange(100_000)
parent[1:] -= rng.random(parent.size - 1) < 0.5
both = sum_of(by_break), sum_of(by_return)
assert both[0](parent) == both[1](parent)
counts = []
for total in both:
    (code,) = total.inspect_llvm().values()
    counts.append(code.count("call void @NRT_incref"))
ratio = np.median([seconds(both[0]) / seconds(both[1]) for _ in range(50)])
print(f"numba {numba.__version__}, llvmlite {llvmlite.__version__}; 100,000 calls that follow parents in one array")
print(f"places that count a reference up: {counts[0]} with break, {counts[1]} with return")
print(f"CPU time with break over that with return, median: {ratio:.1f}")
print("expected: 0 and 0, and a ratio of 1")
assert counts[0] > 0 == counts[1] and ratio > 1.3, "this has changed"
PYTHON
