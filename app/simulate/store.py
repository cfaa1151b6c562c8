"""The folder of a simulated run: trials.parquet, calibration.csv, config.json; until then parts.

Every few seconds finished trials become a durable partial file of their own, so that a full disk, a
crash or Ctrl-C costs seconds; the same command continues from them.
"""

import csv
import io
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from app.simulate.errors import SimulateError
from app.simulate.plan import Study
from app.simulate.table import ordered, to_table
from app.simulate.trial import CALIBRATION_BINS, Row

CONFIG, TRIALS, CALIBRATION, PARTS = "config.json", "trials.parquet", "calibration.csv", "parts"


class RunFolder:
    """Owns the files of one run."""

    def __init__(self, folder: Path, study: Study) -> None:
        """Make the folder, or take up the same study where it was left.

        Raises:
            SimulateError: If it holds something else, or cannot be written.
        """
        self._folder = folder
        self._study = study
        self._parts = folder / PARTS
        config = folder / CONFIG
        wanted = study.to_dict()
        try:
            if config.exists():
                found = json.loads(config.read_text(encoding="utf-8"))
                if found.get("study") != wanted:
                    raise SimulateError(
                        f"{folder} holds another study ({CONFIG} differs); valid: a new folder, or "
                        "the very same study to continue it"
                    )
            elif folder.exists() and any(folder.iterdir()):
                raise SimulateError(f"{folder} is not empty and no simulated run")
            else:
                folder.mkdir(parents=True, exist_ok=True)
                _write(config, json.dumps({"study": wanted}, indent=2).encode())
        except (OSError, ValueError) as error:
            raise SimulateError(f"{folder} cannot be used: {error}") from None
        self._number = 1 + max((int(p.stem[5:]) for p in self._part_files()), default=0)

    def read(self) -> list[Row]:
        """What was finished before."""
        finished = self._folder / TRIALS
        files = self._part_files() or ([finished] if finished.exists() else [])
        try:
            return [row for path in files for row in pq.read_table(path).to_pylist()]
        except (OSError, pa.ArrowException) as error:
            raise SimulateError(f"{self._folder} cannot be continued: {error}") from None

    def add(self, rows: Sequence[Row]) -> None:
        """Make finished trials durable.

        Raises:
            OSError: If the disk refuses; what was added before stays.
        """
        self._parts.mkdir(exist_ok=True)
        path = self._parts / f"part-{self._number:06d}.parquet"
        _write(path, _parquet(to_table(rows, calibration=True)))
        self._number += 1

    def finish(self, rows: Sequence[Row], *, complete: bool) -> None:
        """Write the tables; the parts go once the run is complete.

        Raises:
            OSError: If the disk refuses; the parts stay.
        """
        _write(self._folder / TRIALS, _parquet(to_table(ordered(rows), calibration=False)))
        if any(row.get("calibration") for row in rows):
            _write(self._folder / CALIBRATION, _calibration_csv(rows))
        if complete and self._parts.exists():
            for path in self._part_files():
                path.unlink()
            self._parts.rmdir()

    def _part_files(self) -> list[Path]:
        return sorted(self._parts.glob("part-*.parquet"))


def calibration_table(rows: Sequence[Row]) -> list[tuple[str, float, float, float, float, float]]:
    """Per method and bin of probability: low, high, count, sum of the probabilities, hits."""
    edges = np.linspace(0.0, 1.0, CALIBRATION_BINS + 1).round(3).tolist()
    sums: dict[str, Any] = {}
    for row in ordered(rows):
        if row.get("calibration"):
            counts = np.array(row["calibration"]).reshape(3, CALIBRATION_BINS)
            sums[row["method"]] = sums.get(row["method"], 0.0) + counts
    return [
        (method, edges[i], edges[i + 1], *table[:, i].tolist())
        for method, table in sums.items()
        for i in range(CALIBRATION_BINS)
    ]


def _calibration_csv(rows: Sequence[Row]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("method", "low", "high", "count", "probability_sum", "hits"))
    writer.writerows(calibration_table(rows))
    return text.getvalue().encode()


def _parquet(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink)
    return sink.getvalue().to_pybytes()


def _write(path: Path, data: bytes) -> None:
    """Replace a file as a whole, durably: a reader sees the old one or the new one."""
    partial = path.with_name(path.name + ".partial")
    try:
        with partial.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, path)
    except OSError:
        partial.unlink(missing_ok=True)
        raise
