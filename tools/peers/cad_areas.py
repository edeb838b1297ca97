#!/usr/bin/env python3
"""Many CAD files beside an independent kernel in little time: faces, areas by adaptive quadrature, boxes; no meshes.

  cad_areas.py FOLDER [--program KANAGATA] [--seconds 40]

Every `.igs` and `.stp` file directly in FOLDER. The kernel answers in a child of this process a file, with a limit of
processor time; both answers are kept in FOLDER/answers/. Ours is `kanagata inspect --json` with 2 GB and 60 s. Prints the
files that differ (number of faces, total area by more than 1e-6, box by more than 1e-6 of the diagonal, lost faces,
no answer, more than 2 s) and a line of JSON. Peak memory includes this process's own before the program starts.
"""

import argparse
import json
import os
import pathlib
import resource

import cad_wild
from cad_boxes import ROOT, place, read

LIMIT = 1e-6


def kernel(path):
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Builder
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopoDS import TopoDS_Compound
    faces, whole, builder, areas = read(path), TopoDS_Compound(), BRep_Builder(), []
    builder.MakeCompound(whole)
    for face in faces:
        builder.Add(whole, face)
        sums = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, sums, 1e-6)
        areas.append(sums.Mass())
    if not faces:
        return {"faces": 0, "areas": []}
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(whole, box, False, False)
    return {"faces": len(faces), "areas": areas, "box": [*place(box.CornerMin()), *place(box.CornerMax())]}


def in_a_child(path, out, seconds):
    """The kernel's answer in a file, or an empty object where it crashes or takes too long."""
    out.write_text("{}")
    child = os.fork()
    if child == 0:
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 2))
            out.write_text(json.dumps(kernel(path)))
        finally:
            os._exit(0)
    os.waitpid(child, 0)


def answers(path, folder, program, seconds):
    own, other = folder / f"{path.name}.own.json", folder / f"{path.name}.kernel.json"
    if not own.exists():
        own.write_text(json.dumps(cad_wild.ours(path, program, 60)))
    if not other.exists():
        in_a_child(path, other, seconds)
    return json.loads(own.read_text()), json.loads(other.read_text() or "{}")


def differences(own, other):
    """What is outside the limits, in words."""
    if "model" not in own:
        return ["panic" if own["panic"] else "refused"]
    model, out = own["model"], ["slow"] if own["s"] > 2 else []
    out += [f"{len(model['lost_faces'])} faces lost"] if model["lost_faces"] else []
    if "areas" not in other:
        return [*out, "no answer of the kernel"]
    if model["faces"] != other["faces"]:
        out.append(f"faces {model['faces']} / {other['faces']}")
    if not other["faces"]:
        return out
    area = sum(map(abs, other["areas"]))
    low, high = other["box"][:3], other["box"][3:]
    diagonal = sum((b - a) ** 2 for a, b in zip(low, high)) ** 0.5
    off = {"area": model["area_mm2"] / area - 1, "box": max(abs(a - b) for a, b in zip(model["bbox_mm"], other["box"])) / diagonal}
    return out + [f"{what} {value:.1e}" for what, value in off.items() if abs(value) > LIMIT]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--program", default=str(ROOT / "target" / "release" / "kanagata"))
    parser.add_argument("--seconds", type=int, default=40)
    args = parser.parse_args()
    kept = args.folder / "answers"
    kept.mkdir(exist_ok=True)
    import OCP  # noqa: F401  loaded once, before the children
    figures = {"files": 0, "faces": 0, "agree": 0, "slowest_s": 0.0, "largest_mb": 0.0}
    for path in sorted(p for p in args.folder.iterdir() if p.suffix in (".igs", ".stp")):
        own, other = answers(path, kept, args.program, args.seconds)
        words = differences(own, other)
        figures["files"] += 1
        figures["faces"] += own.get("model", {}).get("faces", 0)
        figures["agree"] += not words
        figures["slowest_s"], figures["largest_mb"] = max(figures["slowest_s"], own["s"]), max(figures["largest_mb"], own["mb"])
        if words:
            print(f"{path.name}: {', '.join(words)}")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
