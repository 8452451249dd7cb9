"""Integer costs of the two kinds of move; see `_kernels` for why these."""

STRAIGHT = 80782
DIAGONAL = 114243
