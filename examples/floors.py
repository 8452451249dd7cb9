"""A building: a route over two floors without stairs, and the next best one."""

from pathlib import Path

from hybridnav.ext.fleet import load_building, plot_building
from hybridnav.viz import save_figure

file = Path(__file__).parents[1] / "maps" / "building" / "building.yaml"
building = load_building(file, robot_radius_m=0.25)
plan = building.plan("hall", "library", stairs=False)
print(f"{plan.cost:.1f} m by {plan.rides[0].link.name}, gap {plan.gap:.0%}, {plan.travel_s:.0f} s")
print(*plan.words(), sep="\n")
for other in building.alternatives("hall", "library", 2, max_stretch=3.0):
    print(f"{other.cost:.1f} m by {other.rides[0].link.name}")
save_figure(plot_building(building, plan)[0], "out/floors.png")
