from .bags import BagLog as BagLog, load_bag_map as load_bag_map, save_bag as save_bag
from .scan_log import CarmenLog as CarmenLog

__all__: list[str]
