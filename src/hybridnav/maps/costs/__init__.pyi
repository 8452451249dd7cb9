from .checks import MOST_FACTOR as MOST_FACTOR, UNIT_BITS as UNIT_BITS
from .files import load_keepout_mask as load_keepout_mask, load_speed_mask as load_speed_mask
from .filters import filter_costs as filter_costs
from .integral import cost_along as cost_along
from .layer import CostLayer as CostLayer

__all__: list[str]
