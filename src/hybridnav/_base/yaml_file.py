"""YAML from files that nobody vouches for: small, flat, without anchors, tags or duplicate keys."""

from __future__ import annotations

import stat
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import yaml
from yaml.composer import ComposerError
from yaml.constructor import ConstructorError
from yaml.nodes import MappingNode, Node

from hybridnav._base.files import printable
from hybridnav.errors import HybridNavError, brief

if TYPE_CHECKING:
    from hybridnav._base.typing import PathLike


@dataclass(frozen=True)
class Limits:
    """How much of a file is read at most."""

    max_bytes: int = 2**20
    max_values: int = 10_000
    """PyYAML reads about 30,000 values a second, so that a hostile file costs a third of one."""
    aliases: bool = False
    """Whether anchors and aliases are allowed. An alias counts as all the values that it stands
    for, and as deep; none may stand for what contains it."""


_SETTINGS = Limits()
_MAX_DEPTH = 32
_MAX_CHARACTERS = 2048
"""Per value. Python refuses to print integers of more than 4300 digits; this stays below."""
_MAX_PROBLEM = 200
"""Characters of PyYAML's own explanation, which may quote the file at any length."""


def read_yaml(
    path: PathLike,
    *,
    what: str,
    error: type[HybridNavError],
    missing: type[HybridNavError] | None = None,
    limits: Limits = _SETTINGS,
) -> dict[str, Any]:
    """Read a YAML mapping from a file that may be damaged or hostile.

    `path`: the file: UTF-8, at most 1 MiB, one document, at most 10,000 values nested at most 32
    deep; anchors, aliases, tags and duplicate keys are refused; `what`: what the file is to its
    reader, as messages begin with it: "map", "preset"; `error`: class of the error for an
    unreadable file; `missing`: what to raise when there is no such file; `error` by default;
    `limits`: how large the file may be, where it is more than settings. Returns the mapping, as
    PyYAML's safe loader understands it. Raises `HybridNavError`: of the type `error` or `missing`;
    one line that names the file and, where known, the line.
    """
    return read_marked(path, what=what, error=error, missing=missing, limits=limits).values


@dataclass(frozen=True)
class Marked:
    """A YAML mapping with its text, and where in it each value stands."""

    values: dict[str, Any]
    text: str
    root: Node

    def node(self, *keys: str | int) -> Node:
        """Return the node of a value, by the keys and indices that lead to it."""
        node: Any = self.root
        for key in keys:
            if isinstance(key, int):
                node = node.value[key]
            else:
                node = next(value for name, value in node.value if name.value == key)
        return node

    def line(self, *keys: str | int) -> int:
        """Return the line of a value, from 1."""
        return int(self.node(*keys).start_mark.line) + 1


def read_marked(
    path: PathLike,
    *,
    what: str,
    error: type[HybridNavError],
    missing: type[HybridNavError] | None = None,
    limits: Limits = _SETTINGS,
) -> Marked:
    """Read a YAML mapping as `read_yaml` does, with the places of its values.

    `path`, `what`, `error`, `missing`, `limits`: see `read_yaml`. Raises `HybridNavError`: of the
    type `error` or `missing`, as by `read_yaml`.
    """
    text = read_text(
        path, what=what, error=error, missing=missing, max_bytes=limits.max_bytes, kind="YAML"
    )
    return marked_of(text, f"{what} {printable(path)}", error, limits)


def marked_of(text: str, where: str, error: type[HybridNavError], limits: Limits) -> Marked:
    """Return the YAML mapping of a text; see `read_marked`, and `parse_document`."""
    data, root = _constructed(text, where, error, limits)
    if not isinstance(data, dict):
        given = "nothing" if data is None else brief(data)
        raise error(f"{where}: expected a mapping of keys to values, got {given}")
    for key in data:
        if not isinstance(key, str):
            raise error(f"{where}: every key must be text, got {brief(key)}")
    return Marked(data, text, root)


def parse_document(text: str, where: str, error: type[HybridNavError], limits: Limits) -> Any:
    """Return the value of a YAML document of any form, which may be damaged or hostile.

    `where`: what messages begin with; `error`: class of the error for an unreadable text; `limits`:
    how much is read. Raises `HybridNavError`: of the type `error`, one line.
    """
    return _constructed(text, where, error, limits)[0]


def read_text(  # noqa: PLR0913 - keywords, most of them passed on
    path: PathLike,
    *,
    what: str,
    error: type[HybridNavError],
    missing: type[HybridNavError] | None = None,
    max_bytes: int,
    kind: str,
) -> str:
    """Read a file of UTF-8 text.

    `path`, `what`, `error`, `missing`: see `read_yaml`; `max_bytes`: most bytes that are read;
    `kind`: name of the format in messages. Raises `HybridNavError`: of the type `error` or
    `missing`, one line.
    """
    where = f"{what} {printable(path)}"
    with open_file(path, what=what, error=error, missing=missing or error) as stream:
        content = stream.read(max_bytes + 1)
    if len(content) > max_bytes:
        raise error(f"{where}: {kind} of more than {max_bytes} bytes is not read")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = content.count(b"\n", 0, failure.start) + 1
        raise error(f"{where}, line {line}: not UTF-8 text") from None


