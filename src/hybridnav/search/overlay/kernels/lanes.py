"""Steps of a search from LANES sources at a time, one vector instruction for all of them.

A row holds the distances of one cell or node from each source, `distance[LANES * i : LANES * (i +
1)]`. LLVM does not prove that two rows are distinct, so it would not turn loops over lanes into
vectors by itself: the two steps are written as vector instructions.
"""

import numba
import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

LANES = 16
"""Sources that are searched from at the same time: int32 in 512 bits."""
FAR = np.int32((1 << 30) - 1)
"""Stored distance of what is not reached; the sum of two still fits into int32."""
STEP_BITS = 3
"""Bits of a direction."""
NO_PATH = 1 << 60
"""Distance of what is not reached in sums of 64 bits."""

_BITS = ir.IntType(32)
_PLACE = ir.IntType(64)
_ROW = ir.VectorType(_BITS, LANES)
_FIRST = ir.Constant(ir.VectorType(_BITS, LANES), [0] * LANES)


def _data(context, builder, array, value):
    return context.make_array(array)(context, builder, value).data


def _row_at(builder, distance, row):
    start = builder.mul(row, ir.Constant(_PLACE, LANES))
    return builder.bitcast(builder.gep(distance, [start]), _ROW.as_pointer())


def _load_row(builder, distance, row):
    loaded = builder.load(_row_at(builder, distance, row))
    loaded.align = 4
    return loaded


def _least_by(builder, least, distance, row, cost):
    """Emit min(least, distance[row] + cost)."""
    nothing = ir.Constant(_ROW, ir.Undefined)
    one = builder.insert_element(nothing, cost, ir.Constant(_BITS, 0))
    all_lanes = builder.shuffle_vector(one, nothing, _FIRST)
    offered = builder.add(_load_row(builder, distance, row), all_lanes)
    return builder.select(builder.icmp_signed("<", offered, least), offered, least)


def _store_row(builder, distance, row, before, after):
    """Emit the store of a row; return int32, a bit for each lane that changed."""
    stored = builder.store(after, _row_at(builder, distance, row))
    stored.align = 4
    is_less = builder.icmp_signed("<", after, before)
    return builder.zext(builder.bitcast(is_less, ir.IntType(LANES)), _BITS)


@intrinsic
def _relax_row(_typing_context, distance, row, other, cost):  # noqa: ARG001 - types alone
    def build(context, builder, signature, arguments):
        values = _data(context, builder, signature.args[0], arguments[0])
        before = _load_row(builder, values, arguments[1])
        after = _least_by(builder, before, values, arguments[2], arguments[3])
        return _store_row(builder, values, arguments[1], before, after)

    return types.int32(distance, types.int64, types.int64, types.int32), build


@intrinsic
def _match_row(_typing_context, distance, row, other, cost):  # noqa: ARG001 - types alone
    def build(context, builder, signature, arguments):
        values = _data(context, builder, signature.args[0], arguments[0])
        nothing = ir.Constant(_ROW, ir.Undefined)
        one = builder.insert_element(nothing, arguments[3], ir.Constant(_BITS, 0))
        all_lanes = builder.shuffle_vector(one, nothing, _FIRST)
        offered = builder.add(_load_row(builder, values, arguments[2]), all_lanes)
        is_equal = builder.icmp_signed("==", offered, _load_row(builder, values, arguments[1]))
        return builder.zext(builder.bitcast(is_equal, ir.IntType(LANES)), _BITS)

    return types.int32(distance, types.int64, types.int64, types.int32), build


@intrinsic
def _lowest_bit(_typing_context, bits):  # noqa: ARG001 - types alone
    def build(context, builder, signature, arguments):  # noqa: ARG001 - types alone
        place = builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))
        return builder.zext(place, _PLACE)

    return types.int64(types.uint32), build


@intrinsic
def _relax_cell(_typing_context, distance, near, cost, row):  # noqa: ARG001 - types alone
    def build(context, builder, signature, arguments):
        values, others, costs = (
            _data(context, builder, signature.args[k], arguments[k]) for k in range(3)
        )
        before = after = _load_row(builder, values, arguments[3])
        first = builder.mul(arguments[3], ir.Constant(_PLACE, 8))
        for k in range(8):
            at = [builder.add(first, ir.Constant(_PLACE, k))]
            other = builder.zext(builder.load(builder.gep(others, at)), _PLACE)
            move_cost = builder.load(builder.gep(costs, at))
            after = _least_by(builder, after, values, other, move_cost)
        return _store_row(builder, values, arguments[3], before, after)

    return types.int32(distance, near, cost, types.int64), build


