"""Simple worlds of simulators, in SDF: upright boxes, cylinders and spheres as shapes on the floor.
Public: `ShapeWorld`.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np
import shapely
from numpy.typing import NDArray

from hybridnav._base.files import printable
from hybridnav._base.trig import cos, sin
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav._base.xml_reader import MOST_BYTES, XmlReader
from hybridnav._base.yaml_file import read_text
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError, brief

Pose = tuple[float, float, float, float]
"""x, y, z in metres and the yaw in radians."""


_UPRIGHT_RAD = 1e-6
"""Most roll and pitch of a shape that counts as upright: simulators save some of rounding."""
_BARE = ("model://sun", "model://ground_plane")
"""Includes of Gazebo that hold no obstacle."""
_FLAT = {"plane", "empty"}
"""Geometries that stand in nobody's way."""


class ShapeWorld(NamedTuple):
    """The obstacles of a simulator's world, seen from above.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("empty.world").write_text("<sdf version='1.6'><world name='w'/></sdf>")
    >>> hn.load_shapes("empty.world").names
    ()
    """

    shapes: NDArray[np.object_]
    """shapely points, of what is round, and polygons, object (n,), metres."""
    radii_m: FloatArray
    """Metres by which each is wider, float64 (n,): add the radius of the robot."""
    names: tuple[str, ...]
    """`model::link::collision` of each."""


def load_shapes(path: PathLike, *, heights_m: tuple[float, float] = (0.0, math.inf)) -> ShapeWorld:
    """Read the collision shapes of a simulator's world, one file in SDF of any version.

    Upright boxes, cylinders, capsules and spheres are read, at the poses of the file, also those of
    models that are not static. Planes, visuals, lights and actors are no obstacles.

    Parameters
    ----------
    path
        The file: `sdf` with one `world`, or with models.
    heights_m
        Lowest and highest point of the robot above the floor z = 0, in metres: a shape that ends
        below the one, or begins above the other, is left out.

    Returns
    -------
    ShapeWorld
        `shapes, radii_m, names`, as `grids_of_shapes` takes them.

    Raises
    ------
    MapNotFoundError
        When the file is not there.
    MapError
        When it is no such file. When it holds an include, a mesh, a tilted shape, or a pose in
        another frame than its parent's: what cannot be read exactly.
    InvalidValueError
        When the heights are not two numbers, the lowest first.

    Examples
    --------
    >>> from pathlib import Path
    >>> text = (
    ...     "<sdf version='1.6'><world name='w'><model name='post'><pose>2 1 0.5 0 0 0</pose>"
    ...     "<link name='link'><collision name='c'><geometry><cylinder><radius>0.1</radius>"
    ...     "<length>1</length></cylinder></geometry></collision></link></model></world></sdf>"
    ... )
    >>> _ = Path("posts.world").write_text(text)
    >>> world = hn.load_shapes("posts.world")
    >>> str(world.shapes[0]), world.radii_m
    ('POINT (2 1)', array([0.1]))
    """
    try:
        low, high = map(float, heights_m)
    except (TypeError, ValueError):
        low = high = math.nan
    if not low <= high:
        raise InvalidValueError(
            f"heights_m are {brief(heights_m)}, expected the robot's lowest and highest point in "
            "metres: leave them out for all shapes above the floor"
        )
    where = f"world {printable(path)}"
    errors = {"error": MapError, "missing": MapNotFoundError}
    text = read_text(path, what="world", max_bytes=MOST_BYTES, kind="SDF", **errors)
    reader = _Reader(where)
    reader.parse(text, expat.ParserCreate("utf-8"))
    collisions = [
        shape for shape in _World(where, reader.root).shapes() if shape[3] > low and shape[2] < high
    ]
    shapes = np.empty(len(collisions), object)
    shapes[:] = [shape for shape, *_ in collisions]
    radii = np.array([radius for _, radius, *_ in collisions])
    return ShapeWorld(shapes, radii, tuple(name for *_, name in collisions))


class _Reader(XmlReader):
    deepest, kind = 40, "SDF"

    def __init__(self, where: str) -> None:
        super().__init__(where)
        self._builder = TreeBuilder()

    def start(self, tag: str, given: dict[str, str]) -> None:
        if self._depth == 1 and tag != "sdf":
            raise MapError(
                f"{self._where}: expected SDF, whose first element is sdf, got {tag!r:.40}"
            )
        self._builder.start(tag, given)

    def end(self, tag: str) -> None:
        self._builder.end(tag)

    def parse(self, text: str, parser: expat.XMLParserType) -> None:
        parser.CharacterDataHandler = self._builder.data
        super().parse(text, parser)

    @property
    def root(self) -> Element:
        return self._builder.close()


Shape = tuple[shapely.Geometry, float, float, float, str]
"""A shape with its radius, lowest and highest point, and name."""


