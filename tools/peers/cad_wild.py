#!/usr/bin/env python3
"""A folder of CAD files that nobody here tuned to: our reader beside an independent kernel (Open CASCADE), file by file.

  tools/peers/cad_wild.py FOLDER [--word WORD] [--seconds S] [--jobs N] [--program KANAGATA]

Every `.igs` and `.stp` file directly in FOLDER. The kernel runs in a process of its own a file, with a limit of S seconds
(120); what it says is kept in FOLDER/truth.json, in the form of the corpus's (hence `KANAGATA_CORPUS=FOLDER cad_report WORD`
compares face by face), and asked for once only. Ours is `kanagata inspect --json`, with the same limit and 2 GB of memory.
Prints the files that differ, and as the last line one JSON object. Free edges: what STEP files do not share among faces;
ours joins by place besides, and only more free edges than the kernel's count as a difference.
"""

import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

from cad_boxes import ROOT, VENV, parts, place, read

AREA, BOX = 1e-5, 1e-6  # what is allowed, relative; the box of the diagonal
SLOW_S, LARGE_MB = 2.0, 256.0
MEMORY = 2 << 30


def kernel(path):
    """What the kernel says of a file, as in the corpus's truth.json."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Builder, BRep_Tool
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.GProp import GProp_GProps
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS_Compound

    faces = read(path)
    whole, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(whole)
    for face in faces:
        builder.Add(whole, face)
    found = {"faces": len(faces), "trust": "checked" if faces else "no faces", "face_list": []}
    if not faces:
        return found
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(whole, box, False, False)
    found["bbox_mm"] = [*place(box.CornerMin()), *place(box.CornerMax())]
    diagonal = sum((found["bbox_mm"][k + 3] - found["bbox_mm"][k]) ** 2 for k in range(3)) ** 0.5
    BRepMesh_IncrementalMesh(whole, 1e-4 * diagonal, False, 0.2, False)
    for face in faces:
        areas = {}
        for name, call in (("area", (1e-6,)), ("gauss", ())):
            sums = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, sums, *call)
            areas[name] = sums.Mass()
            c = sums.CentreOfMass()
            areas.setdefault("centroid", [c.X(), c.Y(), c.Z()])
        mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
        areas["mesh_area"] = meshed(mesh) if mesh else None
        found["face_list"].append(areas)
    sums = {k: sum(abs(f[k] or 0.0) for f in found["face_list"]) for k in ("area", "gauss", "mesh_area")}
    found |= {"area_truth_mm2": sums["area"], "area_gauss_mm2": sums["gauss"], "area_mesh_mm2": sums["mesh_area"]}
    found["free_edge_length"] = free_length(whole) if path.suffix == ".stp" else None
    return found


def meshed(mesh):
    """Area of a triangulation."""
    nodes = [mesh.Node(k + 1) for k in range(mesh.NbNodes())]
    total = 0.0
    for k in range(mesh.NbTriangles()):
        a, b, c = (nodes[n - 1] for n in mesh.Triangle(k + 1).Get())
        u, v = (b.X() - a.X(), b.Y() - a.Y(), b.Z() - a.Z()), (c.X() - a.X(), c.Y() - a.Y(), c.Z() - a.Z())
        cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        total += 0.5 * sum(x * x for x in cross) ** 0.5
    return total


def free_length(shape):
    """Length of the edges that one face alone uses once."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    edges = [TopoDS.Edge(e) for e in parts(shape, TopAbs_ShapeEnum.TopAbs_EDGE)]
    edges = [e for e in edges if not BRep_Tool.Degenerated_s(e)]
    uses, first = collections.Counter(), {}
    for e in edges:
        key = (e.TShape(), e.Location().HashCode())
        uses[key] += 1
        first[key] = e
    total = 0.0
    for key, count in uses.items():
        if count == 1:
            sums = GProp_GProps()
            BRepGProp.LinearProperties_s(first[key], sums)
            total += sums.Mass()
    return total


def asked(path, seconds):
    try:
        call = [sys.executable, __file__, "--kernel", path]
        done = subprocess.run(call, capture_output=True, text=True, timeout=seconds)
        return json.loads(done.stdout) if done.returncode == 0 else {"trust": "kernel failed", "faces": 0}
    except (subprocess.TimeoutExpired, json.JSONDecodeError):
        return {"trust": "kernel without an answer", "faces": 0}


def ours(path, program, seconds):
    """What `kanagata inspect --json` says, seconds and memory; or why it says nothing."""
    def limits():
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 2))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))

    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as said:
        start = time.perf_counter()
        process = subprocess.Popen([program, "inspect", "--json", path], stdout=out, stderr=said, preexec_fn=limits)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        row = {"wall_s": time.perf_counter() - start, "s": used.ru_utime + used.ru_stime, "mb": used.ru_maxrss / 1024,
               "code": process.returncode}
        out.seek(0), said.seek(0)
        text, error = out.read(), said.read().strip()
    if row["code"] == 0:
        return row | {"model": json.loads(text)}
    return row | {"panic": row["code"] not in (1, 2), "refused": error[-300:]}


