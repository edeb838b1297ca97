#!/usr/bin/env python3
"""How much of a file's borders has another border near, by an independent kernel's own parameter curves: a second opinion
on free edges, with no sewing in it.

  tools/peers/cad_gaps.py FILE...   files of the corpus (KANAGATA_CORPUS or ../shared/cad); needs tools/peers/cad.py run once

Of every side of every face 11 points over the middle nine tenths are held against the polygons of all other sides, their
chords 0.2 mm long or a 24th of the side. One line a file and multiple of the sewing tolerance of truth.json: the length of
the sides [mm] of which a point has no other side within that distance. Minutes for a file of thousands of sides.
"""

import json
import os
import pathlib
import subprocess
import sys

from cad_boxes import ROOT, VENV, parts, place, read

CHORD = 0.2  # mm
SHARES = (0.5, 1.0, 2.0)  # of the tolerance


def sides(faces):
    """Polygons along all borders, on the surfaces, that are no points."""
    import numpy
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    found = []
    for face in faces:
        for edge in map(TopoDS.Edge, parts(face, TopAbs_ShapeEnum.TopAbs_EDGE)):
            if BRep_Tool.Degenerated_s(edge):
                continue
            curve = BRepAdaptor_Curve(edge, face)
            a, b = curve.FirstParameter(), curve.LastParameter()
            along = lambda n: numpy.array([place(curve.Value(a + (b - a) * k / n)) for k in range(n + 1)])
            found.append(along(max(24, min(int(length(along(24)) / CHORD) + 1, 2000))))
    return found


def length(polygon):
    return sum(((q - p) @ (q - p)) ** 0.5 for p, q in zip(polygon, polygon[1:]))


def distances(points, polygon):
    """From each point to the polygon."""
    import numpy

    start, along = polygon[:-1], polygon[1:] - polygon[:-1]
    squares = numpy.maximum((along * along).sum(1), 1e-300)
    share = numpy.clip(((points[:, None] - start) * along).sum(2) / squares, 0.0, 1.0)
    return numpy.sqrt(((start + along * share[..., None] - points[:, None]) ** 2).sum(2).min(1))


def farthest(polygons, tolerance):
    """For each side, how far the worst of its points is from all other sides."""
    import numpy

    low, high = (numpy.array([getattr(p, end)(0) for p in polygons]) for end in ("min", "max"))
    for k, polygon in enumerate(polygons):
        reach = 2.0 * max(SHARES) * tolerance
        near = numpy.nonzero(((low <= high[k] + reach) & (high >= low[k] - reach)).all(1))[0]
        picked = numpy.linspace(0.05, 0.95, 11) * (len(polygon) - 1)
        points = polygon[numpy.unique(picked.round().astype(int))]
        best = numpy.full(len(points), numpy.inf)
        for other in near[near != k]:
            best = numpy.minimum(best, distances(points, polygons[other]))
        yield best.max()


def main():
    python = VENV / "bin" / "python"
    if pathlib.Path(sys.prefix) != VENV:
        if not python.exists():
            sys.exit("tools/peers/cad_gaps.py: no kernel in .local/venv-peers; run tools/peers/cad.py first")
        if subprocess.run([python, "-c", "import numpy"], stderr=subprocess.DEVNULL).returncode:
            subprocess.run([python, "-m", "pip", "install", "--quiet", "numpy"], check=True)
        os.execv(python, [str(python), __file__, *sys.argv[1:]])
    corpus = pathlib.Path(os.environ.get("KANAGATA_CORPUS", ROOT / ".." / "shared" / "cad"))
    truth = json.loads((corpus / "truth.json").read_text())
    for name in sys.argv[1:]:
        sewn = truth[name]["truth"]["sewn"]
        polygons = sides(read(corpus / name))
        lengths = [length(p) for p in polygons]
        off = list(farthest(polygons, sewn["tol_mm"]))
        for share in SHARES:
            lonely = sum(l for l, o in zip(lengths, off) if o > share * sewn["tol_mm"])
            print(f"{name}: {lonely:.1f} of {sum(lengths):.1f} mm without another border within {share} x {sewn['tol_mm']} mm; "
                  f"the kernel's sewing leaves {sewn['free_edge_length']:.1f} mm free", flush=True)


if __name__ == "__main__":
    main()
