from .factors import MOST_FACTOR as MOST_FACTOR, UNIT_BITS as UNIT_BITS
from .files import (
    filter_costs as filter_costs,
    load_keepout_mask as load_keepout_mask,
    load_speed_mask as load_speed_mask,
)
from .integral import cost_along as cost_along
from .layer import CostLayer as CostLayer

__all__: list[str]
