"""A stand-in for ROS 2: the documented calls of rclpy and tf2_ros that are in use.

Messages check the type and the range of what is assigned to their fields, as those of rosidl do.
Definitions are those of Nav2 (Kilted) and common_interfaces.
"""

import copy
import sys
import types
from collections.abc import Callable
from typing import Any, ClassVar

import pytest

_INTEGERS = {"int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1), "uint16": (0, 2**16 - 1)}
_LARGEST_FLOAT32 = 3.402823466e38

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec, uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp, string frame_id",
    "geometry_msgs/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/Quaternion": "float64 x, float64 y, float64 z, float64 w=1.0",
    "geometry_msgs/Pose": "geometry_msgs/Point position, geometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseStamped": "std_msgs/Header header, geometry_msgs/Pose pose",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header, string child_frame_id, geometry_msgs/Transform transform"
    ),
    "nav_msgs/Path": "std_msgs/Header header, geometry_msgs/PoseStamped[] poses",
    "nav2_msgs/RouteNode": "uint16 nodeid, geometry_msgs/Point position",
    "nav2_msgs/RouteEdge": "uint16 edgeid, geometry_msgs/Point start, geometry_msgs/Point end",
    "nav2_msgs/Route": (
        "std_msgs/Header header, float32 route_cost, nav2_msgs/RouteNode[] nodes, "
        "nav2_msgs/RouteEdge[] edges"
    ),
    "ComputePathToPose_Goal": (
        "geometry_msgs/PoseStamped goal, geometry_msgs/PoseStamped start, string planner_id, "
        "bool use_start"
    ),
    "ComputePathToPose_Result": (
        "nav_msgs/Path path, builtin_interfaces/Duration planning_time, uint16 error_code, "
        "string error_msg"
    ),
    "ComputeRoute_Goal": (
        "uint16 start_id, geometry_msgs/PoseStamped start, uint16 goal_id, "
        "geometry_msgs/PoseStamped goal, bool use_start, bool use_poses"
    ),
    "ComputeRoute_Result": (
        "builtin_interfaces/Duration planning_time, nav_msgs/Path path, nav2_msgs/Route route, "
        "uint16 error_code, string error_msg"
    ),
}
_PATH_CODES = (
    "UNKNOWN INVALID_PLANNER TF_ERROR START_OUTSIDE_MAP GOAL_OUTSIDE_MAP START_OCCUPIED "
    "GOAL_OCCUPIED TIMEOUT NO_VALID_PATH"
)
_ROUTE_CODES = "UNKNOWN TF_ERROR NO_VALID_GRAPH INDETERMINANT_NODES_ON_GRAPH TIMEOUT NO_VALID_ROUTE"


class Message:
    """A message with checked fields; made by `message`."""

    fields: dict[str, str]

    def __init__(self) -> None:
        for name, kind in self.fields.items():
            given = kind.partition("=")[2]
            setattr(self, name, float(given) if given else _default(kind))

    def get_fields_and_field_types(self) -> dict[str, str]:
        """The types of the fields, sequences as rosidl writes them."""
        return {
            name: f"sequence<{kind[:-2]}>" if kind.endswith("[]") else kind.partition("=")[0]
            for name, kind in self.fields.items()
        }

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self.fields:
            raise AttributeError(name)
        kind = self.fields[name].partition("=")[0]
        assert _fits(kind, value), f"{type(self).__name__}.{name} is {kind}, got {value!r:.80}"
        object.__setattr__(self, name, value)


_CLASSES: dict[str, type[Message]] = {}


def message(name: str) -> type[Message]:
    if name not in _CLASSES:
        fields = {}
        for field in DEFINITIONS[name].split(", "):
            kind, own = field.split(" ")
            own, equals, given = own.partition("=")
            fields[own] = kind + equals + given
        _CLASSES[name] = type(name.rpartition("/")[2], (Message,), {"fields": fields})
    return _CLASSES[name]


def _default(kind: str) -> Any:
    if kind.endswith("[]"):
        return []
    plain = {"string": "", "bool": False, "float64": 0.0, "float32": 0.0}
    if kind in _INTEGERS:
        return 0
    return plain[kind] if kind in plain else message(kind)()


def _fits(kind: str, value: Any) -> bool:
    if kind.endswith("[]"):
        return isinstance(value, list) and all(_fits(kind[:-2], each) for each in value)
    if kind in _INTEGERS:
        low, high = _INTEGERS[kind]
        return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high
    if kind == "float32":
        return isinstance(value, float) and abs(value) <= _LARGEST_FLOAT32
    plain = {"string": str, "bool": bool, "float64": float}
    return isinstance(value, plain.get(kind) or message(kind))


def set_message_fields(target: Any, values: dict[str, Any]) -> list[Any]:
    """Set the fields of a message, as rosidl_runtime_py does; a judge of `fill_message`."""
    try:
        items = copy.deepcopy(values).items()
    except AttributeError:
        raise TypeError(f"{values!r:.80} is expected to be a dictionary") from None
    for name, given in items:
        field = getattr(target, name)
        value = given
        if type(given) is not type(field):
            try:
                value = type(field)(given)
            except TypeError:
                value = type(field)()
                set_message_fields(value, given)
        kind = target.fields[name]
        if kind.endswith("[]"):
            for index, each in enumerate(value):
                part = message(kind[:-2])()
                set_message_fields(part, each)
                value[index] = part
        setattr(target, name, value)
    return []