class _World(NamedTuple):
    """The elements of a file."""

    where: str
    root: Element

    def shapes(self) -> Iterator[Shape]:
        """Find all collision shapes."""
        worlds = self.root.findall("world")
        if len(worlds) > 1:
            raise MapError(f"{self.where}: {len(worlds)} worlds, expected one: split the file")
        home = worlds[0] if worlds else self.root
        moved = {state.get("name"): state for state in home.findall("state/model")}
        for model in home.findall("model"):
            name = model.get("name", "model")
            state = moved.get(name)
            if state is not None and self._pose(state, name) != self._pose(model, name):
                raise MapError(
                    f"{self.where}: {name:.60} has one pose of its own and another in state, which "
                    "simulators read differently: delete the state"
                )
            yield from self._of_model(model, (0.0, 0.0, 0.0, 0.0), name)
        self._check_bare(home)

    def _check_bare(self, home: Element) -> None:
        for tag in ("include", "population", "road"):
            for element in home.findall(tag):
                uri = (element.findtext("uri") or "").strip()
                if uri not in _BARE:
                    what = f"{tag} {uri}".strip()
                    raise MapError(
                        f"{self.where}: holds {what!r:.80}, expected models in the file itself: "
                        "write them into it"
                    )

    def _of_model(self, model: Element, frame: Pose, name: str) -> Iterator[Shape]:
        self._check_bare(model)
        if model.get("placement_frame"):
            raise MapError(f"{self.where}: {name:.80} has a placement_frame: state its own pose")
        pose = _joined(frame, self._pose(model, name))
        for inner in model.findall("model"):
            yield from self._of_model(inner, pose, f"{name}::{inner.get('name')}")
        for link in model.findall("link"):
            of_link = _joined(pose, self._pose(link, name))
            for collision in link.findall("collision"):
                own = f"{name}::{link.get('name')}::{collision.get('name')}"
                geometry = next(iter(collision.findall("geometry/*")), Element("empty"))
                if geometry.tag not in _FLAT:
                    at = _joined(of_link, self._pose(collision, own))
                    yield self._shape(geometry, at, own)

    def _shape(self, geometry: Element, pose: Pose, name: str) -> Shape:
        """Return a shape, its radius, its lowest and highest point, and its name."""
        x, y, z, yaw = pose
        if geometry.tag == "box":
            size = self._numbers(geometry, "size", name, 3)
            corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / 2 * size[:2]
            turn = np.array([[cos(yaw), sin(yaw)], [-sin(yaw), cos(yaw)]])
            box = shapely.Polygon(corners @ turn + (x, y))
            return box, 0.0, z - size[2] / 2, z + size[2] / 2, name
        if geometry.tag not in {"cylinder", "sphere", "capsule"}:
            raise MapError(
                f"{self.where}: {name:.80} is a {geometry.tag!r:.40}, expected box, cylinder, "
                "capsule or sphere: replace it by one that holds it"
            )
        (radius,) = self._numbers(geometry, "radius", name, 1)
        half = 0.0 if geometry.tag == "cylinder" else radius
        if geometry.tag != "sphere":
            half += self._numbers(geometry, "length", name, 1)[0] / 2
        return shapely.Point(x, y), radius, z - half, z + half, name

    def _numbers(self, element: Element, tag: str, name: str, count: int) -> list[float]:
        text = element.findtext(tag) or ""
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = []
        if len(numbers) != count or not all(0 < number < math.inf for number in numbers):
            raise MapError(
                f"{self.where}: {name:.80} has the {tag} {text.strip()!r:.60}, expected "
                f"{count} metres above 0"
            )
        return numbers

    def _pose(self, element: Element, name: str) -> Pose:
        """Return the pose of an element in its parent: it must stand upright."""
        pose = element.find("pose")
        text = "" if pose is None else (pose.text or "").strip()
        given = {} if pose is None else pose.attrib
        if pose is not None and (given.get("relative_to") or given.get("frame")):
            frame = given.get("relative_to") or given.get("frame")
            raise MapError(
                f"{self.where}: {name:.80} has a pose relative to {frame!r:.40}, expected one in "
                "its parent: write it so"
            )
        if given.get("rotation_format", "euler_rpy") != "euler_rpy":
            raise MapError(f"{self.where}: {name:.80} has a quaternion, expected euler_rpy")
        try:
            x, y, z, roll, pitch, yaw = map(float, text.split()) if text else (0.0,) * 6
        except ValueError:
            x = y = z = roll = pitch = yaw = math.nan
        unit = math.radians(1) if given.get("degrees", "").strip() in {"1", "true"} else 1.0
        if not all(map(math.isfinite, (x, y, z, roll, pitch, yaw))):
            raise MapError(
                f"{self.where}: {name:.80} has the pose {text!r:.80}, expected six numbers: x, y, "
                "z, roll, pitch, yaw"
            )
        if max(abs(roll), abs(pitch)) * unit > _UPRIGHT_RAD:
            raise MapError(
                f"{self.where}: {name:.80} is tilted (roll {roll:g}, pitch {pitch:g}), expected "
                "upright shapes: replace it by one that holds it"
            )
        return x, y, z, yaw * unit


def _joined(outer: Pose, inner: Pose) -> Pose:
    """Return a pose that is given in another one."""
    x, y, z, yaw = inner
    turned = cos(outer[3]) * x - sin(outer[3]) * y, sin(outer[3]) * x + cos(outer[3]) * y
    return outer[0] + turned[0], outer[1] + turned[1], outer[2] + z, outer[3] + yaw
