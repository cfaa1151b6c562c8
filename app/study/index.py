"""The index in SQLite: who holds which slot, and the rows of finished trials.

Everything in it can be made again from the files (`hindsight study rebuild`). All SQL of the
program is here; WAL and `synchronous = FULL`, so that what was answered survives a power cut.
"""

import json
import sqlite3
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.study.errors import StorageError
from app.study.orders import pick_cell

FILE = "state.sqlite"
BUSY_MS = 5000
_SCHEMA = """
CREATE TABLE IF NOT EXISTS participants (
  study TEXT NOT NULL, id TEXT NOT NULL, number INTEGER NOT NULL, cell INTEGER NOT NULL,
  slot INTEGER NOT NULL, pilot INTEGER NOT NULL DEFAULT 0, status TEXT NOT NULL,
  seen_s REAL NOT NULL, token TEXT NOT NULL DEFAULT '', request TEXT NOT NULL DEFAULT '',
  person TEXT NOT NULL DEFAULT '', withdrawal TEXT NOT NULL DEFAULT '',
  PRIMARY KEY (study, id));
CREATE UNIQUE INDEX IF NOT EXISTS by_request ON participants (study, request) WHERE request <> '';
CREATE UNIQUE INDEX IF NOT EXISTS by_person ON participants (study, person) WHERE person <> '';
CREATE INDEX IF NOT EXISTS by_token ON participants (study, token);
CREATE TABLE IF NOT EXISTS trials (
  study TEXT NOT NULL, participant TEXT NOT NULL, trial INTEGER NOT NULL, row TEXT NOT NULL,
  PRIMARY KEY (study, participant, trial));
"""


@dataclass(frozen=True)
class Entry:
    """One participant in the index; digests only, no secrets."""

    id: str
    cell: int
    slot: int
    pilot: bool
    status: str
    seen_s: float
    token: str = ""
    request: str = ""
    person: str = ""
    withdrawal: str = ""

    @property
    def number(self) -> int:
        """p0007 → 7."""
        return int(self.id[1:])


