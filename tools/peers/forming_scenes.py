#!/usr/bin/env python3
"""Forming scenes that the solver was not tuned to: tools made by CadQuery (STEP), two blanks meshed by gmsh, converted by
`kanagata`, run by `kanagata-solve`; prints a row of a table for each.

  forming_scenes.py FOLDER [--programs target/release] [--only NAME ...] [--tol 0.05]

Needs `pip install cadquery gmsh`. Scenes: hole-expansion, nakazima, redraw (reverse, five stages), wipe, wipe-sharp, tray
(nothing symmetric, holder on a spring), knife (sharp edges everywhere), ironing, needle; erichsen, bead (channel over a
drawbead), flare and nose (a tube of shuffled hexahedra in an Abaqus deck), vee (air bending, then bottoming by a force),
channels (bipolar plate of foil), conical (a cup drawn without a holder, which wrinkles), emboss (and pressed flat again), cups.
"""

import argparse
import json
import math
import pathlib
import random
import shutil
import subprocess

import cadquery as cq
import gmsh

from forming_solids import solids

MILD, DEEP = "mild-steel-neto2012", "mild-steel-numisheet93"
AA6016, AA5754, AA2090 = "aa6016-t4-esaform2021", "aa5754-o-coer2018", "aa2090-t3-barlat2005"
QUARTER = [{"normal": "x"}, {"normal": "y"}]