class Time:
    """A time, or with `Duration` the difference of two."""

    def __init__(self, *, nanoseconds: int = 0) -> None:
        self.nanoseconds = nanoseconds

    def __sub__(self, other: "Time") -> "Duration":
        return Duration(nanoseconds=self.nanoseconds - other.nanoseconds)


class Duration(Time):
    """A duration."""

    def to_msg(self) -> Any:
        found: Any = message("builtin_interfaces/Duration")()
        found.sec, found.nanosec = divmod(self.nanoseconds, 10**9)
        return found


class Clock:
    """A clock that goes on by a millisecond whenever it is read."""

    def __init__(self) -> None:
        self.read_ns = 1_700_000_000 * 10**9

    def now(self) -> Time:
        self.read_ns += 10**6
        return Time(nanoseconds=self.read_ns)


class Node:
    """A node with parameters."""

    given: ClassVar[dict[str, Any]] = {}
    """What `-p NAME:=VALUE` sets."""

    def __init__(self, node_name: str) -> None:
        assert node_name.isidentifier()
        self.actions: dict[str, ActionServer] = {}
        self._clock = Clock()

    def declare_parameter(self, name: str, value: Any = None) -> Any:
        """Declare a parameter; its type is that of the default."""
        given = self.given.get(name, value)
        assert type(given) is type(value)
        return types.SimpleNamespace(name=name, value=given)

    def get_clock(self) -> Clock:
        return self._clock


class GoalHandle:
    """The handle of a goal, which must end in one state."""

    def __init__(self, request: Any) -> None:
        self.request = request
        self.status = "executing"

    def succeed(self) -> None:
        self._end("succeeded")

    def abort(self) -> None:
        self._end("aborted")

    def _end(self, status: str) -> None:
        if self.status != "executing":
            raise RuntimeError("goal is in a terminal state")
        self.status = status


class ActionServer:
    """An action server; `call` is what a client would see."""

    def __init__(
        self, node: Node, action_type: Any, action_name: str, execute_callback: Callable[..., Any]
    ) -> None:
        self._type, self._execute = action_type, execute_callback
        node.actions[action_name] = self

    def call(self, goal: Any) -> tuple[str, Any]:
        """Execute a goal; return status and result as rclpy would send them."""
        assert isinstance(goal, self._type.Goal)
        handle = GoalHandle(goal)
        result = self._execute(handle)
        assert handle.status != "executing", "goal state not set"
        assert isinstance(result, self._type.Result)
        return handle.status, result


class TransformException(Exception):  # noqa: N818 - the name in tf2
    """The base of errors of tf2."""


class Buffer:
    """Transforms that a test sets."""

    known: ClassVar[dict[tuple[str, str], Any]] = {}

    def lookup_transform(self, target_frame: str, source_frame: str, time: Time) -> Any:
        assert isinstance(time, Time)
        found = self.known.get((target_frame, source_frame))
        if found is None:
            raise TransformException(f'"{source_frame}" passed to lookupTransform does not exist')
        return found


class TransformListener:
    """What fills a buffer."""

    def __init__(self, buffer: Buffer, node: Node) -> None:
        assert isinstance(buffer, Buffer)
        assert isinstance(node, Node)


def _action(name: str, codes: str, first: int) -> Any:
    goal, result = message(f"{name}_Goal"), message(f"{name}_Result")
    for number, code in enumerate(codes.split(), first):
        setattr(result, code, number)
    result.NONE = 0  # type: ignore[attr-defined]
    return type(name, (), {"Goal": goal, "Result": result})


def install(patch: pytest.MonkeyPatch) -> Any:
    """Put the stand-in where ROS would be imported from; return its actions by name."""
    actions = types.SimpleNamespace(
        ComputePathToPose=_action("ComputePathToPose", _PATH_CODES, 200),
        ComputeRoute=_action("ComputeRoute", _ROUTE_CODES, 400),
    )
    contents: dict[str, dict[str, Any]] = {
        "rclpy": {},
        "rclpy.action": {"ActionServer": ActionServer},
        "rclpy.node": {"Node": Node},
        "rclpy.time": {"Time": Time},
        "nav2_msgs": {},
        "nav2_msgs.action": vars(actions),
        "geometry_msgs": {},
        "geometry_msgs.msg": {"PoseStamped": message("geometry_msgs/PoseStamped")},
        "nav2_msgs.msg": {
            "RouteNode": message("nav2_msgs/RouteNode"),
            "RouteEdge": message("nav2_msgs/RouteEdge"),
        },
        "tf2_ros": {
            "Buffer": Buffer,
            "TransformException": TransformException,
            "TransformListener": TransformListener,
        },
    }
    for name, content in contents.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        patch.setitem(sys.modules, name, module)
    return actions
