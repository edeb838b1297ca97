#!/usr/bin/env python3
"""Audits tool files with another kernel: points on their patches, computed here, against the closest points of OpenCASCADE.

  audit_peer.py KANAGATA FOLDER [FILE ...] [--tol 0.05] [--points 400]

Each file (default: the CAD files of fixtures/ and those given) is converted to the tolerance and written as Bezier control
points too, which has no loss (Eq. 13 to 15). Bernstein polynomials are summed by NumPy; nothing of kanagata evaluates,
searches or measures here. Points: a fixed grid on each patch, thinned to --points for a file. The kernel reads the CAD file
by itself; FOLDER/audit_peer.md compares the largest distance with the stated shape error. Needs cadquery-ocp and NumPy.
"""

import argparse
import json
import math
import pathlib
import subprocess

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
GRID = np.array([0.0, 0.11, 0.29, 0.5, 0.71, 0.89, 1.0])


def kernel_shape(path):
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.IGESControl import IGESControl_Reader
    from OCP.STEPControl import STEPControl_Reader
    reader = IGESControl_Reader() if path.suffix.lower() in (".igs", ".iges") else STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise ValueError("the kernel does not read it")
    reader.TransferRoots()
    return reader.OneShape()


def faces_of(shape):
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    found, explorer = [], TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        box = Bnd_Box()
        BRepBndLib.Add_s(explorer.Current(), box)
        low, high = box.CornerMin(), box.CornerMax()
        found.append((explorer.Current(), np.array([low.X(), low.Y(), low.Z()]), np.array([high.X(), high.Y(), high.Z()])))
        explorer.Next()
    return found


def projected(face, point):
    """Distance of a point to its projections on the surface of a face, of those within its borders."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepClass import BRepClass_FaceClassifier
    from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
    from OCP.TopAbs import TopAbs_State
    from OCP.TopoDS import TopoDS
    from OCP.gp import gp_Pnt, gp_Pnt2d
    face = TopoDS.Face_s(face) if hasattr(TopoDS, "Face_s") else TopoDS.Face(face)
    found = GeomAPI_ProjectPointOnSurf(gp_Pnt(*map(float, point)), BRep_Tool.Surface_s(face))
    best = math.inf
    for k in range(1, found.NbPoints() + 1):
        place = gp_Pnt2d(*found.Parameters(k))
        if BRepClass_FaceClassifier(face, place, 1e-7).State() != TopAbs_State.TopAbs_OUT:
            best = min(best, found.Distance(k))
    return best


def distance(faces, point):
    """Distance of a point to the closest of the kernel's trimmed faces. The kernel's distance of a vertex and a face misses
    feet inside faces of tilted IGES files, so that projections on the surfaces count too."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt
    vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*map(float, point))).Vertex()
    to_box = [float(np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0.0))) for _, low, high in faces]
    best = math.inf
    for k in np.argsort(to_box):
        if to_box[k] >= best:
            break
        found = BRepExtrema_DistShapeShape(vertex, faces[k][0])
        if found.IsDone():
            best = min(best, found.Value())
        best = min(best, projected(faces[k][0], point))
    return best


def bernstein(degree, t):
    return np.array([math.comb(degree, k) * t**k * (1 - t) ** (degree - k) for k in range(degree + 1)])


def points_of(tool, count):
    """Points on the patches of a Bezier tool file."""
    out = []
    for net in tool["bezier_patches"]:
        a, b = net["degrees"]
        control = np.array(net["points"]).reshape(a + 1, b + 1, 3)
        out.append(np.einsum("iu,jv,ijk->uvk", bernstein(a, GRID), bernstein(b, GRID), control).reshape(-1, 3))
    points = np.concatenate(out)
    return points[:: max(1, len(points) // count)]


def audit(kanagata, folder, path, tol, count):
    made, net = folder / f"{path.name}.tool.json", folder / f"{path.name}.bezier.json"
    steps = [[kanagata, "convert", path, "-o", made, "--tol", f"{tol}mm", "--time", "60s"], [kanagata, "convert", made, "-o", net, "--to", "bezier"]]
    for step in steps:
        done = subprocess.run(step, capture_output=True, text=True, timeout=300)
        if done.returncode not in (0, 1):
            return dict(file=path.name, why=done.stderr.strip().splitlines()[-1][:120] if done.stderr.strip() else f"exit {done.returncode}")
    stated = json.loads(made.read_text())["provenance"].get("shape_error_mm")
    tool = json.loads(net.read_text())
    faces = faces_of(kernel_shape(path))
    points = points_of(tool, count)
    found = np.array([distance(faces, point) for point in points])
    if not np.isfinite(found).all():
        return dict(file=path.name, why=f"the kernel finds no closest point for {np.isinf(found).sum()} of {len(found)} points")
    worst = points[int(np.argmax(found))]
    return dict(file=path.name, faces=len(faces), patches=len(tool["bezier_patches"]), points=len(points), stated=stated,
                largest=float(found.max()), p99=float(np.quantile(found, 0.99)), at=[round(float(x), 3) for x in worst])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kanagata", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("files", nargs="*", type=pathlib.Path)
    parser.add_argument("--tol", type=float, default=0.05)
    parser.add_argument("--points", type=int, default=400)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    files = args.files or sorted((ROOT / "fixtures/forming").glob("*.*p")) + sorted((ROOT / "fixtures/forming").glob("*.igs"))
    rows = []
    for path in files:
        try:
            row = audit(args.kanagata.resolve(), args.folder.resolve(), path.resolve(), args.tol, args.points)
        except (ValueError, subprocess.TimeoutExpired) as refused:
            row = dict(file=path.name, why=str(refused)[:120])
        rows.append(row)
        print(row, flush=True)
    lines = ["| file | faces | patches | points | stated [mm] | largest found [mm] | found over stated |", "|---|---|---|---|---|---|---|"]
    judged = [r for r in rows if "largest" in r]
    for r in judged:
        lines.append(f"| {r['file']} | {r['faces']} | {r['patches']} | {r['points']} | {r['stated']:.5f} | {r['largest']:.5f} | {r['largest'] / max(r['stated'], 1e-9):.3f} |")
    lines += [f"- {r['file']}: {r['why']}" for r in rows if "why" in r]
    over = [r["file"] for r in judged if r["largest"] > 1.02 * r["stated"] + 1e-6]
    lines.append(f"\n{len(judged)} judged, {len(over)} above the stated error by more than 2 %: {', '.join(over) or 'none'}")
    (args.folder / "audit_peer.md").write_text("\n".join(lines) + "\n")
    (args.folder / "audit_peer.json").write_text(json.dumps(rows, indent=1))
    print(lines[-1])


if __name__ == "__main__":
    main()
