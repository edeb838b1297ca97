"""Scenes, checks and runs."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from . import _kanagata
from ._kanagata import ConvergenceError, InputError, KanagataError, StoppedError
from .programs import program
from .results import Run
from .scene_types import SceneFile

Progress = Mapping[str, Any]
Accuracy = float | Mapping[str, float] | None
"""A fraction for all quantities, errors by quantity (``{"force": 0.02, "draw_in_mm": 0.1}``), or that of the scene."""


@dataclass(frozen=True)
class Check:
    """What a check of a scene finds."""

    findings: list[dict[str, Any]]
    """Errors, doubts and notes: level, where, what, remedy, value, limit; the most severe and effective first."""
    cost: dict[str, Any]
    """Estimated unknowns, memory [MB] and time [s]."""

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Findings with which a run refuses the scene."""
        return [f for f in self.findings if f["level"] == "error"]

    @property
    def doubts(self) -> list[dict[str, Any]]:
        """Findings that make the results of a run doubtful."""
        return [f for f in self.findings if f["level"] == "doubt"]


class Scene:
    """A scene file with its tools and material, read and checked.

    :param path: the scene file.
    :param set: values to set, by paths of keys, names of tools and indices: ``{"tools.die.friction": 0.08}``.
    :raises InputError: a key or value that is not allowed, with what is.
    """

    def __init__(self, path: str | os.PathLike[str], set: Mapping[str, Any] | None = None) -> None:
        self.path: str | None = os.fspath(path)
        self.set = dict(set or {})
        self._scene = _kanagata.Scene(self.path, self._assignments())

    @classmethod
    def of(
        cls,
        values: SceneFile,
        folder: str | os.PathLike[str] = ".",
        set: Mapping[str, Any] | None = None,
    ) -> Scene:
        """A scene of ``values`` (keys as in the reference of scenes) without a file; its paths are relative to ``folder``.

        It is checked and run inside this process. Another process, and :func:`run_to_accuracy`, need a file (:meth:`write`).
        """
        scene = cls.__new__(cls)
        scene.path, scene.set = None, dict(set or {})
        scene._scene = _kanagata.Scene.of_text(json.dumps(values), os.fspath(folder), scene._assignments())
        return scene

    @classmethod
    def write(cls, values: SceneFile, path: str | os.PathLike[str]) -> Scene:
        """Writes a scene file of ``values`` (keys as in the reference of scenes) and reads it. Its paths are relative to its folder."""
        path = os.fspath(path)
        beside = path + ".part"
        with open(beside, "w", encoding="utf-8") as file:
            json.dump(values, file, indent=2)
        os.replace(beside, path)
        return cls(path)

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self._scene.name

    @property
    def tools(self) -> list[str]:
        """Names of the tools."""
        return self._scene.tools

    @property
    def values(self) -> SceneFile:
        """A copy of the scene with its defaults, as in the scene file."""
        return json.loads(self._scene.json())

    def check(self) -> Check:
        """Findings about the scene and the cost of a run."""
        findings, cost = self._scene.check()
        return Check(json.loads(findings), json.loads(cost))

    def run(self, folder: str | os.PathLike[str], **options: Any) -> Run:
        """Runs the scene; options as of :func:`run`."""
        return run(self, folder, **options)

    def run_to_accuracy(self, folder: str | os.PathLike[str], accuracy: Accuracy = None, **options: Any) -> Run:
        """Runs the scene to an accuracy; arguments as of :func:`run_to_accuracy`."""
        return run_to_accuracy(self, folder, accuracy, **options)

    def _assignments(self) -> list[str]:
        return [f"{path}={json.dumps(value)}" for path, value in self.set.items()]

    def __repr__(self) -> str:
        return f"<kanagata.Scene {self.name}: tools {', '.join(self.tools)}>"


