"""File object for libhdf5: correct bytes, and the last commit survives errors, roll-backs and kills."""

from __future__ import annotations

import io
import random
import shutil
from pathlib import Path
from typing import Any

import pytest

from fuzzing.disk import largest_file
from rotorsim.base import hdf5
from rotorsim.base.hdf5 import CommittedFile, repair


def written(file: CommittedFile, content: bytearray, rng: random.Random) -> None:
    """Write at a random place, into the file and into the content that it must have."""
    first = rng.randrange(len(content) + rng.choice([1, 100, 9000]))
    data = rng.randbytes(rng.choice([1, 10, 500, 4096, 10_000]))
    file.seek(first)
    assert file.write(data) == len(data)
    content.extend(bytes(max(first - len(content), 0)))
    content[first : first + len(data)] = data


def read(file: CommittedFile, size: int) -> bytes:
    """All bytes, as libhdf5 would read them."""
    file.seek(0)
    found = bytearray(size)
    assert file.readinto(found) == size
    return bytes(found)


def repaired(path: Path) -> bytes:
    """Bytes of a copy of the file as a kill at this moment would leave it, after its repair."""
    copy = path.with_suffix(".killed")
    shutil.copy(path, copy)
    repair(copy)
    return copy.read_bytes()


@pytest.mark.parametrize("seed", range(20))
def test_random_writes_commits_and_roll_backs_leave_the_bytes_of_a_plain_file(tmp_path: Path, seed: int) -> None:
    rng, path = random.Random(seed), tmp_path / "a"
    content, committed = bytearray(), b""
    with CommittedFile(path) as file:
        for _ in range(50):
            act = rng.random()
            if act < 0.7:
                written(file, content, rng)
            elif act < 0.75:
                content.extend(bytes(rng.randrange(6000)))
                file.truncate(len(content))
            elif act < 0.95:
                file.commit()
                committed = bytes(content)
            else:
                file.roll_back()
                content = bytearray(committed)
            assert read(file, len(content)) == bytes(content)
            assert repaired(path)[: len(committed)] == committed
        file.finish()
    assert path.read_bytes() == bytes(content)


class Watched(io.FileIO):
    """A disk that keeps the file's bytes, repaired, after every single write."""

    states: tuple[list[bytes], ...] = ()

    def write(self, data: Any) -> int:
        n = super().write(data)
        for states in self.states:
            states.append(repaired(Path(str(self.name))))
        return int(n or 0)


@pytest.mark.parametrize("seed", range(10))
def test_a_kill_within_a_commit_leaves_the_state_before_or_after_it(
    tmp_path: Path, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hdf5, "open", lambda path, mode, buffering: Watched(path, mode), raising=False)
    rng, content, states, seen = random.Random(seed), bytearray(), [], 0
    with CommittedFile(tmp_path / "a") as file:
        for _ in range(4):
            before = bytes(content)
            for _ in range(4):
                written(file, content, rng)
            monkeypatch.setattr(Watched, "states", (states,))
            file.commit()
            monkeypatch.setattr(Watched, "states", ())
            new = states[seen:]
            seen = len(states)
            assert all(state[: len(before)] == before or state == bytes(content) for state in new)
    assert seen > 8


@pytest.mark.parametrize("limit", range(0, 60_000, 3000))
def test_no_write_fails_on_a_disk_that_ends_and_the_last_commit_comes_back(tmp_path: Path, limit: int) -> None:
    rng, content, committed = random.Random(limit), bytearray(), b""
    with largest_file(limit), CommittedFile(tmp_path / "a") as file:
        for _ in range(20):
            for _ in range(3):
                written(file, content, rng)
            assert read(file, len(content)) == bytes(content)
            try:
                file.commit()
            except OSError as error:
                assert file.error is error
                break
            committed = bytes(content)
        file.roll_back()
        assert read(file, len(committed)) == committed
        file.finish()
    assert (tmp_path / "a").read_bytes() == committed
    assert len(committed) <= limit