@intrinsic
def _keep_steps(_typing_context, distance, near, cost, row, steps, at):  # noqa: ARG001
    """Emit the comparison of each lane with its 8 neighbours, and the store of three bit planes."""

    def build(context, builder, signature, arguments):
        values, others, costs = (
            _data(context, builder, signature.args[k], arguments[k]) for k in range(3)
        )
        own = _load_row(builder, values, arguments[3])
        first = builder.mul(arguments[3], ir.Constant(_PLACE, 8))
        mask = ir.IntType(LANES)
        planes = [ir.Constant(mask, 0)] * STEP_BITS
        for k in range(7, -1, -1):
            place = [builder.add(first, ir.Constant(_PLACE, k))]
            other = builder.zext(builder.load(builder.gep(others, place)), _PLACE)
            move_cost = builder.load(builder.gep(costs, place))
            nothing = ir.Constant(_ROW, ir.Undefined)
            one = builder.insert_element(nothing, move_cost, ir.Constant(_BITS, 0))
            all_lanes = builder.shuffle_vector(one, nothing, _FIRST)
            offered = builder.add(_load_row(builder, values, other), all_lanes)
            is_step = builder.bitcast(builder.icmp_signed("==", offered, own), mask)
            for bit in range(STEP_BITS):
                if k >> bit & 1:
                    planes[bit] = builder.or_(planes[bit], is_step)
                else:
                    planes[bit] = builder.and_(planes[bit], builder.not_(is_step))
        kept = _data(context, builder, signature.args[4], arguments[4])
        for bit in range(STEP_BITS):
            place = [builder.add(arguments[5], ir.Constant(_PLACE, bit))]
            builder.store(planes[bit], builder.gep(kept, place))
        return ir.Constant(_BITS, 0)

    return types.int32(distance, near, cost, types.int64, steps, types.int64), build


def _relax_row_plainly(distance, row, other, cost):
    own = distance[LANES * row : LANES * (row + 1)]
    before = own.copy()
    np.minimum(own, distance[LANES * other : LANES * (other + 1)] + cost, out=own)
    return int((own < before).any())


def _match_row_plainly(distance, row, other, cost):
    own = distance[LANES * row : LANES * (row + 1)]
    is_equal = distance[LANES * other : LANES * (other + 1)] + cost == own
    return int((is_equal << np.arange(LANES)).sum())


def _lowest_bit_plainly(bits):
    return (int(bits) & -int(bits)).bit_length() - 1


def _relax_cell_plainly(distance, near, cost, row):
    return max(
        _relax_row_plainly(distance, row, int(near[8 * row + k]), cost[8 * row + k])
        for k in range(8)
    )


def _keep_steps_plainly(distance, near, cost, row, steps, at):
    own = distance[LANES * row : LANES * (row + 1)]
    direction = np.zeros(LANES, np.int64)
    for k in range(7, -1, -1):
        other = int(near[8 * row + k])
        offered = distance[LANES * other : LANES * (other + 1)] + cost[8 * row + k]
        direction[offered == own] = k
    for bit in range(STEP_BITS):
        steps[at + bit] = ((direction >> bit & 1) << np.arange(LANES)).sum()
    return 0


is_compiled = not numba.config.DISABLE_JIT  # type: ignore[attr-defined]
relax_row = _relax_row if is_compiled else _relax_row_plainly
"""Lower row `row` to row `other` plus a cost, in each lane.

Parameters: distance int32 (rows * LANES,), row, other int64, cost int32. Return int32, not 0 if a
lane changed.
"""
match_row = _match_row if is_compiled else _match_row_plainly
"""Compare row `row` with row `other` plus a cost.

Parameters: as of `relax_row`. Return int32, a bit for each lane where both are equal.
"""
lowest_bit = _lowest_bit if is_compiled else _lowest_bit_plainly
"""Return the place of the lowest bit of a uint32 that is not 0."""
relax_cell = _relax_cell if is_compiled else _relax_cell_plainly
"""Lower row `row` to the rows of its 8 neighbours plus the costs of the moves, in each lane.

Parameters: distance int32 (rows * LANES,), near uint32 (rows * 8,), cost int32 (rows * 8,), row
int64. Return int32, not 0 if a lane changed.
"""
keep_steps = _keep_steps if is_compiled else _keep_steps_plainly
"""Store the direction of the move from row `row` on a shortest path to the source of each lane.

Bit `k` of the direction of lane `i` is bit `i` of `steps[at + k]`. It is a move of the field only
where the source is reached and not the row's own cell. Parameters: distance int32 (rows * LANES,),
near uint32 (rows * 8,), cost int32 (rows * 8,), row int64, steps uint16 (n,), at int64. Return 0.
"""
