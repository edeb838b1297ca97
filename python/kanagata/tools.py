"""CAD files, tools, audits and materials."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from . import _kanagata
from ._kanagata import Audit, Cad, Material, Tool


class Closest(NamedTuple):
    """Closest points of a tool, one row a point asked for."""

    points: np.ndarray
    """Foot points, (n, 3) [mm]."""
    normals: np.ndarray
    """Unit normals of the tool there, out of the tool, (n, 3)."""
    gaps: np.ndarray
    """Signed distances along the normals, (n,) [mm]; positive where separated."""
    patches: np.ndarray
    """Patches of the foot points, (n,)."""
    parameters: np.ndarray
    """Parameters eta and zeta on these patches, (n, 2)."""
    past_border: np.ndarray
    """The point lies past the border of the tool, (n,) of bool: no contact there."""


def read_cad(path: str | os.PathLike[str]) -> Cad:
    """Reads an IGES or STEP file."""
    return Cad(path)


def read_tool(path: str | os.PathLike[str]) -> Tool:
    """Reads a tool file."""
    return Tool(path)


def convert(cad: Cad | str | os.PathLike[str], output: str | os.PathLike[str] | None = None, **settings: Any) -> Tool:
    """Converts CAD to a tool and, with ``output``, writes its file. Settings as of :meth:`Cad.convert`."""
    made = (cad if isinstance(cad, Cad) else Cad(cad)).convert(**settings)
    if output is not None:
        made.write(output)
    return made


class MadeTool(NamedTuple):
    """A tool of a scene that has CAD."""

    name: str
    """Name in the scene."""
    tool: Tool
    """The tool."""
    is_new: bool
    """The file was made; otherwise it was there, made from the same CAD in the same way."""
    file: str
    """Tool file, relative to the scene."""


def make_tools(scene: str | os.PathLike[str], set: Mapping[str, Any] | None = None) -> list[MadeTool]:
    """Makes the tool files of a scene whose tools have ``cad``, of the faces that the sheet can touch.

    ``set`` gives other values, as ``Scene(path, set)`` has them. Tools that are not those of the scene's file then get files
    of their own; ``{f"tools.{m.name}.file": m.file}`` names them to ``Scene``.
    """
    values = [f"{path}={json.dumps(value)}" for path, value in (set or {}).items()]
    return [MadeTool(*made) for made in _kanagata.make_tools(scene, values)]


def audit(
    tool: Tool | str | os.PathLike[str],
    cad: Cad | str | os.PathLike[str],
    *,
    tol_mm: float | None = None,
    normal_tol_deg: float | None = None,
    samples: int = 8,
) -> Audit:
    """Shape error of a tool against its CAD (Eq. 24); beyond a tolerance it has a doubt."""
    tool = tool if isinstance(tool, Tool) else Tool(tool)
    cad = cad if isinstance(cad, Cad) else Cad(cad)
    return tool.audit(cad, tol_mm=tol_mm, normal_tol_deg=normal_tol_deg, samples=samples)


def closest(tool: Tool, points: Any) -> Closest:
    """Closest point of a tool to each of ``points``, (n, 3) [mm]."""
    return Closest(*tool.closest(np.atleast_2d(np.ascontiguousarray(points, dtype=float))))


def mesh_of(tool: Tool, divisions: int = 4) -> Any:
    """The patches as triangles for pictures, a PyVista mesh with ``divisions`` a side."""
    import pyvista

    points, triangles = tool.triangles(divisions)
    faces = np.column_stack([np.full(len(triangles), 3, dtype=np.int64), triangles.astype(np.int64)])
    return pyvista.PolyData(points, faces.ravel())


def material(card: str | os.PathLike[str]) -> Material:
    """A card by its name in :func:`materials`, or of a JSON file."""
    return Material(card)
