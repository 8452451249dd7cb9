"""The journal of what is out of order: shared by programs, whole after a kill, hostile files."""

import multiprocessing
import signal
import sys
import time
from pathlib import Path

import pytest

import hybridnav as hn
from hybridnav.closures import Journal, OutOfOrder
from hybridnav.errors import InvalidValueError, MapError


def whats(path: Path) -> list[str]:
    return [item.what for item in Journal(path).items()]


def test_what_is_closed_stays_closed_until_it_is_opened(tmp_path: Path) -> None:
    file = tmp_path / "clinic.yaml"
    journal, other = Journal(file), Journal(tmp_path / "clinic.hnm")
    assert journal.items() == ()
    journal.close("link:north lift", why="repair")
    journal.close("2:door:7")
    assert [item.why for item in other.items()] == ["repair", ""]
    other.close("link:north lift", why="no power")
    assert [(item.what, item.why) for item in journal.items()] == [
        ("2:door:7", ""),
        ("link:north lift", "no power"),
    ]
    assert journal.closures("2").doors == (7,)
    assert not journal.closures("1").doors
    assert (other.open("2:door:7"), other.open("2:door:7")) == (True, False)
    assert whats(file) == ["link:north lift"]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["clinic.closed.yaml"]


@pytest.mark.parametrize(
    ("what", "expected"),
    [
        ("link:a: b", ("a: b", None, (), ())),
        ("door:12", (None, None, (12,), ())),
        ("room:ward: 2", (None, None, (), ("ward: 2",))),
        ("G:L:door:3", (None, "G:L", (3,), ())),
        ('1:room:"quoted" ümlaut 😀', (None, "1", (), ('"quoted" ümlaut 😀',))),
    ],
)
def test_names_are_read_as_they_were_written(what, expected, tmp_path):
    Journal(tmp_path / "a.yaml").close(what)
    (item,) = Journal(tmp_path / "a.yaml").items()
    assert (item.link, item.floor, item.blocked.doors, item.blocked.rooms) == expected


@pytest.mark.parametrize(
    "what", ["", "lift", "door:", "door:x", "door:-1", "room:", "room:a\nb", "link:" + "x" * 300]
)
def test_what_names_nothing_is_refused(what: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError):
        Journal(tmp_path / "a.yaml").close(what)
    assert not (tmp_path / "a.closed.yaml").exists()


