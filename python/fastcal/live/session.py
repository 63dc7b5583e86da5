# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A session of measuring: rows come, are written, are judged; the uncertainty falls, and the next pose is named."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from threading import RLock

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.design.poses import SIGMA
from fastcal.errors import FastcalError, InvalidInput, Undetermined
from fastcal.live import judging
from fastcal.live.belief import Belief
from fastcal.live.journal import CHOICES, Journal
from fastcal.live.judging import Judgement
from fastcal.live.next_pose import NextPose, Workspace
from fastcal.live.rows import Header
from fastcal.measurements.dataset import Dataset
from fastcal.robot.given import RobotLike, as_robot
from fastcal.said import said

EARLY = 6  # rows that are right, so that the next can be judged
_FORESEEN = 10  # times the rows that are there: of more that are missing no number is told
_BLAMED_UP_TO = 25  # rows; of more, one that was wrong no longer turns the others


@dataclass(frozen=True)
class Row:
    """A row that came.

    Attributes:
        line: As it came.
        data: The same as a data set; None where it could not be read.
        judgement: What the session thinks of it.
        decision: keep or leave, where a person has decided; else empty.
    """

    line: str
    data: Dataset | None
    judgement: Judgement
    decision: str = ""

    @property
    def is_kept(self) -> bool:
        """Does it count?"""
        if self.data is None or self.judgement.kind == "dropped_beam":
            return False
        return self.decision == "keep" or (self.judgement.kind == "ok" and self.decision != "leave")


@dataclass(frozen=True)
class Answer:
    """To a row: its number from 0, and `ok` or what is wrong; where an earlier one now looks wrong, that too."""

    row: int
    text: str


