#!/usr/bin/env python3
"""Free borders of tool files beside those of their CAD files, found and measured without anything of kanagata.

  audit_borders.py KANAGATA FOLDER FILE ... [--tol 0.05] [--seconds 30] [--facing X,Y,Z,DEGREES]

Each file is converted, audited and written as Bezier control points, unless FOLDER has the results. Tool: sides of patches
that no other side covers, from control points alone. CAD: edges of the kernel's faces that no other edge and no other face
covers, by place, within 1.5 times the joining tolerance that `inspect` states; seams and degenerate edges (poles) are
none. Curves are polylines within a thousandth of the tolerance. --facing: only faces whose mean normal is within the
angle. FOLDER/audit_borders.md has both distances beside those that `audit` states. Needs cadquery-ocp, NumPy and SciPy.
"""

import argparse
import collections
import json
import math
import pathlib
import subprocess

import numpy as np
from scipy.spatial import cKDTree

from audit_peer import faces_of, kernel_shape

JOINED = 1.5  # edges nearer than this many joining tolerances are one
STEPS = 1000  # longest segments: the size over this
COVERING = (9, 65)  # points of an edge at which other faces are looked for, and where one of them has a face


class Curves:
    """Segments of polylines, each with the number of its owner."""

    def __init__(self, polylines, owners, step):
        fine = [divided(p, step) for p in polylines]
        self.step = step
        self.a = np.concatenate([p[:-1] for p in fine]) if fine else np.zeros((0, 3))
        self.b = np.concatenate([p[1:] for p in fine]) if fine else np.zeros((0, 3))
        self.owner = np.repeat(np.asarray(owners, dtype=int), [len(p) - 1 for p in fine]) if fine else np.zeros(0, int)
        self.tree = cKDTree((self.a + self.b) / 2) if fine else None

    def distances(self, points):
        """Distance of each point to the closest segment."""
        count = min(16, len(self.a))
        middle, index = self.tree.query(points, k=[*range(1, count + 1)])
        found = segment_distance(points[:, None], self.a[index], self.b[index]).min(axis=1)
        # A segment's middle is at most half a step farther than the segment.
        unsure = np.flatnonzero(middle[:, -1] < found + self.step / 2) if count < len(self.a) else []
        for k in unsure:
            near = self.tree.query_ball_point(points[k], found[k] + self.step / 2)
            found[k] = segment_distance(points[k], self.a[near], self.b[near]).min()
        return found

    def covered(self, points, own, within):
        """Whether a curve of another owner passes each point."""
        out = np.zeros(len(points), bool)
        for k, near in enumerate(self.tree.query_ball_point(points, within + self.step / 2)):
            near = [n for n in near if self.owner[n] != own]
            out[k] = bool(near) and segment_distance(points[k], self.a[near], self.b[near]).min() <= within
        return out


def divided(points, step):
    """A polyline with no segment longer than the step."""
    parts = np.maximum(1, np.ceil(np.linalg.norm(np.diff(points, axis=0), axis=1) / step).astype(int))
    ends = np.concatenate([[0], np.cumsum(parts)])
    return np.stack([np.interp(np.arange(ends[-1] + 1), ends, points[:, k]) for k in range(3)], axis=1)


def segment_distance(p, a, b):
    d = b - a
    square = np.maximum((d * d).sum(axis=-1), 1e-300)
    t = np.clip(((p - a) * d).sum(axis=-1) / square, 0.0, 1.0)
    return np.linalg.norm(p - a - t[..., None] * d, axis=-1)


def bezier_polyline(control, fine):
    """A Bezier curve as a polyline: the second differences bound its second derivative."""
    degree = len(control) - 1
    bend = np.linalg.norm(np.diff(control, n=2, axis=0), axis=1).max() * degree * (degree - 1) if degree > 1 else 0.0
    t = np.linspace(0.0, 1.0, 1 + max(4, math.ceil(math.sqrt(bend / (8 * fine)))))
    basis = np.array([math.comb(degree, k) * t**k * (1 - t) ** (degree - k) for k in range(degree + 1)])
    return basis.T @ control


def patch_sides(tool):
    for net in tool["bezier_patches"]:
        a, b = net["degrees"]
        control = np.array(net["points"]).reshape(a + 1, b + 1, 3)
        yield from (control[0], control[-1], control[:, 0], control[:, -1])


def tool_borders(tool, size, fine):
    """Polylines of the sides that one patch alone has, and the number of sides that lie along others (hanging vertices)."""
    groups = collections.defaultdict(list)
    for control in patch_sides(tool):
        line = bezier_polyline(control, fine)
        if np.linalg.norm(line - line[0], axis=1).max() > 1e-9 * size:
            ends = sorted(tuple(np.round(p / (1e-8 * size)).astype(int)) for p in (line[0], line[-1]))
            groups[tuple(ends)].append(line)
    single = [line for lines in groups.values() for line in lines if alone(line, lines, 1e-6 * size + 3 * fine)]
    curves = Curves(single, range(len(single)), size / STEPS)
    free = [line for k, line in enumerate(single) if not curves.covered(line[inner(line, 3)], k, 1e-6 * size + 3 * fine).all()]
    return free, len(single) - len(free)


