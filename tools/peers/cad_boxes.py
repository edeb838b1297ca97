#!/usr/bin/env python3
"""The box that truth.json has of a file beside the box of the same kernel's own triangulation, whose nodes lie on the
faces: where a node lies beyond the box, the box is too small.

  tools/peers/cad_boxes.py FILE...   files of the corpus (KANAGATA_CORPUS or ../shared/cad); needs tools/peers/cad.py run once
"""

import json
import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
VENV = ROOT / ".local" / "venv-peers"


def nodes(path, diagonal):
    """Smallest and largest coordinates of the nodes of a triangulation to 2e-5 of the diagonal."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    Message.DefaultMessenger_s().ChangePrinters().Clear()
    reader = IGESControl_Reader() if path.suffix == ".igs" else STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    BRepMesh_IncrementalMesh(shape, 2e-5 * diagonal, False, 0.05, False)
    low, high = [float("inf")] * 3, [float("-inf")] * 3
    faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while faces.More():
        place = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(TopoDS.Face(faces.Current()), place)
        for k in range(1, mesh.NbNodes() + 1 if mesh is not None else 1):
            p = mesh.Node(k).Transformed(place.Transformation())
            for axis, x in enumerate((p.X(), p.Y(), p.Z())):
                low[axis], high[axis] = min(low[axis], x), max(high[axis], x)
        faces.Next()
    return low, high


def main():
    python = VENV / "bin" / "python"
    if pathlib.Path(sys.prefix) != VENV:
        if not python.exists():
            sys.exit("tools/peers/cad_boxes.py: no kernel in .local/venv-peers; run tools/peers/cad.py first")
        os.execv(python, [str(python), __file__, *sys.argv[1:]])
    corpus = pathlib.Path(os.environ.get("KANAGATA_CORPUS", ROOT / ".." / "shared" / "cad"))
    truth = json.loads((corpus / "truth.json").read_text())
    for name in sys.argv[1:]:
        box = truth[name]["truth"]["bbox_mm"]
        diagonal = sum((box[k + 3] - box[k]) ** 2 for k in range(3)) ** 0.5
        low, high = nodes(corpus / name, diagonal)
        for axis in range(3):
            for end, there, found, beyond in (("min", box[axis], low[axis], box[axis] - low[axis]),
                                              ("max", box[axis + 3], high[axis], high[axis] - box[axis + 3])):
                print(f"{name} {'xyz'[axis]} {end}: box {there:.6f}, nodes {found:.6f}, beyond by {beyond / diagonal:.2e} of the diagonal")


if __name__ == "__main__":
    main()
