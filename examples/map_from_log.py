"""A map from a log: a laser drives through the office, and its scans become an occupancy grid."""

import numpy as np

import hybridnav as hn
from hybridnav.ext.live.mapping import Mapper, SimulatedLaser
from hybridnav.viz import plot_map, save_figure

office = hn.example_map("office", robot_radius_m=0.25)
planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(office)), preset="robot")
path = planner.plan((1.0, 13.2), (40.6, 19.4)).path

laser, mapper, noise = SimulatedLaser(noise_m=0.02), Mapper(), np.random.default_rng(0)
for pose in path.poses(0.25):  # `hn.ext.live.CarmenLog(file)` yields the scans of a real log
    mapper.add(laser.scan(office, tuple(pose), seed=noise))
grid = mapper.to_grid(robot_radius_m=0.25)
hn.write_ros_map(grid, "out/from_log.yaml")
print(mapper.n_scans, "scans:", grid.class_counts())
save_figure(plot_map(grid), "out/map_from_log.png")
