"""P1 in CalculiX (Debian `calculix-ccx`): the same mesh of C3D8I elements, the punch as flat facets, contact by penalty."""

import os
import pathlib
import re
import resource
import subprocess

import forming

KN, STICK = 2.1e5, 4.2e3  # MPa/mm: penalty slopes of contact and of stick


def hardening():
    law = forming.STEEL["hardening"]
    strains = [0.0] + [1e-4 * (2.0 / 1e-4) ** (k / 59) for k in range(60)]
    return [(law["k"] * (law["eps0"] + e) ** law["n"], e) for e in strains]


def hexahedra(points, quads, levels):
    """Nodes (levels: height by point and level) and elements, from 1."""
    count = len(points)
    nodes = [(x, y, level) for level in levels for x, y in points]
    layer = lambda k: [tuple(n + k * count + 1 for n in q) for q in quads]
    return nodes, [low + up for k in range(len(levels) - 1) for low, up in zip(layer(k), layer(k + 1))]


def p1_deck(path, facets=16, core=10, rings=20, depth=10.0):
    points, quads = forming.quarter_disc(60.0, core, rings)
    nodes, blank = hexahedra(points, quads, (0.0, 0.4, 0.8))
    sphere, normals, shell = forming.cap(50.0, 0.7853981633974483, facets, 0.8)
    first = len(nodes) + 1
    nodes += sphere + [tuple(p[k] - 2.0 * n[k] for k in range(3)) for p, n in zip(sphere, normals)]
    # The first face of a punch element is the sphere's skin; its nodes go round the other way seen from inside.
    skin = [tuple(reversed(q)) for q in shell]
    punch = [tuple(n + first for n in q) + tuple(n + first + len(sphere) for n in q) for q in skin]
    lines = ["*NODE, NSET=NALL"] + [f"{k}, {x:.9g}, {y:.9g}, {z:.9g}" for k, (x, y, z) in enumerate(nodes, 1)]

    def elements(name, kind, found, start):
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET={name}")
        lines.extend(f"{start + k}, " + ", ".join(map(str, e)) for k, e in enumerate(found))

    elements("EBLANK", "C3D8I", blank, 1)
    elements("EPUNCH", "C3D8", punch, len(blank) + 1)

    def node_set(name, found):
        found = list(found)
        lines.append(f"*NSET, NSET={name}")
        lines.extend(", ".join(map(str, found[k:k + 10])) + "," for k in range(0, len(found), 10))

    sheet = list(enumerate(nodes[:first - 1], 1))
    node_set("NX", [k for k, p in sheet if abs(p[0]) < 1e-6])
    node_set("NY", [k for k, p in sheet if abs(p[1]) < 1e-6])
    node_set("NRIM", [k for k, p in sheet if p[0] ** 2 + p[1] ** 2 > (60 - 1e-4) ** 2])
    node_set("NPUNCH", range(first, len(nodes) + 1))
    top = range(len(quads) + 1, 2 * len(quads) + 1)
    lines += ["*SURFACE, NAME=SHEET, TYPE=ELEMENT"] + [f"{e}, S2" for e in top]
    lines += ["*SURFACE, NAME=SKIN, TYPE=ELEMENT"] + [f"{len(blank) + 1 + k}, S1" for k in range(len(punch))]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3", "*PLASTIC"]
    lines += [f"{s:.6f}, {e:.8g}" for s, e in hardening()]
    lines += ["*MATERIAL, NAME=RIGID", "*ELASTIC", "210000., 0.3", "*SOLID SECTION, ELSET=EBLANK, MATERIAL=STEEL",
              "*SOLID SECTION, ELSET=EPUNCH, MATERIAL=RIGID", "*SURFACE INTERACTION, NAME=SI",
              "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{KN:g}", "*FRICTION", f"0.1, {STICK:g}",
              "*CONTACT PAIR, INTERACTION=SI, TYPE=SURFACE TO SURFACE", "SHEET, SKIN", "*BOUNDARY", "NX, 1, 1",
              "NY, 2, 2", "NRIM, 1, 3", "*STEP, NLGEOM, INC=5000", "*STATIC, SOLVER=SPOOLES", "0.02, 1., 1e-6, 0.02",
              "*BOUNDARY", "NPUNCH, 1, 2", f"NPUNCH, 3, 3, {-depth}", "*NODE PRINT, NSET=NPUNCH, TOTALS=ONLY", "RF",
              "*END STEP"]
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def run(folder, job, depth=10.0):
    """Runs a deck on one thread: (travel, force of the quarter), iterations, processor time."""
    threads = {"OMP_NUM_THREADS": "1", "CCX_NPROC_STIFFNESS": "1", "CCX_NPROC_EQUATION_SOLVER": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(pathlib.Path(folder) / f"{job}.out", "w") as out:
        subprocess.run(["ccx", "-i", job], cwd=folder, env={**os.environ, **threads}, stdout=out, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    text = (pathlib.Path(folder) / f"{job}.dat").read_text()
    found = re.findall(r"total force[^\n]*time\s+(\S+)\s+\S+\s+\S+\s+(\S+)", text)
    curve = [(0.0, 0.0)] + [(float(t) * depth, abs(float(f))) for t, f in found]
    rows = (pathlib.Path(folder) / f"{job}.cvg").read_text().splitlines()
    iterations = sum(1 for row in rows if row.split()[:1] and row.split()[0].isdigit())
    return {"curve": curve, "iterations": iterations, "cpu_s": cpu}
