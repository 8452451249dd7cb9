from .replay import ReplayFigures as ReplayFigures
from .plot import ReplayAnimation as ReplayAnimation
from .pyramid import OnlinePyramid as OnlinePyramid, Update as Update
from .replay import ReplayStep as ReplayStep, grids_of_scans as grids_of_scans, replay as replay
from .room_versions import OnlineRooms as OnlineRooms, RoomsUpdate as RoomsUpdate
from .rooms_window import DoorEvents as DoorEvents, OnlineDoor as OnlineDoor
from .identities import (
    CarriedCosts as CarriedCosts,
    Flips as Flips,
    NO_PLACE as NO_PLACE,
    carry_costs as carry_costs,
)
from .files import (
    BagLog as BagLog,
    CarmenLog as CarmenLog,
    load_bag_map as load_bag_map,
    save_bag as save_bag,
)

__all__: list[str]