class LiveSession:
    """Measured rows of an arm as they come.

    Every row is on the disk before it is judged, so that no row that was answered can be lost; a session that is opened
    again in the same folder goes on where it ended.

    Args:
        robot: The nominal arm; its own effects are left out.
        folder: Where the files are, see `live.journal`.
        goal: Standard deviation of a predicted coordinate [m] at which it is enough; None: nothing is asked.
        sigma: Noise of a measured coordinate [m].
        plan: Poses to choose the next from; None: postures at random, clear of the arm's own mounting.
        seed: The same seed names the same poses.

    Raises:
        InvalidInput: The folder holds a session of another arm or cannot be written.
    """

    def __init__(
        self,
        robot: RobotLike,
        folder: str | os.PathLike[str],
        *,
        goal: float | None = None,
        sigma: float = SIGMA,
        plan: Dataset | None = None,
        seed: int = 0,
    ) -> None:
        given = as_robot(robot)
        self.nominal = given.with_(effects=[])
        self.goal, self.sigma = goal, sigma
        self.journal = Journal(Path(folder))
        self.workspace = Workspace(self.nominal, plan, seed)
        self.header: Header | None = None
        self.rows: list[Row] = []
        self.belief: Belief | None = None
        self.history: list[tuple[int, float]] = []
        self._lock = RLock()
        header, lines, decisions = self.journal.read()
        if header is not None:
            self.header = Header(header, self.nominal, str(self.journal.arrived))
        for row, line in enumerate(lines):
            self._take(line, decisions.get(row, ""))
        if lines:
            self._write()

    def begin(self, line: str) -> None:
        """Takes the header line; one that comes again must be the same.

        Raises:
            ParseError: A column is missing or unknown. InvalidInput: It is another header than the session's.
        """
        with self._lock:
            if self.header is None:
                self.header = Header(line, self.nominal)
                self.journal.append(self.header.line)
            elif Header(line, self.nominal).line != self.header.line:
                raise InvalidInput(
                    f"expected the header of this session, '{self.header.line:.80}', got '{line.strip():.80}'; "
                    "begin another session for another header"
                )

    def add(self, line: str) -> Answer:
        """Takes a row: writes it, judges it, and says what it thinks.

        Raises:
            InvalidInput: There was no header yet, or the row cannot be written.
        """
        with self._lock:
            if self.header is None:
                raise InvalidInput("expected the header line of a measurement file before the first row")
            line = line.strip("\r\n")
            self.journal.append(line)
            later = self._take(line, "")
            self._write()
            row = len(self.rows) - 1
            answer = self.rows[row].judgement.text or "ok"
            return Answer(row, "; ".join([answer, *later]))

    def decide(self, row: int, choice: str) -> None:
        """Keeps or leaves a row, whatever the session thinks of it."""
        with self._lock:
            if choice not in CHOICES or not 0 <= row < len(self.rows) or self.rows[row].data is None:
                raise InvalidInput(f"expected keep or leave, and a row that was read, got '{choice}' of row {row}")
            self.journal.decide(row, choice)
            self.rows[row] = replace(self.rows[row], decision=choice)
            self._believe()
            self._write()

    @property
    def kept(self) -> list[int]:
        """Rows that count."""
        return [k for k, row in enumerate(self.rows) if row.is_kept]

    @property
    def deviation(self) -> float | None:
        """Predicted standard deviation of a coordinate over the workspace [m]; None while nothing is known."""
        return self.history[-1][1] if self.belief is not None and self.history else None

    @property
    def is_enough(self) -> bool:
        """Is the goal reached?"""
        return self.goal is not None and self.deviation is not None and self.deviation <= self.goal

    @property
    def rows_to_go(self) -> int | None:
        """About how many rows are missing, as the variance falls with one over their number.

        None where that is not known: of a few rows, whose variance falls faster, it would be far too many.
        """
        if self.goal is None or self.deviation is None or self.belief is None:
            return None
        count = len(self.kept)
        missing = max(0, int(np.ceil(count * ((self.deviation / self.goal) ** 2 - 1))))
        return None if missing > _FORESEEN * count else missing

    def next_pose(self) -> NextPose | None:
        """What to measure next: what lowers the predicted variance most; None where all that was planned is done."""
        with self._lock:
            return self.workspace.next_pose(self.belief, self._postures())

    def _take(self, line: str, decision: str) -> list[str]:
        """Judges a row and adds it; returns what is now said of earlier ones."""
        assert self.header is not None  # noqa: S101 - checked at the door
        try:
            data = self.header.dataset([line])
        except FastcalError as error:
            self.rows.append(Row(line, None, Judgement("unreadable", str(getattr(error, "message", error)))))
            return []
        judgement, blamed = self._judged(data)
        later = []
        if blamed is not None:
            later.append(self._blame(blamed, said("the rows that came since do not go with it")))
        self.rows.append(Row(line, data, judgement, decision))
        if self.rows[-1].is_kept:
            self._believe()
            if (odd := self._odd()) is not None:
                later.append(self._blame(odd, said("the others, as they are now, do not go with it")))
                self._believe()
        return later

    def _blame(self, row: int, why: str) -> str:
        text = said("slip, seen later: {why}; measure it again", why=why)
        judgement = replace(self.rows[row].judgement, kind="slip", text=text)
        self.rows[row] = replace(self.rows[row], judgement=judgement)
        return f"row {row}: {judgement.text}"

    def _judged(self, data: Dataset) -> tuple[Judgement, int | None]:
        """What a new row is, and which earlier one is rather to blame."""
        kept = self.kept
        before = self._data(kept) if kept else None
        found = judging.dropped_beam(data, before, kept, self.nominal)
        found = found or judging.stale_joints(data, before, kept, self.sigma)
        if found is not None:
            return found, None
        if self.belief is None or len(kept) < EARLY:
            return Judgement(), None
        planned = self.workspace.planned
        others = np.vstack([*([] if before is None else [before.q]), planned])
        of = [
            *(said("row {row}", row=row) for row in kept),
            *(said("planned pose {number}", number=k + 1) for k in range(len(planned))),
        ]
        found = judging.against(self.belief, data, others, of)
        if found.kind == "slip" and len(kept) <= _BLAMED_UP_TO and (row := self._rather(kept, data)) is not None:
            return Judgement("ok", "", found.off, found.expected), row
        return found, None

    def _rather(self, kept: Sequence[int], new: Dataset) -> int | None:
        """The earlier row without which the new one and all others go together, far better than all without the new."""
        assert self.belief is not None  # noqa: S101 - asked for by a row that was held against it
        least, at = self.belief.misfit[0] / 2, None
        for row in kept:
            others = Dataset.concatenate([self._data([k for k in kept if k != row]), new])
            belief = self._of(others)
            if belief is not None and belief.misfit[0] < least:
                least, at = belief.misfit[0], row
        return at

    def _odd(self) -> int | None:
        """The kept row that goes least with the others, where it is wrong beyond doubt."""
        if self.belief is None or len(self.kept) <= EARLY:
            return None
        from scipy.special import fdtrc

        belief, deleted = self.belief, self.belief.deleted
        degrees = belief.degrees - 3
        noise = np.maximum(1.0, (judging_noise(belief) - deleted) / degrees)
        level = fdtrc(3, degrees, deleted / 3 / noise)
        free = [k for k, row in enumerate(self.kept) if self.rows[row].decision != "keep"]
        worst = min(free, key=lambda k: float(level[k]), default=None)
        return self.kept[worst] if worst is not None and level[worst] < judging.LEVEL / len(self.kept) else None

    def _believe(self) -> None:
        """The belief of the rows that are kept now, and what it predicts."""
        kept = self.kept
        self.belief = self._of(self._data(kept)) if kept else None
        if self.belief is not None:
            self.history.append((len(kept), self.workspace.deviation(self.belief)))

    def _of(self, data: Dataset) -> Belief | None:
        try:
            return Belief.of(self.nominal, data, self.sigma)
        except Undetermined:
            return None

    def _data(self, rows: Sequence[int]) -> Dataset:
        assert self.header is not None  # noqa: S101 - there are rows
        return self.header.dataset([self.rows[row].line for row in rows])

    def _postures(self) -> FloatArray:
        """(K, n) of the rows that are kept."""
        return np.array([row.data.q[0] for row in self.rows if row.is_kept and row.data is not None])

    def _write(self) -> None:
        assert self.header is not None  # noqa: S101 - there are rows
        self.journal.keep(self.header.line, [self.rows[row].line for row in self.kept])


def judging_noise(belief: Belief) -> float:
    """Squares by which the noise is judged, the stated ones among them."""
    return float(belief.degrees - belief.misfit[1] + belief.misfit[0])
