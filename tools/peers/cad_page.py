"""docs/results/cad.md from what was measured: agreement file by file, boxes by a second opinion, reading and closest
points beside the kernel. What is known of a difference stands in `cad_differences.json` beside this script: file ->
figure -> text. A difference without a text is called unexplained; a text without its difference is a fault."""

import json
import math
import pathlib
import subprocess

import prose

HERE = pathlib.Path(__file__).resolve().parent
FACE = 1e-3  # of a face's area
BOX = 1e-6  # of the diagonal

HEAD = """# CAD: foreign files beside an independent kernel

Written by `tools/bench cad` (needs the corpus; installs the kernel from PyPI): every figure below is of that run. Files of
more than 30 writers are read and compared with what Open CASCADE 8.0 says of them (`truth.json` of the corpus). `unmatched`: faces without a partner of the same area (1e-3) and centroid (1e-4 of the diagonal), ours + the kernel's.
Bold: outside what is allowed (area max(1e-5, the kernel's own uncertainty), box 1e-6 of the diagonal, free edges 1 %). Where
three faces meet in an edge, the kernel joins two and leaves one free; ours is counted alike."""

TIMES = """What the times of reading hold. Both sides, on one thread: parsing the file, surfaces and curves, parameter curves (made by projection
where the file has none, or none that is good), loops. The kernel, besides: its repairs of shapes. Ours, besides: rational B-splines in
place of all analytic surfaces, and edges joined by place (in IGES files the kernel joins nothing when it reads). Neither:
areas and boxes. `peak [MB]`: the most our process held until the model was read, program and all. Closest points: up to
1000 points within 1 % of the diagonal of the faces, as many as the kernel searches in the time given; `same`: within 1e-7 of
the diagonal."""


DAMAGED = """## Damaged files

`tests/mutations.rs` reads 20,400 mutants of the small files of `fixtures/forming`, and leads every pointer of every instance
back to itself and to what refers to it. `tests/foreign_bytes.rs` also meshes, converts and audits what is read of damaged
files, and reads `fixtures/fuzz` again. Fuzzing of all readers: [fuzz.md](fuzz.md)."""


def table(head, rows):
    return "\n".join("| " + " | ".join(r) + " |" for r in [head, ["---"] * len(head), *rows])


def number(x):
    return "-" if x is None else f"{x:.2e}"


def agreement(rows):
    def cells(r):
        bold = lambda text, figure: f"**{text}**" if figure in r["differs"] else text
        free = r["free_edges_mm"] or [None, None]
        length = lambda x: "-" if x is None else f"{x:.6f}"
        note = r["refused"] or ("" if r["checked"] else "not checked")
        unmatched = "{} + {}".format(*(r["unmatched"] or [0, 0]))
        return [r["file"], str(r["faces"][0]), str(r["faces"][1]), bold(unmatched, "faces"), bold(number(r["area_off"]), "area"),
                number(r["area_allowed"]), bold(number(r["box_off"]), "box"), bold(length(free[0]), "free edges"),
                length(free[1]), f"{r['read_s']:.3f}", note]

    head = ["file", "faces", "kernel's", "unmatched", "area off", "allowed", "box off", "free edges [mm]", "kernel's [mm]",
            "read [s]", ""]
    return table(head, map(cells, rows))


def differences(rows, texts, larger):
    """The table of what differs in checked files, and how many of them have no text; `larger`: files with a closest point
    that the kernel has nearer."""
    known = {(f, figure): text for f, by_figure in texts.items() for figure, text in by_figure.items()}
    there = {(r["file"], figure) for r in rows if r["checked"] for figure in r["differs"]}
    there |= {(r["file"], "unmatched") for r in rows if r["checked"] and any(r["unmatched"] or [])}
    there |= {(r["file"], "not checked") for r in rows if not r["checked"] and r["faces"][0] != r["faces"][1]}
    there |= {(f, "closest points") for f in larger}
    stale = sorted(k for k in known if k not in there and k[0] in {r["file"] for r in rows})
    if stale:
        raise SystemExit(f"tools/peers/cad_differences.json explains what does not differ: {stale}")
    body = [[f, figure, known.get((f, figure), "**unexplained**")] for f, figure in sorted(there)]
    return table(["file", "figure", "what is known of it"], body), sum(k not in known for k in there)