class Index:
    """Owns the database of one study."""

    def __init__(self, sessions: Path, study: str, busy_ms: int = BUSY_MS) -> None:
        """Open or make it.

        Raises:
            StorageError: If the file cannot be used.
        """
        self.path, self._study = sessions / FILE, study
        self._lock = threading.RLock()
        with self._errors():
            self._db = sqlite3.connect(
                self.path, isolation_level=None, check_same_thread=False, timeout=busy_ms / 1000
            )
            self._db.row_factory = sqlite3.Row
            self._db.execute(f"PRAGMA busy_timeout = {busy_ms}")
            self._db.execute("PRAGMA journal_mode = WAL")
            self._db.execute("PRAGMA synchronous = FULL")
            self._db.execute("PRAGMA secure_delete = ON")  # deleted rows are overwritten
            self._db.executescript(_SCHEMA)

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def claim(
        self,
        n_cells: int,
        prefix: str,
        *,
        request: str,
        person: str,
        token: str,
        pilot: bool = False,
        abandoned_s: float = 3600.0,
        cell: int | None = None,
    ) -> tuple[Entry, bool]:
        """Take the next slot, in one transaction; the same request gets the same slot again.

        Args:
            n_cells: Order cells of the study.
            prefix: Of the pseudonym: p, or t in test runs.
            request: Digest of the browser's own number for this consent.
            person: Digest of the recruitment identity; empty: none.
            token: Digest of the cookie.
            pilot: Whether the participant counts nowhere.
            abandoned_s: After so long without a sign of life a slot is free again.
            cell: This cell, and none of the choosing.

        Returns:
            The entry, and whether it is new.
        """
        now = time.time()
        with self._write() as db:
            for column, value in (("request", request), ("person", person)):
                known = value and self._find(db, column, value)
                if known:
                    return known, False
            rows = [self._entry(row) for row in self._select(db, "pilot = ?", int(pilot))]
            done = [r for r in rows if r.status == "completed"]
            live = [r for r in rows if r.status == "running" and now - r.seen_s < abandoned_s]
            if cell is None:
                cell = pick_cell(
                    [sum(r.cell == c for r in done) for c in range(n_cells)],
                    [sum(r.cell == c for r in live) for c in range(n_cells)],
                )
            taken = {r.slot for r in (*done, *live) if r.cell == cell}
            slot = next(s for s in range(len(taken) + 1) if s not in taken)
            top = db.execute(
                "SELECT COALESCE(MAX(number), 0) FROM participants WHERE study = ?", (self._study,)
            ).fetchone()[0]
            entry = Entry(
                f"{prefix}{top + 1:04d}", cell, slot, pilot, "running", now, token, request, person
            )
            self._put(db, entry)
        return entry, True

    def put(self, entry: Entry) -> None:
        """Insert or replace a participant."""
        with self._write() as db:
            self._put(db, entry)

    def remove(self, participant: str) -> int:
        """Delete a participant's rows, from the file as well; returns how many."""
        with self._write() as db:
            key = (self._study, participant)
            n = db.execute("DELETE FROM participants WHERE study = ? AND id = ?", key).rowcount
            n += db.execute("DELETE FROM trials WHERE study = ? AND participant = ?", key).rowcount
        with self._errors():  # else the write-ahead log still holds what was deleted
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        return n

    def put_row(self, participant: str, trial: int, row: dict[str, Any]) -> None:
        """Keep the table row of a finished trial."""
        with self._write() as db:
            db.execute(
                "INSERT OR REPLACE INTO trials VALUES (?, ?, ?, ?)",
                (self._study, participant, trial, json.dumps(row)),
            )

    def rows(self, participant: str) -> dict[int, dict[str, Any]]:
        """Log number → row, of a participant."""
        with self._errors():
            found = self._db.execute(
                "SELECT trial, row FROM trials WHERE study = ? AND participant = ? ORDER BY trial",
                (self._study, participant),
            )
            return {row["trial"]: json.loads(row["row"]) for row in found}

    def replace_all(self, entries: Iterable[Entry]) -> None:
        """Make the participants of this study these."""
        with self._write() as db:
            db.execute("DELETE FROM participants WHERE study = ?", (self._study,))
            for entry in entries:
                self._put(db, entry)

    def forget_rows(self) -> None:
        """Drop the rows of all trials of this study."""
        with self._write() as db:
            db.execute("DELETE FROM trials WHERE study = ?", (self._study,))

    def _put(self, db: sqlite3.Connection, e: Entry) -> None:
        db.execute(
            "INSERT OR REPLACE INTO participants VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (self._study, e.id, e.number, e.cell, e.slot, int(e.pilot), e.status, e.seen_s)
            + (e.token, e.request, e.person, e.withdrawal),
        )

    def _find(self, db: sqlite3.Connection, column: str, value: str) -> Entry | None:
        assert column in ("id", "token", "request", "person", "withdrawal")
        rows = self._select(db, f"{column} = ?", value) if value else []
        return self._entry(rows[0]) if rows else None

    def _select(self, db: sqlite3.Connection, where: str, value: Any) -> list[sqlite3.Row]:
        return db.execute(
            f"SELECT * FROM participants WHERE study = ? AND {where} ORDER BY number",
            (self._study, value),
        ).fetchall()

    @staticmethod
    def _entry(row: sqlite3.Row) -> Entry:
        names = ("id", "cell", "slot", "status", "seen_s", "token", "request", "person")
        known = {name: row[name] for name in (*names, "withdrawal")}
        return Entry(pilot=bool(row["pilot"]), **known)

    @contextmanager
    def _write(self) -> Iterator[sqlite3.Connection]:
        with self._errors():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield self._db
            except BaseException:
                self._db.execute("ROLLBACK")
                raise
            self._db.execute("COMMIT")

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            with self._lock:
                yield
        except sqlite3.Error as error:
            raise StorageError(f"the index {self.path.name} refuses: {error}") from None
