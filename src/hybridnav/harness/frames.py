"""A study as a pandas data frame, for figures of one's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    import pandas as pd

    from hybridnav.harness.analysis import Study
    from hybridnav.harness.outcome import Outcome


def to_frame(study: Study) -> pd.DataFrame:
    """Return a study as a table with a row for each map, method and pair.

    Parameters
    ----------
    study
        The study. Pairs are those of different cells that the method answered and the reference
        solved.

    Returns
    -------
    pandas.DataFrame
        Columns `map`, `method`, `metric`, `kind`, `start_row`, `start_col`, `goal_row` and
        `goal_col`; `length_m`, NaN where the method found no path without a fault itself;
        `octile_optimum_m` and `any_angle_optimum_m`; `loss` over the reference that the study
        uses, `octile_loss` and `any_angle_loss`, as shares; `seconds` of the query and
        `reference_seconds` of A* on the whole grid; `expanded` cells,
        border cells, intervals and nodes together. In a run with costs
        also `costs`, their text; `cost_m`, `weighted_optimum_m`, `cost_lower_bound_m` and, for
        any-angle paths with a bound on paths of cells, `cost_grid_bound_m`; `weighted_loss`, `gap`
        and `grid_gap`, as shares.

    Raises
    ------
    InvalidValueError
        When pandas is not installed.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import load_study, to_frame
    >>> frame = to_frame(load_study(Path("run")))  # of the example of `evaluate`
    >>> frame.groupby("method")["octile_loss"].max().to_dict()
    {'grid-astar': 0.0, 'octile': 0.0}
    """
    try:
        import pandas as pd  # noqa: PLC0415 - an optional extra
    except ImportError as error:
        raise InvalidValueError(
            "a data frame needs pandas: pip install 'hybridnav[study]'"
        ) from error
    parts = [pd.DataFrame(_columns(outcome)) for outcome in study.outcomes if outcome.references]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _columns(outcome: Outcome) -> dict[str, object]:
    pairs = outcome.references
    return {
        "map": outcome.map_name,
        "method": outcome.label,
        "metric": outcome.metric,
        "kind": [record["kind"] for record in pairs],
        "start_row": [record["start"][0] for record in pairs],
        "start_col": [record["start"][1] for record in pairs],
        "goal_row": [record["goal"][0] for record in pairs],
        "goal_col": [record["goal"][1] for record in pairs],
        "length_m": outcome.lengths_m,
        "octile_optimum_m": outcome.optima_m,
        "any_angle_optimum_m": outcome.any_angle_optima_m,
        "loss": outcome.losses,
        "octile_loss": outcome.octile_losses,
        "any_angle_loss": outcome.any_angle_losses,
        "seconds": outcome.seconds,
        "reference_seconds": outcome.reference_seconds,
        "expanded": outcome.expansions,
        **(_of_costs(outcome) if outcome.costs else {}),
    }


def _of_costs(outcome: Outcome) -> dict[str, object]:
    return {
        "costs": outcome.costs,
        "cost_m": outcome.costs_m,
        "weighted_optimum_m": outcome.weighted_optima_m,
        "cost_lower_bound_m": outcome.figure("cost_lower_bound_m"),
        "cost_grid_bound_m": outcome.figure("cost_grid_bound_m"),
        "weighted_loss": outcome.weighted_losses,
        "gap": outcome.gaps,
        "grid_gap": outcome.grid_gaps,
    }
