#!/usr/bin/env python3
"""Our CAD reader and closest points beside an independent kernel's (Open CASCADE, `cadquery-ocp-novtk` from PyPI).

  tools/peers/cad.py [--points N] [--seconds S] [WORD]   files of the corpus whose names hold WORD

The corpus is KANAGATA_CORPUS or ../shared/cad. The kernel is installed into .local/venv-peers on the first run. Both
sides run on one thread, one after the other, file by file. A file's points end when the kernel has searched S seconds
(10). Prints a table and, as the last line, one JSON object; its figures of closest points are over all files, and over
those that the corpus's truth.json calls checked.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
VENV = ROOT / ".local" / "venv-peers"
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
LARGE = 200_000  # bytes
SAME = 1e-7  # share of the diagonal
HEAD = ("file", "faces", "read [s], ours / kernel's", "ratio", "peak [MB]", "points", "same", "ours larger",
        "largest excess, deficit / diagonal", "closest [us], ours / kernel's", "ratio")


def enter_venv():
    """Runs this script again under the Python that has the kernel."""
    python = VENV / "bin" / "python"
    if pathlib.Path(sys.prefix) == VENV:
        return
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", VENV], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "cadquery-ocp-novtk"], check=True)
    os.execv(python, [str(python), __file__, *sys.argv[1:]])


def kernel_read(path):
    """A compound of the file's faces, how many, and the seconds that reading and transfer took."""
    from OCP.BRep import BRep_Builder
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS_Compound

    Message.DefaultMessenger_s().ChangePrinters().Clear()  # it talks on standard output
    start = time.perf_counter()
    reader = IGESControl_Reader() if path.suffix == ".igs" else STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    seconds = time.perf_counter() - start
    compound, builder, count = TopoDS_Compound(), BRep_Builder(), 0
    builder.MakeCompound(compound)
    if not shape.IsNull():
        faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
        while faces.More():
            builder.Add(compound, faces.Current())
            faces.Next()
            count += 1
    return compound, count, seconds


def kernel_distances(compound, points, limit_s):
    """Distances of the points, as many as fit into the time, and seconds for each point."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt

    found = []
    search = BRepExtrema_DistShapeShape()
    search.LoadS2(compound)
    start = time.perf_counter()
    for p in points:
        search.LoadS1(BRepBuilderAPI_MakeVertex(gp_Pnt(*p)).Vertex())
        search.Perform()
        found.append(search.Value() if search.IsDone() else float("nan"))
        if time.perf_counter() - start > limit_s:
            break
    return found, (time.perf_counter() - start) / max(len(found), 1)


def compare(path, checked, arguments):
    command = [arguments.program, path, str(arguments.points)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        return {"file": path.name, "refused": done.stderr.strip()}
    own = json.loads(done.stdout)
    compound, faces, read_s = kernel_read(path)
    row = {"file": path.name, "checked": checked, "bytes": path.stat().st_size, "faces": [own["faces"], faces],
           "read_s": [own["read_s"], read_s], "read_ratio": read_s / own["read_s"],
           "peak_mb": own["peak_mb"]}
    if not own["points"] or not faces:
        return row
    found, each_s = kernel_distances(compound, own["points"], arguments.seconds)
    allowed = SAME * own["diagonal_mm"]
    off = [a - b for a, b in zip(own["distances_mm"], found)]
    own_each_s = own["search_s"] / len(own["points"])
    return row | {
        "points": len(found),
        "same": sum(abs(d) <= allowed for d in off),
        "larger": sum(not d <= allowed for d in off),
        "largest_excess": max(off) / own["diagonal_mm"],
        "largest_deficit": -min(off) / own["diagonal_mm"],
        "closest_us": [1e6 * own_each_s, 1e6 * each_s],
        "closest_ratio": each_s / own_each_s,
    }


def line(r):
    if "refused" in r:
        return f"| {r['file']} | refused: {r['refused']} |"
    cells = [r["file"], "{} / {}".format(*r["faces"]), "{:.4f} / {:.4f}".format(*r["read_s"]), f"{r['read_ratio']:.1f}",
             f"{r['peak_mb']:.0f}" if r["peak_mb"] else ""]
    if "points" in r:
        cells += [str(r["points"]), str(r["same"]), str(r["larger"]),
                  f"{r['largest_excess']:.1e}, {r['largest_deficit']:.1e}",
                  "{:.1f} / {:.1f}".format(*r["closest_us"]), f"{r['closest_ratio']:.0f}"]
    return "| " + " | ".join(cells + [""] * (len(HEAD) - len(cells))) + " |"


def summary(rows):
    median = lambda values: statistics.median(values) if values else None
    searched = [r for r in rows if "points" in r]
    checked = [r for r in searched if r["checked"]]
    points, points_checked = (sum(r["points"] for r in some) for some in (searched, checked))
    return {
        "files": len(rows),
        "read_ratio_median": median([r["read_ratio"] for r in rows if r.get("bytes", 0) > LARGE]),
        "peak_mb": max((r["peak_mb"] or 0.0 for r in rows if "peak_mb" in r), default=None),
        "closest_20": sum(r["closest_ratio"] >= 20.0 for r in searched),
        "searched": len(searched),
        "closest_point_ratio": median([r["closest_ratio"] for r in searched]),
        "points": points,
        "same_share": sum(r["same"] for r in searched) / points if points else None,
        "larger": sum(r["larger"] for r in searched),
        "points_checked": points_checked,
        "same_share_checked": sum(r["same"] for r in checked) / points_checked if points_checked else None,
        "larger_checked": sum(r["larger"] for r in checked),
        "larger_in": [r["file"] for r in checked if r["larger"]],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("word", nargs="?", default="")
    parser.add_argument("--points", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--program", help="the built example cad_peer (built with cargo when not given)")
    arguments = parser.parse_args()
    enter_venv()
    if not arguments.program:
        subprocess.run(["cargo", "build", "--release", "--quiet", "--example", "cad_peer"], cwd=ROOT, check=True)
        arguments.program = str(TARGET / "release" / "examples" / "cad_peer")
    corpus = pathlib.Path(os.environ.get("KANAGATA_CORPUS", ROOT / ".." / "shared" / "cad"))
    files = sorted(p for p in corpus.glob("*") if p.suffix in (".igs", ".stp") and arguments.word in p.name)
    if not files:
        sys.exit(f"tools/peers/cad.py: no .igs or .stp files in {corpus}; set KANAGATA_CORPUS to a folder that has some")
    print("| " + " | ".join(HEAD) + " |\n|" + "---|" * len(HEAD))
    known = corpus / "truth.json"
    truths = json.loads(known.read_text()) if known.exists() else {}
    rows = []
    for path in files:
        checked = truths.get(path.name, {}).get("truth", {}).get("trust") == "checked"
        rows.append(compare(path, checked, arguments))
        print(line(rows[-1]), flush=True)
    print(json.dumps(summary(rows)))


if __name__ == "__main__":
    main()
