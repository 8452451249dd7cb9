from .checks import MOST_FACTOR as MOST_FACTOR, UNIT_BITS as UNIT_BITS
from .filters import filter_costs as filter_costs
from .integral import cost_along as cost_along
from .layer import CostLayer as CostLayer

__all__: list[str]
