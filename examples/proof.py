"""A proof beside a path: a script that knows nothing of hybridnav accepts it, and no forged one."""

import json
from pathlib import Path

import hybridnav as hn
from hybridnav.check_proof import Rejected, check
from hybridnav.viz import plot_plan, save_figure

grid = hn.example_map("office", robot_radius_m=0.25)
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
result = hn.HybridPlanner(topology).plan((1.0, 13.2), (40.6, 19.4))
proof = hn.prove(result)
Path("out/proof.json").write_text(json.dumps(proof), encoding="utf-8")
print(f"{len(json.dumps(proof)) / 1000:.0f} kB for a path of {result.cost:.2f} m")

frame = [grid.resolution_m, *grid.frame.origin_m, grid.frame.yaw_rad]
for bound in (proof["bound"], proof["bound"] + 0.01):
    try:
        print(f"bound {bound:.3f}:", check(grid.measured, frame, {**proof, "bound": bound}))
    except Rejected as error:
        print(f"bound {bound:.3f}: rejected, {error}")
save_figure(plot_plan(topology, result), "out/proof.png")
