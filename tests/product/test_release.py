"""What is published: its facts agree, its placeholders are refused, its maps come by checksum."""

import functools
import hashlib
import http.server
import json
import re
import shutil
import threading
from pathlib import Path

import pytest
import yaml

from benchmarks.__main__ import main
from benchmarks.subjects._study_maps import lost_of, maps_of
from hybridnav.errors import InvalidValueError
from tools import fetch, release

ROOT = Path(__file__).parents[2]
FILES = ("pyproject.toml", "CITATION.cff", "codemeta.json", "CHANGELOG.md", "paper/paper.md")
FILLED = {
    "pyproject.toml": (r"https://([\w.]*)hybridnav\.example", r"https://\1hybridnav.org"),
    "CITATION.cff": (r"The hybridnav \w+", "Ada Lovelace"),
    "paper/paper.md": (r"The hybridnav \w+", "Ada Lovelace"),
}


@pytest.fixture
def copied(tmp_path):
    """Return a folder with what a release states of itself, as it is here."""
    for name in (*FILES, "src/hybridnav/_version.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def filled(root):
    """Fill the placeholders, as whoever publishes it does."""
    for name, (old, new) in FILLED.items():
        text = (root / name).read_text(encoding="utf-8")
        (root / name).write_text(re.sub(old, new, text), encoding="utf-8")
    assert main(["release", "--write", "--root", str(root)]) == 0


def test_only_placeholders_keep_it_from_being_released(capsys):
    assert main(["release"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 7
    assert all("placeholder" in line for line in lines)


def test_what_is_filled_can_be_released(copied, capsys):
    filled(copied)
    assert main(["release", "--root", str(copied)]) == 0
    assert capsys.readouterr().out == "ready to be released\n"
    meta = json.loads((copied / "codemeta.json").read_text(encoding="utf-8"))
    assert meta["author"] == [{"@type": "Organization", "name": "Ada Lovelace"}]
    assert meta["codeRepository"] == "https://code.hybridnav.org"
    citation = yaml.safe_load((copied / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["repository-code"] == meta["codeRepository"]


@pytest.mark.parametrize(
    ("name", "old", "new", "fault"),
    [
        ("CHANGELOG.md", r"## \[0\.2\.0\] - .*", "## [0.2.0] - soon", "has no date"),
        ("CHANGELOG.md", r"## \[0\.2\.0\]", "## [0.3.0]", "newest version"),
        ("pyproject.toml", r'version = "0\.2\.0"', 'version = "0.9.9"', "the version is not"),
        ("pyproject.toml", r"https://docs\.hybridnav", "https://pages.hybridnav", "codemeta.json"),
        ("CITATION.cff", r"version: 0\.2\.0", "version: 0.1.0", "CITATION.cff: is not"),
    ],
)
def test_facts_that_disagree_are_told(copied, name, old, new, fault):
    filled(copied)
    text = (copied / name).read_text(encoding="utf-8")
    (copied / name).write_text(re.sub(old, new, text, count=1), encoding="utf-8")
    assert any(fault in line for line in release.faults(copied))


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves files and says nothing."""

    cut = False

    def log_message(self, *_):
        """Say nothing."""

    def copyfile(self, source, outputfile):
        """Send a file, or hang up in the middle of it."""
        outputfile.write(source.read()[: 5 if self.cut else None])


@pytest.fixture
def host(tmp_path, monkeypatch):
    """Serve one map of the list from this machine; the list has that one and one that is lost."""
    lines = fetch.LIST.read_text(encoding="utf-8").splitlines()
    here, lost = fetch.listed()[:2]
    served = tmp_path / "served" / here["repository"] / here["commit"] / here["path"]
    served.parent.mkdir(parents=True)
    served.write_text("image: map.pgm\n")
    digest = "b7c47ab1d0a4e4ba6a6a4e37e7ff0a7ba3a4a1a9d9c9a77a5a9a5d9d3a6a3d0e"
    listing = tmp_path / "maps.tsv"
    listing.write_text("\n".join(lines[:3]).replace(here["sha256"], digest))
    monkeypatch.setattr(fetch, "LIST", listing)
    handler = functools.partial(Quiet, directory=tmp_path / "served")
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", served, listing, lost
    server.shutdown()
    server.server_close()


def test_a_map_is_kept_with_its_checksum_alone(host, tmp_path, capsys):
    address, served, listing, lost = host
    given = ["fetch", str(tmp_path / "maps"), "--host", address]
    assert main(given) == 1
    told = capsys.readouterr()
    assert "it has another checksum" in told.err
    assert f"{lost['file']}: " in told.err
    assert not (tmp_path / "maps").exists()
    entry = fetch.listed()[0]
    digest = hashlib.sha256(served.read_bytes()).hexdigest()
    listing.write_text(listing.read_text().replace(entry["sha256"], digest))
    assert main(given) == 1
    assert "1 of 2 files" in capsys.readouterr().out
    assert (tmp_path / "maps" / entry["file"]).read_bytes() == served.read_bytes()


def test_the_list_has_the_published_maps_of_the_study(data, capsys):
    known = {entry["file"] for entry in fetch.listed()}
    for one in maps_of(data):
        name = one.path.relative_to(data).as_posix()
        assert (name in known) == (one.kind != "SLAM")
    assert all(fetch.has(data / entry["file"], entry["sha256"]) for entry in fetch.listed())
    assert main(["fetch", str(data)]) == 0
    assert f"{len(known)} of {len(known)} files" in capsys.readouterr().out


def test_a_study_without_some_maps_says_which_and_one_without_all_is_refused(data, tmp_path):
    assert lost_of(data) == []
    with pytest.raises(InvalidValueError, match="benchmarks fetch"):
        maps_of(tmp_path)
    assert lost_of(tmp_path)[-1] == "12 maps of MovingAI with scenarios"
    (tmp_path / "nav2").symlink_to(data / "nav2")
    assert len(maps_of(tmp_path)) == 2
    assert len(lost_of(tmp_path)) == 15


def test_a_transfer_that_is_cut_and_a_host_that_is_not_there_leave_nothing(
    host, tmp_path, capsys, monkeypatch
):
    address, served, listing, lost = host
    entry = fetch.listed()[0]
    digest = hashlib.sha256(served.read_bytes()).hexdigest()
    listing.write_text(listing.read_text().replace(entry["sha256"], digest))
    maps = tmp_path / "maps"
    monkeypatch.setattr(Quiet, "cut", True)
    assert main(["fetch", str(maps), "--host", address]) == 1
    told = capsys.readouterr()
    assert f"{entry['file']}: IncompleteRead(5 bytes read" in told.err
    assert f"0 of 2 files are in {maps}" in told.out
    monkeypatch.setattr(Quiet, "cut", False)
    for nowhere in ("http://127.0.0.1:1", "http://maps.invalid"):
        assert main(["fetch", str(maps), "--host", nowhere]) == 1
        told = capsys.readouterr().err
        assert f"{entry['file']}: " in told
        assert f"{lost['file']}: " in told
    assert not maps.exists()
    assert main(["fetch", str(maps), "--host", address]) == 1  # it goes on
    assert (maps / entry["file"]).read_bytes() == served.read_bytes()
    assert main(["fetch", str(maps), "--host", "http://127.0.0.1:1"]) == 1  # and keeps what it has
    assert "1 of 2 files" in capsys.readouterr().out