def compare(path, truth, own):
    """A row: figures and the list of what is outside the limits."""
    row = {"file": path.name, "kernel_faces": truth["faces"], "trust": truth["trust"], "s": own["s"], "mb": own["mb"]}
    differs = [w for w, bad in (("slow", own["s"] > SLOW_S), ("memory", own["mb"] > LARGE_MB)) if bad]
    if "model" not in own:
        what = "panic" if own["panic"] else "refused"
        return row | {"differs": [what, *differs], "why": own["refused"]}
    model = own["model"]
    row["faces"] = model["faces"]
    row["skipped"] = sum(d["code"] == "face-skipped" for d in model["diagnostics"])
    if row["skipped"]:
        differs.append("skipped")
    if truth["trust"] not in ("checked", "no faces"):
        return row | {"differs": differs}
    if row["faces"] != truth["faces"]:
        differs.append("faces")
    # The kernel reads nothing of some borders that it writes (a whole ball as a trimmed surface).
    if not truth["faces"] or not row["faces"] or not truth["area_truth_mm2"]:
        return row | {"differs": differs}
    row["area_off"] = model["area_mm2"] / truth["area_truth_mm2"] - 1.0
    row["mesh_off"] = truth["area_mesh_mm2"] / truth["area_truth_mm2"] - 1.0
    row["gauss_off"] = truth["area_gauss_mm2"] / truth["area_truth_mm2"] - 1.0
    a, b = model["bbox_mm"], truth["bbox_mm"]
    diagonal = sum((b[k + 3] - b[k]) ** 2 for k in range(3)) ** 0.5
    row["box_off"] = max(abs(x - y) for x, y in zip(a, b)) / diagonal
    differs += [w for w, bad in (("area", abs(row["area_off"]) > AREA), ("box", row["box_off"] > BOX)) if bad]
    if truth.get("free_edge_length") is not None:
        row["free"] = [model["free_edge_length_mm"], truth["free_edge_length"]]
        # Ours joins by place as well: fewer free edges than the file itself joins are no fault.
        if row["free"][0] - row["free"][1] > 0.01 * max(row["free"][1], 1e-4 * diagonal):
            differs.append("free edges")
    return row | {"differs": differs}


def line(r):
    show = lambda key, form: form.format(r[key]) if key in r else "-"
    free = "{:.4g} / {:.4g}".format(*r["free"]) if "free" in r else "-"
    return "| " + " | ".join([
        r["file"], f"{r.get('faces', '-')} / {r['kernel_faces']}", show("area_off", "{:.1e}"), show("gauss_off", "{:.1e}"),
        show("mesh_off", "{:.1e}"), show("box_off", "{:.1e}"), free, f"{r['s']:.2f}", f"{r['mb']:.0f}",
        ", ".join(r["differs"]) + (": " + re.sub(r"\s+", " ", r["why"]) if "why" in r else "")]) + " |"


def main():
    if sys.argv[1:2] == ["--kernel"]:
        print(json.dumps(kernel(pathlib.Path(sys.argv[2]))))
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--word", default="")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--program", default=str(ROOT / "target" / "release" / "kanagata"))
    arguments = parser.parse_args()
    python = VENV / "bin" / "python"
    if pathlib.Path(sys.prefix) != VENV:
        if not python.exists():
            sys.exit("tools/peers/cad_wild.py: no kernel in .local/venv-peers; run tools/peers/cad.py first")
        os.execv(python, [str(python), __file__, *sys.argv[1:]])
    files = sorted(p for p in arguments.folder.iterdir() if p.suffix in (".igs", ".stp") and arguments.word in p.name)
    known = arguments.folder / "truth.json"
    truths = json.loads(known.read_text()) if known.exists() else {}
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        missing = [p for p in files if p.name not in truths]
        for path, truth in zip(missing, pool.map(lambda p: asked(p, arguments.seconds), missing)):
            truths[path.name] = {"truth": truth}
            known.write_text(json.dumps(truths))
    rows = [compare(p, truths[p.name]["truth"], ours(p, arguments.program, arguments.seconds)) for p in files]
    print("| file | faces, ours / kernel's | area off | its Gauss | its mesh | box off | free edges [mm], ours / kernel's | s | MB | differs |")
    print("|" + "---|" * 10)
    for row in rows:
        if row["differs"]:
            print(line(row))
    figures = {"files": len(rows), "agree": sum(not r["differs"] and r["trust"] == "checked" for r in rows),
               "no_faces": sum(not r["differs"] and r["trust"] == "no faces" for r in rows),
               "kernel_failed": sum(r["trust"].startswith("kernel") for r in rows),
               "slowest_s": max(r["s"] for r in rows), "largest_mb": max(r["mb"] for r in rows)}
    figures |= collections.Counter(d for r in rows for d in r["differs"])
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
