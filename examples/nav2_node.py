"""A node of ROS 2 that answers Nav2's ComputePathToPose and ComputeRoute from a hybridnav model."""

import networkx as nx
import numpy as np
import rclpy
from nav2_msgs.action import ComputePathToPose, ComputeRoute
from rclpy.action import ActionServer
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros import Buffer, TransformException, TransformListener

import hybridnav as hn
from hybridnav.messages import fill_message, pose_of, transform_of

USUAL = {"model": "floor.hnm", "graph": "graph.geojson", "preset": "shortest", "base": "base_link"}
FAILURES = {TransformException: "TF_ERROR", nx.NetworkXException: "NO_VALID_ROUTE"}
WORDS = {"SOLVED": "NONE", "OUTSIDE": "OUTSIDE_MAP", "UNEXPLORED": "OCCUPIED", "PATH": "VALID_PATH"}
WORDS |= {"BLOCKED": "OCCUPIED", "APPROXIMATE": "NO_VALID_PATH", "NEAR_GOAL": "NO_VALID_PATH"}


class PlanningNode(Node):
    """A planner and a route graph behind two action servers; poses are in the frame map."""

    def __init__(self) -> None:
        super().__init__("hybridnav")
        given = {name: self.declare_parameter(name, USUAL[name]).value for name in USUAL}
        self.planner = hn.load(given["model"]).planner(given["preset"])
        self.graph = hn.ext.fleet.load_graph(given["graph"])  # ids are those that the file states
        self.network, self.base, self.transforms = self.graph.to_networkx(), given["base"], Buffer()
        self.listener = TransformListener(self.transforms, self)
        of = {ComputePathToPose: "compute_path_to_pose", ComputeRoute: "compute_route"}
        self.servers = [ActionServer(self, kind, of[kind], self.answer) for kind in of]

    def answer(self, handle):
        """Plan, and succeed with a path or a route, or abort with an error code."""
        goal, began, fields = handle.request, self.get_clock().now(), {}
        is_route = hasattr(goal, "use_poses")
        result = (ComputeRoute if is_route else ComputePathToPose).Result()
        try:
            code, fields = (self.route if is_route else self.path)(goal, began.nanoseconds)
        except (hn.errors.HybridNavError, *FAILURES) as failure:
            found = (FAILURES[kind] for kind in FAILURES if isinstance(failure, kind))
            code, fields = next(found, "UNKNOWN"), {"error_msg": str(failure)}
        fields["planning_time"] = (self.get_clock().now() - began).to_msg()
        fields["error_code"] = getattr(result, code, 0)  # results of older Nav2 lack some fields
        fill_message(result, {k: v for k, v in fields.items() if hasattr(result, k)})
        (handle.succeed if code == "NONE" else handle.abort)()
        return result

    def path(self, goal, now):
        plan = self.planner.plan(*self.ends(goal))
        code = WORDS.get(s := plan.status.name) or "_".join(WORDS.get(w, w) for w in s.split("_"))
        return code, {"path": plan.path.to_message(stamp_ns=now)} if plan.solved else {}

    def route(self, goal, now):
        at = map(self.node_at, self.ends(goal)) if goal.use_poses else (goal.start_id, goal.goal_id)
        ids = nx.shortest_path(self.network, *at, weight="length_m")
        nodes = map(self.graph.names.index, ids)
        return "NONE", hn.graphs.route_messages(self.graph, nodes, stamp_ns=now)

    def node_at(self, pose):  # of the eight nearest nodes the one with the shortest path, or -1
        near = np.argsort(np.hypot(*(self.graph.points - pose[:2]).T))[:8].tolist()
        away = [self.planner.plan(pose, (*self.graph.points[n], *pose[2:])).cost for n in near]
        return self.graph.names[near[np.argmin(away)]] if np.isfinite(min(away)) else -1

    def ends(self, goal):
        given = [goal.start, goal.goal] if goal.use_start else [goal.goal]
        if not {each.header.frame_id for each in given} <= {"", "map"}:
            raise TransformException("poses must be in the frame map")
        poses = [pose_of(each, "pose", "goal") for each in given]
        if not goal.use_start:
            found = self.transforms.lookup_transform("map", self.base, Time())
            poses.insert(0, transform_of(found, "transform", "robot"))
        return poses  # with yaw: Nav2 takes the last pose of a path as the goal


if __name__ == "__main__":  # python nav2_node.py --ros-args -p model:=floor.hnm -p preset:=robot
    rclpy.init()
    rclpy.spin(PlanningNode())
