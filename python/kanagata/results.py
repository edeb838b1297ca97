"""Results of a run."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from . import _kanagata


class Run:
    """The files of a run folder, also of a run that has not ended.

    :param folder: the folder.
    :raises OSError: no run is there.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._set(_kanagata.RunRecord(folder))

    @classmethod
    def _of(cls, record: Any) -> Run:
        run = cls.__new__(cls)
        run._set(record)
        return run

    def _set(self, record: Any) -> None:
        self._record = record
        self.folder = Path(record.folder)
        self.record: dict[str, Any] = json.loads(record.json())
        """All of run.json."""

    @property
    def verdict(self) -> str:
        """``completed``, ``doubtful``, ``stopped``, ``running`` or ``not_converged``."""
        return self.record["verdict"]

    @property
    def doubts(self) -> list[dict[str, Any]]:
        """Why the results must not be trusted as they are: code, where, value, limit, text."""
        return self.record["doubts"]

    @property
    def accuracy(self) -> dict[str, Any] | None:
        """Estimated errors of a sequence of runs: end, quantities, runs; None for a single run."""
        return self.record.get("accuracy")

    @property
    def metrics(self) -> dict[str, Any]:
        """Results as one flat table: verdict, forces by tool, thickness, draw-in, springback, cost."""
        return json.loads(self._record.metrics())

    def arrays(self) -> dict[str, np.ndarray]:
        """Columns of history.csv: travels [mm], forces [N], counts and energies [N mm] of every increment."""
        return {name: np.asarray(values) for name, values in self._record.history().items()}

    @property
    def history(self) -> Any:
        """The same as a frame of pandas, which must be installed."""
        import pandas

        return pandas.DataFrame(self._record.history())

    @property
    def steps(self) -> list[tuple[float, Path]]:
        """Process time and VTU file of every step that was written."""
        return [(time, Path(file)) for time, file in self._record.steps()]

    def mesh(self, step: int = -1) -> Any:
        """The sheet at a step as a mesh of PyVista, which must be installed."""
        import pyvista

        return pyvista.read(self.steps[step][1])

    def __repr__(self) -> str:
        codes = ", ".join(sorted({d["code"] for d in self.doubts})) or "none"
        return f"<kanagata.Run {self.record['name']}: {self.verdict}, doubts: {codes}>"