def mesh(path, outline, size):
    """Quadrilaterals on the quarter of an outline that `outline` makes of gmsh's kernel."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    quarter = gmsh.model.occ.addRectangle(0, 0, 0, 100, 100)
    gmsh.model.occ.intersect(outline(gmsh.model.occ), [(2, quarter)])
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, lc: size(math.hypot(x, y)))
    for option, value in [("RecombineAll", 1), ("Algorithm", 8), ("RecombinationAlgorithm", 3), ("SaveAll", 1)]:
        gmsh.option.setNumber("Mesh." + option, value)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(path))
    gmsh.finalize()


def tube(path, around, up, inner, thickness, height):
    """Deck of a quarter of a tube that stands on z = 0: nodes and elements numbered and listed at random."""
    number, cells = {}, []
    corners = [(i, j, k) for i in range(around + 1) for j in range(up + 1) for k in range(2)]
    draw = random.Random(5)
    draw.shuffle(corners)
    number = {corner: 7 + 3 * n for n, corner in enumerate(corners)}
    for i in range(around):
        for j in range(up):
            ring = [(j, 0), (j + 1, 0), (j + 1, 1), (j, 1)]
            cells.append([number[(i + a, *place)] for a in range(2) for place in ring])
    draw.shuffle(cells)
    with open(path, "w") as deck:
        deck.write("*HEADING\ntube\n*NODE\n")
        for i, j, k in corners:
            angle, radius = math.pi / 2 * i / around, inner + thickness * k
            x, y = (0.0 if i == around else math.cos(angle)), (0.0 if i == 0 else math.sin(angle))
            deck.write(f"{number[i, j, k]}, {radius * x:.12g}, {radius * y:.12g}, {height * j / up:.12g}\n")
        deck.write("*ELEMENT, TYPE=C3D8, ELSET=TUBE\n")
        for n, cell in enumerate(cells):
            deck.write(", ".join(map(str, [n + 11, *cell])) + "\n")


def blank(name, folder):
    annulus = lambda k: k.cut([(2, k.addDisk(0, 0, 0, 65, 65))], [(2, k.addDisk(0, 0, 0, 5, 5))])[0]
    strip = lambda k: k.cut([(2, k.addDisk(0, 0, 0, 90, 90))], [(2, k.addDisk(0, 75, 0, 60, 60))])[0]
    rectangle = lambda size, count, corner: {"rectangle": {"size_mm": size, "elements": count, "corner_mm": corner}}
    disc = lambda radius, core, rings: {"quarter_disc": {"radius_mm": radius, "core": core, "rings": rings}}
    if name == "hole-expansion":
        mesh(folder / "blank.msh", annulus, lambda r: 0.8 + 2.7 * min(1, max(0, (r - 5) / 25)))
    elif name == "nakazima":
        mesh(folder / "blank.msh", strip, lambda r: 2.0 if r < 35 else 3.5)
    if name in ("flare", "nose"):
        tube(folder / "blank.inp", 24, 40, 20, 1, 40)
        return {"shape": {"mesh": {"file": "blank.inp"}}, "element": "solid-shell"}
    cup = (disc(85, 6, 14), 1.0)
    shapes = {
        "redraw": (disc(80, 8, 20), 1.0),
        "wipe": (rectangle([62, 50], [62, 10], [-45, 0]), 0.9),
        "wipe-sharp": (rectangle([62, 20], [80, 5], [-45, 0]), 0.9),
        "tray": (rectangle([230, 180], [58, 45], [-110, -90]), 1.0),
        "knife": (rectangle([30, 20], [60, 8], [0, 0]), 1.5),
        "ironing": (disc(36, 8, 20), 1.0),
        "needle": (disc(40, 8, 16), 0.5),
        "erichsen": (disc(45, 14, 30), 0.8),
        "bead": (rectangle([105, 1], [210, 1], [0, 0]), 0.8),
        "vee": (rectangle([40, 20], [80, 6], [0, 0]), 2.0),
        "channels": (rectangle([2, 0.1], [80, 1], [0, 0]), 0.1),
        "conical": (disc(70, 10, 24), 0.5),
        "emboss": (disc(25, 10, 16), 1.0),
        "cup-mild": cup, "cup-aa6016": cup, "cup-aa2090": cup,
        "cup-aa2090-whole": ({"disc": {"radius_mm": 85, "core": 6, "rings": 14}}, 1.0),
    }
    file = {"mesh": {"file": "blank.msh"}}
    shape, thickness = shapes.get(name, (file, 1.2 if name == "hole-expansion" else 1.0))
    return {"shape": shape, "thickness_mm": thickness, "element": "solid-shell"}


def force(newton):
    return {"force_n": newton}


def travel(mm):
    return {"travel_mm": mm}


# Material; friction by tool; shifts of tools that are not placed touching; stages by name, tool and drive; the rest.
SCENES = {
    "hole-expansion": (DEEP, {"die": 0.12, "holder": 0.12, "punch": 0.05}, {},
                       [("clamp", {"holder": force(150e3)}), ("expand", {"punch": travel(25)})],
                       {"symmetry": QUARTER, "holds": [{"where": {"beyond_radius_mm": 64.9}, "axes": ["x", "y"]}]}),
    "nakazima": (AA6016, {"die": 0.3, "holder": 0.3, "punch": 0.02}, {},
                 [("clamp", {"holder": force(200e3)}), ("dome", {"punch": travel(25)})],
                 {"symmetry": QUARTER, "holds": [{"where": {"beyond_radius_mm": 88}, "axes": ["x", "y"]}]}),
    "redraw": (MILD, {"die": 0.05, "holder": 0.05, "punch": 0.1, "die2": 0.05, "punch2": 0.1},
               {"die2": -38.5, "punch2": -41},
               [("clamp", {"holder": force(40e3), "die2": {"absent": True}, "punch2": {"absent": True}}),
                ("draw", {"punch": travel(40)}),
                ("off", {"punch": {"release": True}, "holder": {"release": True}}),
                ("seat", {"die2": travel(0.5), "punch2": travel(1)}),
                ("reverse", {"punch2": travel(30)})], {"symmetry": QUARTER}),
    "wipe": (AA6016, {"die": 0.1, "pad": 0.1, "wipe": 0.1}, {},
             [("clamp", {"pad": force(30e3)}), ("wipe", {"wipe": travel(25)})],
             {"holds": [{"where": {"plane": {"normal": "x", "at_mm": -45}}, "axes": ["x"]},
                        {"where": {"plane": {"normal": "y"}}, "axes": ["y"]}]}),
    "tray": (MILD, {"die": 0.12, "holder": 0.12, "punch": 0.12}, {},
             [("clamp", {"holder": {"spring": {"force_n": 60e3, "stiffness_n_per_mm": 3000}}}),
              ("draw", {"punch": travel(30)})], {}),
    "knife": ("aluminium-numisheet2002b", {"die": 0.2, "punch": 0.2}, {}, [("bend", {"punch": travel(16)})],
              {"symmetry": QUARTER}),
    "ironing": (AA5754, {"die": 0.05, "holder": 0.05, "punch": 0.1}, {},
                [("clamp", {"holder": force(5e3)}), ("draw", {"punch": travel(28)})], {"symmetry": QUARTER}),
    "needle": (MILD, {"die": 0.2, "holder": 0.2, "punch": 0.1}, {},
               [("clamp", {"holder": force(40e3)}), ("draw", {"punch": travel(8)})],
               {"symmetry": QUARTER, "holds": [{"where": {"beyond_radius_mm": 39.9}, "axes": ["x", "y"]}]}),
}
SCENES["wipe-sharp"] = (MILD, {"die": 0.15, "pad": 0.15, "wipe": 0.15}, {},
                        [("clamp", {"pad": force(30e3)}), ("wipe", {"wipe": travel(20)})], SCENES["wipe"][4])

BASE = {"where": {"plane": {"normal": "z"}}, "axes": ["x", "y", "z"]}
STRIP = {"symmetry": [{"normal": "x"}], "holds": [{"where": {"all": True}, "axes": ["y"]}]}
PERIOD = {"symmetry": [{"normal": "x"}, {"normal": "x", "at_mm": 2}], "holds": STRIP["holds"]}
CUP = [("clamp", {"holder": force(30e3)}), ("draw", {"punch": travel(30)})]
ABSENT, RELEASE = {"absent": True}, {"release": True}
SCENES |= {
    "erichsen": (AA6016, {"die": 0.12, "holder": 0.12, "punch": 0.05}, {},
                 [("clamp", {"holder": force(10e3)}), ("dome", {"punch": travel(9)})], {"symmetry": QUARTER}),
    "bead": (MILD, {"die": 0.1, "holder": 0.1, "punch": 0.1}, {},
             [("clamp", {"holder": force(800)}), ("draw", {"punch": travel(40)})], STRIP),
    "flare": (MILD, {"cone": 0.1}, {}, [("flare", {"cone": travel(25)})], {"symmetry": QUARTER, "holds": [BASE]}),
    "nose": (MILD, {"cone": 0.05}, {}, [("nose", {"cone": travel(14)})], {"symmetry": QUARTER, "holds": [BASE]}),
    "vee": (DEEP, {"die": 0.1, "punch": 0.1}, {},
            [("bend", {"punch": travel(15)}), ("bottom", {"punch": force(80e3)})], {"symmetry": QUARTER}),
    "channels": (DEEP, {"die": 0.1, "punch": 0.1}, {"punch": 0.5}, [("form", {"punch": travel(0.47)})], PERIOD),
    "conical": (AA5754, {"die": 0.08, "punch": 0.15}, {}, [("draw", {"punch": travel(35)})], {"symmetry": QUARTER}),
    "emboss": (AA6016, dict.fromkeys(["die", "holder", "punch", "low", "flat"], 0.1), {"low": -3.2},
               [("clamp", {"holder": force(20e3), "low": ABSENT, "flat": ABSENT}), ("emboss", {"punch": travel(3)}),
                ("off", {"punch": RELEASE, "holder": RELEASE, "die": RELEASE}),
                ("flatten", {"flat": force(60e3), "low": travel(0)})], {"symmetry": QUARTER}),
    "cup-mild": (MILD, dict.fromkeys(["die", "holder", "punch"], 0.06), {}, CUP, {"symmetry": QUARTER}),
}
SCENES["cup-aa6016"] = (AA6016, *SCENES["cup-mild"][1:])
SCENES["cup-aa2090"] = (AA2090, *SCENES["cup-mild"][1:])
SCENES["cup-aa2090-whole"] = (AA2090, *SCENES["cup-mild"][1:4], {})
# Tools that the sheet's thickness direction does not tell the side of, and those that a stage before the last let go.
SIDES = {"flare": "bottom", "nose": "top"}
GONE = {"redraw": ("punch", "holder"), "emboss": ("punch", "holder", "die")}


def write(name, folder, programs, tol):
    folder.mkdir(parents=True, exist_ok=True)
    material, friction, shifts, stages, rest = SCENES[name]
    tools = []
    for tool, (solid, side) in solids(name).items():
        cq.exporters.export(solid, str(folder / f"{tool}.step"))
        subprocess.run(
            [programs / "kanagata", "convert", folder / f"{tool}.step", "--tol", str(tol), "--sheet-side", side,
             "-o", folder / f"{tool}.tool.json"],
            check=True, capture_output=True,
        )
        direction = [0, 0, 1 if side == "+z" else -1]
        entry = {"name": tool, "file": f"{tool}.tool.json", "direction": direction, "friction": friction[tool]}
        if name in SIDES:
            entry["side"] = SIDES[name]
        if tool in shifts:
            entry["place"] = {"shift": [0, 0, shifts[tool]]}
        tools.append(entry)
    stages = [{"name": stage, "drive": drive} for stage, drive in stages]
    there = [tool for tool in friction if tool not in GONE.get(name, ())]
    stages.append({"name": "free", "drive": {tool: RELEASE for tool in there}})
    scene = {"format": "kanagata-scene", "version": 1, "name": name, "blank": blank(name, folder),
             "material": material, "tools": tools, "stages": stages, "output": {"vtu_every": 0}, **rest}
    path = folder / f"{name}.scene.json"
    path.write_text(json.dumps(scene, indent=1))
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("target/release"))
    parser.add_argument("--only", nargs="*", choices=sorted(SCENES))
    parser.add_argument("--tol", type=float, default=0.05)
    args = parser.parse_args()
    print("| scene | unknowns | increments | iterations | cuts | snaps | energy | order | thinnest | processor [s] |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name in args.only or SCENES:
        path = write(name, args.folder / name, args.programs, args.tol)
        out = args.folder / name / "run"
        shutil.rmtree(out, ignore_errors=True)
        done = subprocess.run(
            [args.programs / "kanagata-solve", "run", path, "-o", out, "--threads", "1"],
            capture_output=True, text=True,
        )
        if done.returncode != 0:
            print(f"| {name} | exit {done.returncode}: {done.stderr.strip()} |", flush=True)
            continue
        r = json.loads((out / "run.json").read_text())
        order, thickness = r.get("convergence_order"), r["thickness"]
        print(f"| {name} | {r['unknowns']} | {r['increments']} | {r['iterations']} | {r['cuts']} | {r['snaps']} "
              f"| {r['energy_balance']:.1e} | {order if order is None else round(order, 2)} "
              f"| {thickness['least_mm'] / thickness['was_mm']:.3f} | {r['cpu_s']:.1f} |", flush=True)


if __name__ == "__main__":
    main()
