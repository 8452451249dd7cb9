"""Fetch the public maps of the study into a folder, by checksum, and state their licences.

Reads benchmarks/public_maps.tsv. A file that is there with its checksum is left alone; what arrives
with another checksum is not kept. Exits with 1 where a file could not be had: `make study` says
which maps are missing, and goes on without them. The four raw maps of SLAM are not in the list,
since nobody publishes them as maps: they are made of laser logs.
"""

import csv
import hashlib
import http.client
import sys
import urllib.request
from argparse import Namespace
from pathlib import Path

from benchmarks.common import ROOT
from benchmarks.options import option
from hybridnav._base.files import replace_file

LIST = ROOT / "benchmarks" / "public_maps.tsv"
HOST = "https://raw.githubusercontent.com"
PATIENCE_S = 30
OPTIONS = [
    option("folder", type=Path, help="where the maps go, for HYBRIDNAV_DATA"),
    option("--host", default=HOST, help="serves REPOSITORY/COMMIT/PATH"),
    option("--list", action="store_true", help="print files, sources and licences alone"),
]


def listed() -> list[dict[str, str]]:
    """Return the files with source, licence and SHA-256, a dictionary each."""
    with LIST.open(encoding="utf-8", newline="") as text:
        return list(csv.DictReader(text, delimiter="\t"))


def has(path: Path, digest: str) -> bool:
    """Return whether a file is there with a checksum."""
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == digest


def fetched(entry: dict[str, str], folder: Path, host: str) -> str:
    """Fetch a file unless it is there; return what went wrong, empty for nothing."""
    path = folder / entry["file"]
    if has(path, entry["sha256"]):
        return ""
    address = f"{host}/{entry['repository']}/{entry['commit']}/{entry['path']}"
    try:
        with urllib.request.urlopen(address, timeout=PATIENCE_S) as answer:  # noqa: S310 - https
            content: bytes = answer.read()
    except (http.client.HTTPException, OSError) as error:  # cut off, or never begun
        return str(getattr(error, "reason", error))
    if hashlib.sha256(content).hexdigest() != entry["sha256"]:
        return "it has another checksum"
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, content)
    return ""


def main(given: Namespace) -> int:
    """Fetch what is missing, and print licences by repository."""
    entries, n_lost = listed(), 0
    for entry in entries if not given.list else ():
        wrong = fetched(entry, given.folder, given.host)
        n_lost += bool(wrong)
        if wrong:
            sys.stderr.write(f"{entry['file']}: {wrong}\n")
    licences = {(entry["repository"], entry["licence"]) for entry in entries}
    for repository, licence in sorted(licences):
        files = [e["file"] for e in entries if e["repository"] == repository]
        print(f"{repository}: {len(files)} files, {licence}")
    if not given.list:
        print(f"{len(entries) - n_lost} of {len(entries)} files are in {given.folder}")
    return int(n_lost > 0)