def second_opinion(rows, truth):
    """Boxes that differ, by the kernel's own faces: in how many of the files ours agrees with these."""
    names = [r["file"] for r in rows if r["checked"] and "box" in r["differs"]]
    if not names:
        return "", 0
    out = subprocess.run([str(HERE / "cad_boxes.py"), *names], check=True, stdout=subprocess.PIPE, text=True).stdout
    boxes = {found["file"]: found["box"] for found in map(json.loads, out.splitlines())}
    body, settled = [], 0
    for r in rows:
        if r["file"] not in boxes:
            continue
        own, said, found = sum(r["box"], []), truth[r["file"]]["truth"]["bbox_mm"], boxes[r["file"]]
        diagonal = math.dist(own[:3], own[3:])
        agree = all(abs(a - b) <= BOX * diagonal for a, b in zip(own, found))
        settled += agree
        for k in range(6):
            if abs(own[k] - said[k]) > BOX * diagonal:
                side = f"{'xyz'[k % 3]} {'min' if k < 3 else 'max'}"
                body.append([r["file"], side, f"{said[k]:.6f}", f"{found[k]:.6f}", f"{own[k]:.6f}"])
    return table(["file", "side", "truth [mm]", "the kernel's own faces [mm]", "ours [mm]"], body), settled


def coarse_faces(rows, truth):
    """Files with unmatched faces: how many faces' integrals the kernel's own triangulation contradicts."""
    body = []
    for r in rows:
        if r["checked"] and any(r["unmatched"] or []):
            faces = truth[r["file"]]["truth"]["face_list"]
            off = [abs(f["area"] / f["mesh_area"] - 1) for f in faces if f.get("mesh_area")]
            body.append([r["file"], str(r["unmatched"][1]), f"{sum(x > FACE for x in off)} of {len(faces)}", f"{max(off):.1e}"])
    head = ["file", "unmatched", "faces whose integral and triangulation differ by more than 1e-3", "largest difference"]
    return table(head, body)


def shares(found):
    """What the closest points came to, in words; `found`: the figures of tools/peers/cad.py."""
    share = lambda x: "-" if x is None else f"{100 * x:.3f} %"
    return (f"Of {found['points']} points in all files, {share(found['same_share'])} have the kernel's distance, and ours is larger for "
            f"{found['larger']}. Of {found['points_checked']} in the files that the truth calls checked, "
            f"{share(found['same_share_checked'])} have it, and ours is larger for {found['larger_checked']}; what the kernel says of the "
            "others is in doubt (above).")


def page(rows, truth, searches, found, load):
    """The page, and the figures of agreement. `searches`: the table of tools/peers/cad.py, `found`: its figures, `load`: the
    seconds a file of the kernel's searches in it, the machine's load average before and after."""
    texts = json.loads((HERE / "cad_differences.json").read_text())
    checked = [r for r in rows if r["checked"]]
    exact = sum(not r["differs"] for r in checked)
    explained, unexplained = differences(rows, texts, found["larger_in"])
    boxes, settled = second_opinion(rows, truth)
    figures = {"exact": exact, "checked": len(checked), "boxes_by_the_kernels_own_faces": settled, "unexplained": unexplained}
    parts = [
        HEAD, f"{exact} of {len(checked)} checked files agree in every figure.", agreement(rows),
        "## What differs, and what is known of it", explained,
        "## Boxes that differ, by the kernel's own faces",
        "`tools/peers/cad_boxes.py` climbs on the kernel's own trimmed faces to their farthest points. Where these lie beyond the box "
        f"that the truth has, or short of it, that box is wrong. In {settled} of the files ours agrees with the kernel's own faces on "
        "all six sides.", boxes,
        "## Faces without a partner", "The areas of single faces in the truth against the kernel's own triangulation of them:",
        coarse_faces(rows, truth),
        "## Reading and closest points beside Open CASCADE", TIMES,
        "The kernel searched {} s a file. Load average of the machine (1 minute) before and after: {:.1f}, {:.1f}; where it is "
        "above 1 the machine was shared, and only ratios mean something, loosely.".format(*load),
        shares(found), searches, DAMAGED,
    ]
    return prose.wrapped("\n\n".join(p for p in parts if p)), figures
