"""Files are written whole or not at all."""

from collections.abc import Callable
from pathlib import Path

import pytest

from hybridnav._base import files as _files
from hybridnav._base.files import remove_unfinished, replace_file


@pytest.mark.parametrize("fails_in", ["write_bytes", "replace"])
def test_a_file_that_cannot_be_written_whole_stays_as_it_was(fails_in, tmp_path, monkeypatch):
    file = tmp_path / "rooms.yaml"
    replace_file(file, b"old")

    def half(path: Path, *_: object) -> None:
        with path.open("wb") as stream:
            stream.write(b"ne")
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Path, fails_in, half)
        with pytest.raises(KeyboardInterrupt):
            replace_file(file, b"new")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"rooms.yaml": b"old"}
    replace_file(file, b"new")
    assert file.read_bytes() == b"new"


def test_what_is_half_written_when_the_process_ends_is_removed(tmp_path, monkeypatch):
    write: Callable[..., int] = Path.write_bytes

    def write_and_end(path: Path, content: bytes) -> int:
        size = write(path, content[:2])
        remove_unfinished()
        return size

    monkeypatch.setattr(Path, "write_bytes", write_and_end)
    with pytest.raises(FileNotFoundError):
        replace_file(tmp_path / "rooms.yaml", b"new")
    assert not list(tmp_path.iterdir())
    assert not _files._unfinished


def test_a_file_may_have_the_longest_name_of_any_letters(tmp_path: Path) -> None:
    file = tmp_path / ("房" * 83 + ".yaml")
    replace_file(file, b"rooms")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {file.name: b"rooms"}
