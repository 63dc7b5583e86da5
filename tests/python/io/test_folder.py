# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A folder of results is put in place at once; what else lies in it stays."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fastcal.errors import InvalidInput
from fastcal.io import atomic
from fastcal.io import folder as folders
from fastcal.io.atomic import PREFIX, remove_abandoned, write_text
from fastcal.io.folder import atomic_folder, check_folder


def fill(place: Path, *names: str) -> None:
    for name in names:
        (place / name).write_text("new")


def seen(place: Path) -> dict[str, str]:
    return {str(p.relative_to(place)): p.read_text() for p in sorted(place.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("exchangeable", [True, False])
def test_other_files_stay_and_older_results_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exchangeable: bool
) -> None:
    def cannot(first: Path, second: Path) -> None:
        raise OSError("not here")

    if not exchangeable:
        monkeypatch.setattr(folders, "exchange", cannot)
    out = tmp_path / "out"
    (out / "sub/deep").mkdir(parents=True)
    for name in ("model.yaml", "report.html", "mine.txt", "sub/deep/mine.csv"):
        (out / name).write_text("old")
    (out / "link").symlink_to("mine.txt")
    out.chmod(0o750)
    with atomic_folder(out, owned=("model.yaml", "report.*")) as place:
        fill(place, "report.html", "result.json")
        assert seen(out)["report.html"] == "old"
    assert seen(out) == {
        "mine.txt": "old", "link": "old", "sub/deep/mine.csv": "old", "report.html": "new", "result.json": "new",
    }  # fmt: skip
    assert (out / "link").is_symlink()
    assert out.stat().st_mode & 0o777 == 0o750
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_failure_leaves_everything_as_it_was(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "model.yaml").write_text("old")

    def write_half() -> None:
        with atomic_folder(out, owned=("model.yaml",)) as place:
            fill(place, "model.yaml")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        write_half()
    assert seen(tmp_path) == {"out/model.yaml": "old"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_result_whose_place_is_a_folder_is_refused_before_anything_changes(tmp_path: Path) -> None:
    (tmp_path / "report.html").mkdir()
    (tmp_path / "result.json").write_text("old")
    with pytest.raises(InvalidInput, match=r"report\.html is a folder"):
        check_folder(tmp_path, ("result.json", "report.html"))
    with pytest.raises(InvalidInput, match=r"report\.html is a folder"), atomic_folder(tmp_path) as place:
        fill(place, "result.json", "report.html")
    assert (tmp_path / "result.json").read_text() == "old"


def test_the_working_directory_stays_the_same_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    inode = tmp_path.stat().st_ino
    with atomic_folder(".") as place:
        fill(place, "model.yaml")
    assert Path("model.yaml").read_text() == "new"
    assert Path.cwd().stat().st_ino == inode


def test_a_link_to_a_folder_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    with atomic_folder(tmp_path / "link") as place:
        fill(place, "model.yaml")
    assert (tmp_path / "link").is_symlink()
    assert seen(tmp_path / "real") == {"model.yaml": "new"}


def test_too_many_other_files_are_left_where_they_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folders, "MOST_LINKS", 3)
    out = tmp_path / "out"
    out.mkdir()
    fill(out, *"abcde")
    inode = out.stat().st_ino
    with atomic_folder(out) as place:
        fill(place, "model.yaml")
    assert out.stat().st_ino == inode
    assert sorted(seen(out)) == ["a", "b", "c", "d", "e", "model.yaml"]


def test_a_living_writer_s_temporary_file_is_let_be_and_a_dead_one_s_is_removed(tmp_path: Path) -> None:
    (tmp_path / f"{PREFIX}0123456789ab.dead.csv").write_text("left by a kill")
    (tmp_path / f"{PREFIX}0123456789ab").mkdir()
    fill(tmp_path / f"{PREFIX}0123456789ab", "model.yaml")
    with atomic_folder(tmp_path / "out") as living:
        fill(living, "model.yaml")
        write_text(tmp_path / "other.txt", "new")
        assert living.is_dir()
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted([living.name, "other.txt"])
    assert seen(tmp_path) == {"other.txt": "new", "out/model.yaml": "new"}


def test_what_somebody_else_called_alike_stays(tmp_path: Path) -> None:
    """A name is fastcal's own with all of its digits, and a file's with an ending, a folder's without."""
    names = ["venv/", "notes/", "0123456789/", "0123456789abc/", "0123456789AB/", "0123456789ab.d/", "keep.csv"]
    names += ["0123456789ab", "01234567.csv", "0123456789ab-1.csv"]
    for name in (f"{PREFIX}{name}" for name in names):
        if name.endswith("/"):
            (tmp_path / name).mkdir()
            fill(tmp_path / name, "mine")
        else:
            fill(tmp_path, name)
    (tmp_path / f"{PREFIX}ba9876543210.csv").symlink_to(f"{PREFIX}keep.csv")
    before = sorted(tmp_path.rglob("*"))
    with atomic_folder(tmp_path / "out") as place:
        fill(place, "model.yaml")
    write_text(tmp_path / "other.txt", "new")
    new = [tmp_path / name for name in ("out", "out/model.yaml", "other.txt")]
    assert sorted(tmp_path.rglob("*")) == sorted([*before, *new])


def test_the_old_folder_is_nobody_s_while_it_is_exchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Under the temporary name it looks abandoned, and a file that somebody put there in time must follow."""
    (tmp_path / "out").mkdir()
    exchange = folders.exchange

    def exchanged(first: Path, second: Path) -> None:
        (second / "late").write_text("late")
        exchange(first, second)
        remove_abandoned(tmp_path)

    monkeypatch.setattr(folders, "exchange", exchanged)
    with atomic_folder(tmp_path / "out") as place:
        fill(place, "model.yaml")
    assert seen(tmp_path) == {"out/model.yaml": "new", "out/late": "late"}


WRITER = """
import sys
from pathlib import Path
from fastcal.io.atomic import write_text
from fastcal.io.folder import atomic_folder
place, name = Path(sys.argv[1]), sys.argv[2]
for k in range(int(sys.argv[3])):
    write_text(place / f"{name}.txt", str(k))
    with atomic_folder(place / f"{name}.d") as made:
        (made / "a").write_text(str(k))
"""


def test_processes_that_write_into_one_folder_leave_each_other_s_files(tmp_path: Path) -> None:
    """A place is made and then locked; in between, another process may clean it away, and a new one must be made."""
    count, often = (8, 2500) if os.environ.get("FASTCAL_TEST_FULL") else (4, 150)
    command = [sys.executable, "-c", WRITER, str(tmp_path)]
    running = [subprocess.Popen([*command, f"w{i}", str(often)], stderr=subprocess.PIPE) for i in range(count)]
    said = [process.communicate()[1].decode() for process in running]
    assert said == [""] * count
    expected = {f"w{i}.txt": str(often - 1) for i in range(count)} | {f"w{i}.d/a": str(often - 1) for i in range(count)}
    assert seen(tmp_path) == expected


def test_a_place_taken_between_its_making_and_its_lock_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of the three moments at which a cleaner can come: before the name is opened, before its lock, after it."""
    lock, opened, taken = atomic.locked, os.open, []

    def first_removed(descriptor: int) -> bool | None:
        place = Path(f"/proc/self/fd/{descriptor}").readlink()
        if len(taken) == 0:  # the cleaner holds the lock
            taken.append(place)
            atomic.remove(place)
            return False
        if len(taken) == 1:  # it has come and gone
            atomic.remove(place)
            taken.append(place)
        return lock(descriptor)

    def absent(path: str | os.PathLike[str], flags: int, mode: int = 0o777, **at: Any) -> int:
        if len(taken) == 2 and flags == os.O_RDONLY and Path(path).name.startswith(PREFIX):
            taken.append(Path(path))
            atomic.remove(Path(path))
        return opened(path, flags, mode, **at)

    monkeypatch.setattr(atomic, "locked", first_removed)
    monkeypatch.setattr(os, "open", absent)
    with atomic_folder(tmp_path / "out") as place:
        fill(place, "model.yaml")
    assert len(set(taken)) == 3
    assert seen(tmp_path) == {"out/model.yaml": "new"}


def test_what_is_written_is_on_the_disk_before_its_name_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every file is synced, then the folder of its new name; the order is what a power cut sees."""
    steps: list[str] = []
    sync, rename = os.fsync, Path.rename
    monkeypatch.setattr(os, "fsync", lambda f: (steps.append(str(Path(f"/proc/self/fd/{f}").readlink())), sync(f))[1])
    monkeypatch.setattr(Path, "rename", lambda a, b: (steps.append("rename"), rename(a, b))[1])
    with atomic_folder(tmp_path / "out") as place:
        fill(place, "a")
        write_text(place / "b", "new")
    at = steps.index("rename")
    assert sorted(Path(step).name for step in steps[:at]) == sorted(["a", "b", place.name]), "each once"
    assert steps[at + 1 :] == [str(tmp_path)]
