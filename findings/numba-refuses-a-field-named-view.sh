#!/bin/sh
# numba refuses to compile a function that passes on the field `view` of a named tuple: it takes any attribute
# `view` for numpy's method, by its name alone. A field of another name compiles.
# Most people expect that the name of a field does not matter.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
from collections import namedtuple

import numba
import numpy as np

length = numba.njit(lambda values: len(values))
Named, Other = namedtuple("Named", "view"), namedtuple("Other", "room")
print(f"numba {numba.__version__}; field room:", numba.njit(lambda at: length(at.room))(Other(np.zeros(3))))
try:
    told = numba.njit(lambda at: length(at.view))(Named(np.zeros(3)))
except numba.core.errors.TypingError as error:
    told = str(error)
print("field view:", told)
print("expected: 3, as for the other name")
assert "'view' can only be called on NumPy dtypes" in str(told), "this has changed"
PYTHON