def open_file(
    path: PathLike, *, what: str, error: type[HybridNavError], missing: type[HybridNavError]
) -> BinaryIO:
    """Open a regular file for reading bytes.

    `path`: the file. Directories, and devices and pipes that could block or never end, are refused.
    `what`: what the file is to its reader, as messages begin with it; `error`, `missing`: what to
    raise when the file cannot be opened, and when it is not there. Returns the open file; the
    caller closes it. Raises `HybridNavError`: of the type `error` or `missing`; one line that names
    the file.
    """
    where = f"{what} {printable(path)}"
    try:
        mode = Path(path).stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        raise missing(f"{where}: no such file") from None
    except (OSError, ValueError) as failure:  # ValueError: a NUL character in the path
        raise error(f"{where}: {getattr(failure, 'strerror', None) or failure}") from None
    if not stat.S_ISREG(mode):
        kind = "a directory" if stat.S_ISDIR(mode) else "not a regular file"
        raise error(f"{where}: expected a file, this is {kind}")
    try:
        return Path(path).open("rb")
    except OSError as failure:
        raise error(f"{where}: {failure.strerror}") from None


def parse_value(text: str) -> Any:
    """Return the value of a text of YAML that the user typed; numbers as in files.

    `text`: one document. Raises `yaml.YAMLError, ValueError, RecursionError` when it is none.
    """
    loader = _PlainLoader(text)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


class _PlainLoader(yaml.SafeLoader):
    """Safe loader to which 12:30:45 is a text, as it is to ROS; to PyYAML it is 45,045."""

    def construct_number(self, node: Any) -> Any:
        if ":" in str(node.value):
            return node.value
        whole = node.tag == "tag:yaml.org,2002:int"
        construct = self.construct_yaml_int if whole else self.construct_yaml_float
        return construct(node)


for _tag in ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float"):
    _PlainLoader.add_constructor(_tag, _PlainLoader.construct_number)


class _LimitedLoader(_PlainLoader):
    """Safe loader that refuses, while composing, what a file of settings has no use for.

    The pure Python loader on purpose: libyaml's composes in C, where these limits cannot reach.
    """

    _depth = 0
    _deepest = 0
    _values = 0

    def __init__(self, text: str, limits: Limits) -> None:
        super().__init__(text)
        self._limits = limits
        self._open: set[str] = set()
        self._size_of: dict[str, tuple[int, int]] = {}

    def compose_node(self, parent: Node | None, index: int) -> Node | None:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        values, height = 1, 0
        if isinstance(event, yaml.AliasEvent):
            values, height = self._size_of.get(str(event.anchor), (1, 0))
        self._values += values
        problem = self._problem(event, height)
        if problem is not None:
            raise ComposerError(None, None, problem, event.start_mark)
        before, deepest = self._values, self._deepest
        self._deepest = self._depth + height
        is_anchor = event.anchor is not None and not isinstance(event, yaml.AliasEvent)
        if is_anchor:
            self._open.add(event.anchor)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        if is_anchor:
            self._open.discard(event.anchor)
            size = self._values - before + 1, self._deepest - self._depth
            self._size_of[event.anchor] = size
        self._deepest = max(self._deepest, deepest)
        return node

    def _problem(self, event: Any, height: int) -> str | None:
        name = brief(event.anchor)
        if event.anchor is not None and not self._limits.aliases:
            return f"anchors and aliases are not supported, got {name}"
        problem = None
        if isinstance(event, yaml.AliasEvent):
            if event.anchor in self._open:
                problem = f"alias {name} stands for what contains it"
        elif event.tag is not None:
            problem = f"tags are not supported, got {brief(event.tag)}"
        elif isinstance(event, yaml.ScalarEvent) and len(event.value) > _MAX_CHARACTERS:
            problem = f"a value has more than {_MAX_CHARACTERS} characters"
        if self._depth + height >= _MAX_DEPTH:
            problem = f"nested more than {_MAX_DEPTH} deep"
        elif self._values > self._limits.max_values:
            problem = f"more than {self._limits.max_values} values"
        return problem

    def compose_mapping_node(self, anchor: Any) -> MappingNode:
        node = super().compose_mapping_node(anchor)
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                continue
            if (key.tag, key.value) in seen:
                problem = f"key {brief(key.value)} is given twice"
                raise ComposerError(None, None, problem, key.start_mark)
            seen.add((key.tag, key.value))
        return node

    def construct_object(self, node: Node, deep: bool = False) -> Any:  # noqa: FBT001, FBT002
        try:
            return super().construct_object(node, deep=deep)
        except (ValueError, OverflowError) as failure:  # 2024-13-01, or 0x_
            raise ConstructorError(None, None, str(failure), node.start_mark) from None


def _constructed(
    text: str, where: str, error: type[HybridNavError], limits: Limits
) -> tuple[Any, Any]:
    """Return the value of a document and its node; nothing and None for an empty one."""
    try:
        loader: Any = _LimitedLoader(text, limits)
        try:
            root = loader.get_single_node()
            return None if root is None else loader.construct_document(root), root
        finally:
            loader.dispose()
    except yaml.YAMLError as failure:
        raise error(f"{where}{_explain(failure, text)}") from None


def _explain(failure: yaml.YAMLError, content: str) -> str:
    if isinstance(failure, yaml.MarkedYAMLError):
        mark = failure.problem_mark or failure.context_mark
        line = f", line {mark.line + 1}" if mark else ""
        parts = (failure.context, failure.problem)
        text = ", ".join(part for part in parts if part)
        return f"{line}: {text[:_MAX_PROBLEM]}"
    if isinstance(failure, yaml.reader.ReaderError):
        line = f", line {content.count(chr(10), 0, failure.position) + 1}"
        return f"{line}: not a YAML text, character number {failure.character}"
    return ": not a YAML text"