def run(
    scene: Scene | str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    on_increment: Callable[[Progress], None] | None = None,
    restart: bool = False,
    overwrite: bool = False,
    threads: int | None = None,
    process: bool = False,
) -> Run:
    """Runs a scene into ``folder``.

    :param on_increment: called after every increment with increment, stage, time, travels [mm] and forces [N] by tool,
        iterations, contact and slipping nodes; inside this process also done (0 to 1) and elapsed_s. An exception stops the run.
    :param restart: continue from the checkpoint in the folder.
    :param overwrite: replace a stopped run of the same inputs.
    :param threads: threads of the solver; results are the same for any number.
    :param process: run ``kanagata-solve`` as a process of its own instead of inside this one.
    :returns: the results, also when they are doubtful (:attr:`Run.doubts`).
    :raises ConvergenceError: the folder keeps what was computed.
    :raises InputError: the scene cannot be run, or the folder may not be replaced.
    """
    scene = scene if isinstance(scene, Scene) else Scene(scene)
    if process:
        return _run_process(scene, os.fspath(folder), on_increment, restart, overwrite, threads)
    record = scene._scene.run(folder, on_increment, restart=restart, overwrite=overwrite, threads=threads)
    return Run._of(record)


def run_to_accuracy(
    scene: Scene | str | os.PathLike[str],
    folder: str | os.PathLike[str],
    accuracy: Accuracy = None,
    *,
    budget_s: float | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    overwrite: bool = False,
    threads: int | None = None,
) -> Run:
    """Runs a scene from coarse to fine until the estimated errors are below ``accuracy``, as ``kanagata-solve run --accuracy``.

    :param accuracy: 0.01 for 1 % of all quantities, a mapping of the keys of the scene's ``accuracy``, or None for that of the scene.
    :param budget_s: wall time that the runs may take [s]; the best result within it is returned.
    :param on_progress: called where a run begins or fails, and after every increment, with run, purpose, model, known and
        failure; after an increment also with the keys of ``on_increment`` of :func:`run`. An exception stops the sequence.
    :param overwrite: discard runs that are there; without it the same call continues a sequence.
    :returns: the best run, with the estimated errors in :attr:`Run.accuracy`.
    :raises ConvergenceError: no run has converged.
    :raises InputError: the scene cannot be run or has no such quantity, or it is in memory only.
    """
    scene = scene if isinstance(scene, Scene) else Scene(scene)
    if accuracy is None:
        text = None
    elif isinstance(accuracy, Mapping):
        text = json.dumps(dict(accuracy))
    else:
        text = json.dumps(dict.fromkeys(("force", "thickness", "draw_in", "springback"), float(accuracy)))
    record = scene._scene.run_to_accuracy(
        folder, text, on_progress, wall_s=budget_s, overwrite=overwrite, threads=threads
    )
    return Run._of(record)


def _progress(row: Mapping[str, Any]) -> Progress:
    """Progress from a line of ``kanagata-solve run --json``."""
    by_tool = {key: dict(zip(row["tools"], row[key])) for key in ("travel_mm", "force_n")}
    contacts, slipping = row["contacts"]
    same = {key: row[key] for key in ("increment", "stage", "time", "iterations")}
    return {**same, **by_tool, "contact_nodes": contacts, "slipping_nodes": slipping}


def _run_process(
    scene: Scene,
    folder: str,
    on_increment: Callable[[Progress], None] | None,
    restart: bool,
    overwrite: bool,
    threads: int | None,
) -> Run:
    if scene.path is None:
        raise InputError("the scene is in memory; allowed with process=True: a scene file; write it by Scene.write first")
    command = [program("kanagata-solve"), "run", scene.path, "-o", folder, "--json", "--tied"]
    command += [word for text in scene._assignments() for word in ("--set", text)]
    command += ["--restart"] * restart + ["--overwrite"] * overwrite
    command += ["--threads", str(threads)] if threads else []
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as child:
        assert child.stdin and child.stdout and child.stderr
        try:
            for line in child.stdout:
                told = json.loads(line)
                if on_increment is not None and "increment" in told:
                    on_increment(_progress(told))
        except BaseException:
            # The end of its input stops the solver with a checkpoint.
            child.stdin.close()
            raise
        text = child.stderr.read()
        child.stdin.close()
        code = child.wait()
    kinds = {2: InputError, 3: ConvergenceError, 4: OSError, 5: StoppedError}
    if code not in (0, 1):
        raise kinds.get(code, KanagataError)(text.strip() or f"kanagata-solve ended with code {code}")
    return Run(folder)