def alone(line, lines, within):
    """No other side between the same ends takes the same course."""
    others = [other for other in lines if other is not line]
    return all(segment_distance(line[len(line) // 2], o[:-1], o[1:]).min() > within for o in others)


def edges_of(face):
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS
    explorer = TopExp_Explorer(face, TopAbs_ShapeEnum.TopAbs_EDGE)
    while explorer.More():
        edge = TopoDS.Edge(explorer.Current())
        if not BRep_Tool.Degenerated_s(edge) and not BRep_Tool.IsClosed_s(edge, TopoDS.Face(face)):
            yield edge
        explorer.Next()


def edge_polyline(edge, fine):
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_TangentialDeflection
    points = GCPnts_TangentialDeflection(BRepAdaptor_Curve(edge), 0.2, fine, 3, 1e-9, 1e-9)
    place = lambda p: (p.X(), p.Y(), p.Z())
    return np.array([place(points.Value(k + 1)) for k in range(points.NbPoints())])


def within_another(faces, own, point, within):
    """Whether another face contains the point."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt
    vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*map(float, point))).Vertex()
    for k, (face, low, high) in enumerate(faces):
        if k != own and (point >= low - within).all() and (point <= high + within).all():
            found = BRepExtrema_DistShapeShape(vertex, face)
            if found.IsDone() and found.Value() <= within:
                return True
    return False


def covered_by_faces(faces, own, line, free, within):
    """Whether another face contains each point of an edge; its ends are not asked for, neighbours are there."""
    inside = np.zeros(len(line), bool)
    for count in COVERING:
        tests = inner(line, count)
        found = np.array([free[t] and within_another(faces, own, line[t], within) for t in tests])
        inside = found[np.abs(np.arange(len(line))[:, None] - tests).argmin(axis=1)]
        if not found.any():
            break
    return inside


def free_runs(line, free):
    """The pieces of a polyline whose points are free."""
    pieces = np.split(np.arange(len(line)), np.flatnonzero(np.diff(free.astype(int))) + 1)
    return [line[piece] for piece in pieces if len(piece) > 1 and free[piece[0]]]


def cad_borders(faces, size, fine, within):
    """Polylines of the edges, or of their pieces, at which one face ends and no other goes on; and how many edges."""
    found = [(k, divided(edge_polyline(edge, fine), size / STEPS)) for k, (face, _, _) in enumerate(faces) for edge in edges_of(face)]
    curves = Curves([line for _, line in found], range(len(found)), size / STEPS)
    out, count = [], 0
    for k, (own, line) in enumerate(found):
        if curves.covered(line[inner(line, COVERING[0])], k, within).all():
            continue
        free = ~curves.covered(line, k, within)
        runs = free_runs(line, spread(free & ~covered_by_faces(faces, own, line, free, within)))
        out += runs
        count += bool(runs)
    return out, count


def inner(line, count):
    """Points of a polyline without its ends."""
    return np.unique(np.linspace(0, len(line) - 1, count + 2).astype(int)[1:-1])


def spread(free):
    """Ends of an edge touch its neighbours: a point beside a free one counts."""
    return free | np.append(free[1:], False) | np.append(False, free[:-1])


def farthest(of, to, step):
    """Largest distance of points of polylines to others, and where."""
    if not of or not to:
        return None, None
    points = np.concatenate(of)
    found = Curves(to, range(len(to)), step).distances(points)
    return float(found.max()), [round(float(x), 4) for x in points[int(np.argmax(found))]]


def mean_normal(face):
    """Integral of the normal over a face, and its area, by a mesh."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS
    BRepMesh_IncrementalMesh(face, 0.01, True, 0.1, False)
    place = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(TopoDS.Face(face), place)
    nodes = [mesh.Node(k + 1).Transformed(place.Transformation()) for k in range(mesh.NbNodes())]
    at = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
    a, b, c = (at[np.array([mesh.Triangle(k + 1).Get() for k in range(mesh.NbTriangles())])[:, n] - 1] for n in range(3))
    normals = np.cross(b - a, c - a) / 2
    turned = -1 if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else 1
    return turned * normals.sum(axis=0), np.linalg.norm(normals, axis=1).sum()


def facing(faces, direction, angle):
    """The faces whose mean normal is within an angle [degrees] of a direction; faces that close on themselves have none."""
    out = []
    for face in faces:
        normal, area = mean_normal(face[0])
        size = np.linalg.norm(normal)
        if size > 1e-3 * area and normal @ direction >= math.cos(math.radians(angle)) * size * np.linalg.norm(direction):
            out.append(face)
    return out


def measure(tool, faces, tol, joined):
    """Both distances between the borders of a Bezier tool file and of the kernel's faces; edges `joined` apart are one."""
    low, high = np.min([f[1] for f in faces], axis=0), np.max([f[2] for f in faces], axis=0)
    size, fine = float(np.linalg.norm(high - low)), tol / 1000
    ours, hanging = tool_borders(tool, size, fine)
    theirs, edges = cad_borders(faces, size, fine, max(joined, 3 * fine))
    to_cad, at_tool = farthest(ours, theirs, size / STEPS)
    to_tool, at_cad = farthest(theirs, ours, size / STEPS)
    return dict(sides=len(ours), hanging=hanging, edges=edges, length=sum(length(p) for p in theirs), tool_to_cad=to_cad,
                tool_at=at_tool, cad_to_tool=to_tool, cad_at=at_cad)


def length(line):
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def results(args, path):
    """Tool as control points, the audit's borders and the joining tolerance."""
    made, net, audit = (args.folder / f"{path.name}.{kind}.json" for kind in ("tool", "bezier", "audit"))
    chosen = [f"--facing={args.facing}"] if args.facing else []
    steps = [(made, ["convert", path, "-o", made, "--tol", f"{args.tol}mm", "--time", f"{args.seconds}s", *chosen]),
             (net, ["convert", made, "-o", net, "--to", "bezier"]), (audit, ["audit", made, "--cad", path, "--json", audit, "-q"])]
    for file, step in steps:
        if not file.exists():
            said = subprocess.run([args.kanagata, *step], capture_output=True, text=True, timeout=300).stderr.strip()
        if not file.exists():
            raise ValueError(said.splitlines()[-1][:120] if said else "not converted")
    found = subprocess.run([args.kanagata, "inspect", "--json", path], capture_output=True, text=True, timeout=60).stdout
    return json.loads(net.read_text()), json.loads(audit.read_text())["borders"], json.loads(found)["join_tolerance_mm"]


def row(args, path):
    tool, stated, joined = results(args, path)
    faces = faces_of(kernel_shape(path))
    if args.facing:
        *direction, angle = map(float, args.facing_numbers)
        faces = facing(faces, np.array(direction), angle)
    if not faces:
        raise ValueError("the kernel has no faces")
    found = measure(tool, faces, args.tol, JOINED * joined)
    return dict(file=path.name, faces=len(faces), stated=stated, **found)


def agrees(r, fine):
    """Both distances are the stated ones, within twice the polylines' accuracy or 1 %, or both have no borders."""
    if (r["edges"] > 0) != (r["stated"]["cad_edges"] > 0):
        return False
    pairs = ((r["tool_to_cad"], r["stated"]["tool_to_cad_mm"]), (r["cad_to_tool"], r["stated"]["cad_to_tool_mm"]))
    return all(abs((found or 0.0) - stated) <= max(2 * fine, 0.01 * stated) for found, stated in pairs)


def line_of(r, fine):
    stated, show = r["stated"], lambda x: "-" if x is None else f"{x:.4f}"
    return (f"| {r['file']} | {r['faces']} | {stated['tool_sides']} / {r['sides']} | {stated['cad_edges']} / {r['edges']} | "
            f"{show(stated['tool_to_cad_mm'])} / {show(r['tool_to_cad'])} | {show(stated['cad_to_tool_mm'])} / {show(r['cad_to_tool'])} | "
            f"{'' if agrees(r, fine) else 'differs'} |")


def report(rows, fine):
    judged = [r for r in rows if "stated" in r]
    closed = [r["file"] for r in judged if not (r["sides"] or r["edges"] or r["stated"]["tool_sides"] or r["stated"]["cad_edges"])]
    opened = [r for r in judged if r["file"] not in closed]
    lines = ["| file | faces | sides, stated / found | edges | tool to CAD [mm] | CAD to tool [mm] | |", "|---|---|---|---|---|---|---|"]
    lines += [line_of(r, fine) for r in opened] + [f"- {r['file']}: {r['why']}" for r in rows if "why" in r]
    lines += ["", f"{len(judged)} judged, {len(closed)} closed in both, {sum(agrees(r, fine) for r in opened)} of {len(opened)} with borders agree"]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kanagata", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("files", nargs="+", type=pathlib.Path)
    parser.add_argument("--tol", type=float, default=0.05)
    parser.add_argument("--seconds", type=int, default=30)
    parser.add_argument("--facing", help="X,Y,Z,DEGREES")
    args = parser.parse_args()
    args.facing_numbers = args.facing.split(",") if args.facing else []
    args.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for path in args.files:
        try:
            rows.append(row(args, path))
        except (ValueError, subprocess.TimeoutExpired) as refused:
            rows.append(dict(file=path.name, why=str(refused)[:120]))
        (args.folder / "audit_borders.json").write_text(json.dumps(rows, indent=1))
    (args.folder / "audit_borders.md").write_text(report(rows, args.tol / 1000))
    print(report(rows, args.tol / 1000).splitlines()[-1])


if __name__ == "__main__":
    main()
