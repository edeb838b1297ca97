#!/usr/bin/env python3
"""How far the faces of a file reach, by an independent kernel's own surfaces, parameter curves and its own verdict on
what is inside a face: a second opinion on the box that truth.json has of it, which is wrong where a point of a face
lies beyond it, or where it reaches farther than any border and any point inside.

  tools/peers/cad_boxes.py FILE...   files of the corpus (KANAGATA_CORPUS or ../shared/cad); needs tools/peers/cad.py run once

One JSON object a file: the box of all faces [mm], found by climbing along borders (on the surface) and, from a grid of
points that the kernel calls inside, along the coordinate axes.
"""

import json
import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
VENV = ROOT / ".local" / "venv-peers"
BORDER = 200  # samples of a side
GRID = 60  # samples of a face, each way
NEAR = 1e-3  # of the diagonal: samples worth climbing from
AROUND = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y]


def read(path):
    """All faces of a file."""
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    Message.DefaultMessenger_s().ChangePrinters().Clear()
    reader = IGESControl_Reader() if path.suffix == ".igs" else STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return [TopoDS.Face(f) for f in parts(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_FACE)]


def parts(shape, kind):
    from OCP.TopExp import TopExp_Explorer

    explorer, found = TopExp_Explorer(shape, kind), []
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def place(p):
    return (p.X(), p.Y(), p.Z())


def highest(f, a, b):
    """Largest value of a function about the best of 17 samples, zoomed in on."""
    for _ in range(14):
        ts = [a + (b - a) * k / 16 for k in range(17)]
        values = [f(t) for t in ts]
        k = values.index(max(values))
        a, b = ts[max(k - 1, 0)], ts[min(k + 1, 16)]
    return values[k]


class Reach:
    """Largest signed coordinates found so far."""

    def __init__(self, diagonal):
        self.most = {(axis, sign): float("-inf") for axis in range(3) for sign in (1, -1)}
        self.diagonal = diagonal

    def worth(self, way, value):
        return value > self.most[way] - NEAR * self.diagonal

    def take(self, way, value):
        self.most[way] = max(self.most[way], value)

    def box(self):
        return [-self.most[axis, -1] for axis in range(3)] + [self.most[axis, 1] for axis in range(3)]


def border(face, reach):
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    for edge in parts(face, TopAbs_ShapeEnum.TopAbs_EDGE):
        curve = BRepAdaptor_Curve(TopoDS.Edge(edge), face)  # the parameter curve's image
        a, b = curve.FirstParameter(), curve.LastParameter()
        at = lambda k: a + (b - a) * min(max(k, 0), BORDER) / BORDER
        samples = [place(curve.Value(at(k))) for k in range(BORDER + 1)]
        for axis, sign in reach.most:
            k = max(range(BORDER + 1), key=lambda k: sign * samples[k][axis])
            if reach.worth((axis, sign), sign * samples[k][axis]):
                value = lambda t: sign * place(curve.Value(t))[axis]
                reach.take((axis, sign), highest(value, at(k - 1), at(k + 1)))


def inside(face, reach):
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepClass import BRepClass_FaceClassifier
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_State
    from OCP.gp import gp_Pnt2d

    surface, judge = BRepAdaptor_Surface(face), BRepClass_FaceClassifier()
    low_u, high_u, low_v, high_v = BRepTools.UVBounds_s(face)
    du, dv = (high_u - low_u) / GRID, (high_v - low_v) / GRID

    def within(u, v):
        judge.Perform(face, gp_Pnt2d(u, v), 1e-9)
        return low_u <= u <= high_u and low_v <= v <= high_v and judge.State() == TopAbs_State.TopAbs_IN

    grid = [(low_u + du * i, low_v + dv * j) for i in range(GRID + 1) for j in range(GRID + 1)]
    samples = [(place(surface.Value(u, v)), u, v) for u, v in grid]
    for axis, sign in reach.most:
        value = lambda u, v: sign * place(surface.Value(u, v))[axis]
        for p, u, v in sorted(samples, key=lambda s: -sign * s[0][axis])[:40]:
            if not reach.worth((axis, sign), sign * p[axis]):
                break
            if within(u, v):
                reach.take((axis, sign), climb(value, within, (u, v), (du, dv)))
                break


def climb(value, within, start, step):
    """The value at the end of a walk from a point inside that only rises and stays inside."""
    (u, v), (du, dv) = start, step
    best = value(u, v)
    for _ in range(60):
        moved = False
        for x, y in AROUND:
            next_u, next_v = u + x * du, v + y * dv
            if within(next_u, next_v) and value(next_u, next_v) > best:
                u, v, best, moved = next_u, next_v, value(next_u, next_v), True
        if not moved:
            du, dv = du / 2, dv / 2
    return best


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
        reach = Reach(sum((box[k + 3] - box[k]) ** 2 for k in range(3)) ** 0.5)
        for face in read(corpus / name):
            border(face, reach)
            inside(face, reach)
        print(json.dumps({"file": name, "box": reach.box()}), flush=True)


if __name__ == "__main__":
    main()
