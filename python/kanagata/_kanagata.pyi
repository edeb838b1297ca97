"""Objects of the library."""

import os
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

__version__: str

class KanagataError(Exception):
    """Any error of the package but those of files (OSError)."""

class InputError(KanagataError):
    """A file or a value is not what is allowed."""

class ConvergenceError(KanagataError):
    """The solver does not converge."""

class StoppedError(KanagataError):
    """The run was asked to stop."""

Floats = npt.NDArray[np.float64]
Counts = npt.NDArray[np.uint32]

class Cad:
    """The trimmed faces of an IGES or STEP file [mm]."""

    def __init__(self, path: str | os.PathLike[str]) -> None: ...
    @property
    def faces(self) -> int:
        """Number of faces."""
    @property
    def areas_mm2(self) -> Floats:
        """Area of each face [mm2], (faces,)."""
    @property
    def bounds_mm(self) -> Floats:
        """Least and greatest coordinates [mm], (2, 3)."""
    @property
    def unit(self) -> str:
        """Unit of length in the file, by its name there."""
    @property
    def bodies(self) -> list[str]:
        """Names of the bodies; empty where the file names nothing."""
    @property
    def lost_faces(self) -> list[tuple[str, str]]:
        """Faces that cannot be read or have no area: entity and reason."""
    @property
    def warnings(self) -> list[str]:
        """Warnings about the content of the file."""
    def convert(
        self,
        *,
        name: str = "tool",
        kind: Literal["nagata", "bezier", "facets"] = "nagata",
        tol_mm: float | None = None,
        normal_tol_deg: float | None = None,
        patches: int | None = None,
        time_s: float | None = None,
        arc_divisions: int = 4,
        edges_on_cad: bool | None = None,
        independent_borders: bool = False,
        smooth_deg: float = 0.5,
        sheet_side: Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None = None,
        flip: bool = False,
        offset_mm: float | None = None,
        sheet_reference: Literal["lower", "middle", "upper"] | None = None,
        thickness_mm: float | None = None,
        faces: str | None = None,
        skip_lost_faces: bool = False,
    ) -> Tool:
        """Converts the faces to a tool.

        :param tol_mm: largest shape error (Eq. 24) [mm]; the fewest patches within it are searched.
        :param normal_tol_deg: largest error of the normals [degrees].
        :param patches: the least error with at most this many patches, in place of the tolerances.
        :param time_s: time for the search [s].
        :param arc_divisions: divisions of a fillet of 90 degrees, without a search.
        :param edges_on_cad: what Eq. 8 leaves undetermined of an edge follows the CAD; by default with a search.
        :param independent_borders: faces may be divided independently, with gaps within the tolerance.
        :param smooth_deg: angle below which adjacent faces are tangent [degrees].
        :param sheet_side: direction towards the sheet; a tool that looks away from it is reversed.
        :param flip: reverses the tool, after ``sheet_side``.
        :param offset_mm: makes the tool of the offset of the CAD, towards the sheet [mm].
        :param sheet_reference: the CAD is this surface of the sheet, of ``thickness_mm``.
        :param faces: choice of faces as JSON, as ``selection`` in the provenance of a tool file.
        :param skip_lost_faces: continue without faces that cannot be read.
        :raises InputError: the model cannot become a tool; the text says what to do.
        """

class Tool:
    """A tool of Nagata patches, Bezier patches or facets [mm]; its normals point to the sheet."""

    def __init__(self, path: str | os.PathLike[str]) -> None: ...
    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the tool file."""
    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def patches(self) -> int:
        """Number of patches."""
    @property
    def shape_error_mm(self) -> float | None:
        """Largest shape error found when it was converted to a tolerance [mm]."""
    @property
    def doubts(self) -> list[str]:
        """Why the tool should not be trusted as it is."""
    def audit(
        self, cad: Cad, *, tol_mm: float | None = None, normal_tol_deg: float | None = None, samples: int = 8
    ) -> Audit:
        """Shape error against its CAD (Eq. 24), at ``samples`` intervals a side of a patch, refined around the worst."""
    def closest(
        self, points: Floats
    ) -> tuple[Floats, Floats, Floats, Counts, Floats, npt.NDArray[np.bool_]]:
        """Closest points; :func:`kanagata.closest` names the arrays."""
    def triangles(self, divisions: int = 4) -> tuple[Floats, Counts]:
        """Points (n, 3) [mm] and triangles (m, 3) for pictures."""

class Audit:
    """The shape error of a tool against its CAD (Eq. 24): positive where the tool lies outside the CAD."""

    @property
    def max_mm(self) -> float: ...
    @property
    def min_mm(self) -> float: ...
    @property
    def rms_mm(self) -> float: ...
    @property
    def worst_mm(self) -> float:
        """The largest magnitude, borders included [mm]."""
    @property
    def normal_max_deg(self) -> float:
        """Largest angle between the normals [degrees]."""
    @property
    def doubts(self) -> list[str]: ...
    def json(self) -> str:
        """The report as JSON text, as ``kanagata audit --json`` writes it."""
    def samples(self) -> tuple[Floats, Floats, Counts]:
        """Points (n, 3) [mm], their shape errors (n,) [mm] and patches (n,)."""

class Material:
    """A material card with its curves: a name of :func:`materials`, or a JSON file."""

    def __init__(self, card: str | os.PathLike[str]) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def source(self) -> str: ...
    def json(self) -> str: ...
    def stress_mpa(self, plastic_strains: Sequence[float] | Floats) -> Floats:
        """Stress in tension along the rolling direction [MPa] at plastic strains."""
    def yield_locus(self) -> Floats:
        """Points (361, 2) of the yield locus in plane stress, rolling and transverse, over the yield stress along rolling."""
    def r_value(self, angle_deg: float) -> float:
        """r value of tension at an angle to the rolling direction."""
    def limit_curve(self, thickness_mm: float) -> Floats | None:
        """Points (n, 2) of the forming limit curve, minor and major logarithmic strain; None for a card without one."""

class Scene:
    def run_to_accuracy(
        self,
        folder: str | os.PathLike[str],
        accuracy: str | None = None,
        watch: Callable[[dict[str, Any]], None] | None = None,
        *,
        wall_s: float | None = None,
        overwrite: bool = False,
        threads: int | None = None,
    ) -> RunRecord: ...
    def __init__(self, path: str | os.PathLike[str], set: Sequence[str] = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def tools(self) -> list[str]: ...
    @staticmethod
    def of_text(text: str, folder: str | os.PathLike[str], set: Sequence[str]) -> Scene: ...
    def json(self) -> str: ...
    def check(self) -> tuple[str, str]: ...
    def run(
        self,
        folder: str | os.PathLike[str],
        watch: Callable[[dict[str, Any]], None] | None = None,
        *,
        restart: bool = False,
        overwrite: bool = False,
        threads: int | None = None,
    ) -> RunRecord: ...

class RunRecord:
    def __init__(self, folder: str | os.PathLike[str]) -> None: ...
    @property
    def folder(self) -> str: ...
    def json(self) -> str: ...
    def history(self) -> dict[str, list[Any]]: ...
    def metrics(self) -> str: ...
    def steps(self) -> list[tuple[float, str]]: ...

def make_tools(path: str | os.PathLike[str], set: list[str] = ...) -> list[tuple[str, Tool, bool, str]]:
    """Makes the tool files of a scene whose tools have ``cad``."""

def materials() -> list[str]:
    """Names of the cards in the package."""
