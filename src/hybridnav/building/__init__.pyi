from .building import Building as Building
from .floors import Floor as Floor
from .links import Link as Link, LinkEnd as LinkEnd, LinkKind as LinkKind
from .plan import BuildingPlan as BuildingPlan, Ride as Ride

__all__: list[str]