@pytest.mark.parametrize(
    "text",
    [
        "closed",
        "closed: 3",
        "closed: [3]",
        "closed: [{why: a}]",
        "closed: [{what: 'door:1', more: 1}]",
        "closed: [{what: lift}]",
        "closed: [{what: 'door:1', why: 3}]",
        "closed: []\nother: 1",
        "closed: &a [*a]",
        "closed: !!python/object/apply:os.system [ls]",
        "closed: [" + "{what: 'door:1'}, " * 2000 + "]",
        "{" * 500,
        "\x00",
    ],
)
def test_hostile_journals_end_in_one_line(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.closed.yaml").write_text(text)
    with pytest.raises(MapError) as caught:
        Journal(tmp_path / "a.yaml").items()
    assert "\n" not in str(caught.value)
    assert "a.closed.yaml" in str(caught.value)
    with pytest.raises(MapError):
        Journal(tmp_path / "a.yaml").close("door:1")
    assert (tmp_path / "a.closed.yaml").read_text() == text


def test_a_folder_or_an_empty_file_is_no_journal(tmp_path: Path) -> None:
    (tmp_path / "a.closed.yaml").touch()
    assert whats(tmp_path / "a.yaml") == []
    (tmp_path / "b.closed.yaml").mkdir()
    for act in (
        Journal(tmp_path / "b.yaml").items,
        lambda: Journal(tmp_path / "b.yaml").open("door:1"),
    ):
        with pytest.raises(MapError, match=r"b\.closed\.yaml"):
            act()


def test_the_longest_journal_can_be_read_and_changed(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "a.yaml")
    mark = "\U0001f600"  # the longest in the file
    rooms = [f"{number}:room:{number}".ljust(200, mark) for number in range(1000)]
    texts = [mark * 200] * 1000
    items = [OutOfOrder(what, *[text] * 3) for what, text in zip(rooms, texts, strict=True)]
    journal._write(items[1:])  # as 999 calls would
    journal.close(rooms[0], why=texts[0], by=texts[0])
    assert {item.what for item in Journal(tmp_path / "a.yaml").items()} == set(rooms)
    with pytest.raises(InvalidValueError, match="at most 1000 things"):
        journal.close("door:1")
    assert Journal(tmp_path / "a.yaml").open(rooms[1])


def test_every_character_of_a_line_survives(tmp_path: Path) -> None:
    every = "".join(filter(str.isprintable, map(chr, range(sys.maxunicode + 1))))
    texts = [mark * 200 for mark in 'x"\\\u0301']
    texts += [every[at : at + 200] for at in range(0, len(every), 200)]
    journal = Journal(tmp_path / "a.yaml")
    for first in range(0, len(texts), 3000):
        parts = [[*texts[at : at + 3], "", "", ""] for at in range(first, first + 3000, 3)]
        items = [OutOfOrder(f"door:{n}", *part[:3]) for n, part in enumerate(parts)]
        journal._write(items)
        assert Journal(tmp_path / "a.yaml").items() == tuple(items)


def test_who_changes_a_journal_does_not_read_it_again(tmp_path, monkeypatch):
    reads: list[int] = []
    entries = Journal._entries

    def counted(self: Journal) -> tuple[OutOfOrder, ...]:
        reads.append(1)
        return entries(self)

    monkeypatch.setattr(Journal, "_entries", counted)
    journal = Journal(tmp_path / "a.yaml")
    for number in range(200):
        journal.close(f"door:{number}", why="x" * 200)
    assert len(journal.items()) == 200
    assert not reads
    Journal(tmp_path / "a.yaml").open("door:3")
    assert len(journal.items()) == 199
    assert len(reads) == 2


def _change(file: Path, number: int) -> None:
    journal = Journal(file)
    for turn in range(10):
        journal.close(f"{number}:door:{turn + 1}", why=str(number))
        journal.close("link:shared", why=f"{number} {turn}")
        if turn % 2:
            journal.open(f"{number}:door:{turn}")


def test_programs_that_write_at_once_lose_nothing(tmp_path: Path) -> None:
    file = tmp_path / "clinic.yaml"
    context = multiprocessing.get_context("fork")
    workers = [context.Process(target=_change, args=(file, number)) for number in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
        assert worker.exitcode == 0
    expected = {f"{number}:door:{turn}" for number in range(4) for turn in range(2, 11, 2)}
    assert set(whats(file)) == expected | {"link:shared"}


def _write_on(file: Path) -> None:
    for number in range(1, 100_000):
        Journal(file).close(f"door:{number % 50 + 1}", why="x" * 150)


def test_a_kill_leaves_a_whole_journal_and_no_lock(tmp_path: Path) -> None:
    file = tmp_path / "clinic.yaml"
    Journal(file).close("link:lift", why="before")
    for turn in range(5):
        writer = multiprocessing.get_context("fork").Process(target=_write_on, args=(file,))
        writer.start()
        while len(whats(file)) < 4:
            assert writer.is_alive()
        time.sleep(0.02 + 0.03 * turn)
        writer.kill()
        writer.join()
        assert writer.exitcode == -signal.SIGKILL
        assert "link:lift" in whats(file)
        Journal(file).close("room:ward", why=str(turn))
    assert "room:ward" in whats(file)


def test_a_journal_closes_for_every_plan_of_a_building(tmp_path: Path) -> None:
    from tests.houses import write_house

    file = write_house(tmp_path)
    building = hn.ext.fleet.load_building(file, robot_radius_m=0)
    ends = ("1", (1.5, 0.6)), ("2", (0.5, 0.5))
    assert [ride.link.name for ride in building.plan(*ends).rides] == ["ladder"]
    journal = Journal(file)
    journal.close("link:ladder")
    assert [ride.link.name for ride in building.plan(*ends).rides] == ["lift"]
    assert [ride.link.name for ride in building.plan(*ends, profile="staff").rides] == ["lift"]
    journal.close("2:room:room-1")
    assert building.plan(*ends).status is hn.PlanStatus.GOAL_BLOCKED
    journal.open("2:room:room-1")
    journal.close("2:door:99")
    with pytest.raises(MapError, match="closed 2:door:99: no door has the number 99"):
        building.plan(*ends)
    journal.open("2:door:99")
    journal.open("link:ladder")
    assert [ride.link.name for ride in building.plan(*ends).rides] == ["ladder"]


def test_a_thing_knows_whether_it_is_on_a_map() -> None:
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(grid := hn.example_map("figure1"), rooms=hn.find_rooms(grid))
    )
    with pytest.raises(InvalidValueError, match="link:lift is of a building, and this is one map"):
        OutOfOrder("link:lift").check_on(topology)
    with pytest.raises(InvalidValueError, match="no room is called 'wrad'"):
        OutOfOrder("room:wrad").check_on(topology)
    OutOfOrder("room:room-1").check_on(topology)
