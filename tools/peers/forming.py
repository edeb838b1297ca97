"""Forming cases for comparisons: tools as Nagata patches or facets from closed forms, scenes for kanagata-solve.

p1: hemispherical stretching of a clamped disc (quarter), radius 60 x 0.8 mm, sphere of radius 50 mm, 10 mm deep.
p3: U-draw of a strip (plane strain, half) over a 7 mm die radius, punch radius 5 mm, 15 mm deep, holder at a fixed gap.
"""

import json
import math
import pathlib

STEEL = {"name": "steel", "young_mpa": 210000.0, "poisson": 0.3, "yield": {"criterion": "von-mises"},
         "hardening": {"law": "swift", "k": 529.5, "eps0": 0.00439, "n": 0.268}}


def quarter_disc(radius, core, rings):
    """Points and quadrilaterals of the quarter x, y >= 0: the blank `quarter_disc` of a scene."""
    def inside(i, j):
        u, v = i / core, j / core
        out = max(u, v)
        slant = math.hypot(u, v) / out - 1 if out else 0.0
        size = 0.4 * radius / (1 + 0.6 * slant * out)
        return u * size, v * size

    points = [inside(i, j) for i in range(core + 1) for j in range(core + 1)]
    at = lambda i, j: i * (core + 1) + j
    quads = [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)) for i in range(core) for j in range(core)]
    border = [at(core, j) for j in range(core + 1)] + [at(i, core) for i in reversed(range(core))]
    spokes = []
    for k, inner in enumerate(border):
        angle = math.pi / 2 * k / (2 * core)
        rim = (0.0 if k == 2 * core else radius * math.cos(angle), radius * math.sin(angle))
        x, y = points[inner]
        spoke = [inner]
        for r in range(1, rings + 1):
            spoke.append(len(points))
            points.append((x + (rim[0] - x) * r / rings, y + (rim[1] - y) * r / rings))
        spokes.append(spoke)
    for a, b in zip(spokes, spokes[1:]):
        quads += [(a[r], a[r + 1], b[r + 1], b[r]) for r in range(rings)]
    return points, quads


def cap(radius, angle, n, bottom):
    """A spherical cap (quarter) whose lowest point is at height `bottom`: points, outward normals, quadrilaterals seen
    from outside."""
    flat, quads = quarter_disc(1.0, n, n)
    points, normals = [], []
    for x, y in flat:
        r = math.hypot(x, y)
        s = math.sin(r * angle) / r if r else 0.0
        n3 = (x * s, y * s, -math.cos(r * angle))
        normals.append(n3)
        points.append(tuple(radius * c + (0, 0, radius + bottom)[k] for k, c in enumerate(n3)))
    return points, normals, [tuple(reversed(q)) for q in quads]


def strip(chain, low, high):
    """A profile in x-z, as (x, z, nx, nz), extruded from y = low to high."""
    points = [(x, y, z) for x, z, _, _ in chain for y in (low, high)]
    normals = [(nx, 0.0, nz) for _, _, nx, nz in chain for _ in range(2)]
    quads = []
    for k in range(len(chain) - 1):
        a, b, c, d = 2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1
        (x0, z0), (x1, z1) = chain[k][:2], chain[k + 1][:2]
        # The normal of (a, b, c, d) is (dx, 0, dz) x y = (-dz, 0, dx).
        outward = -(z1 - z0) * (chain[k][2] + chain[k + 1][2]) + (x1 - x0) * (chain[k][3] + chain[k + 1][3])
        quads.append((a, b, c, d) if outward > 0 else (a, d, c, b))
    return points, normals, quads


def write_tool(path, surface, kind="nagata"):
    points, normals, quads = surface
    data = {"format": "kanagata-tool", "version": 1, "name": pathlib.Path(path).name.split(".")[0], "kind": kind,
            "edges": "guarded", "provenance": {}, "vertices": points, "normals": normals,
            "patches": [{"vertices": q, "normals": q, "face": 0} for q in quads]}
    pathlib.Path(path).write_text(json.dumps(data))


def write_scene(folder, scene):
    path = pathlib.Path(folder) / "case.scene.json"
    path.write_text(json.dumps({"format": "kanagata-scene", "version": 1, "material": STEEL, **scene}, indent=1))
    return path


def p1(folder, element, layers=2, patches=4, core=10, rings=20):
    """3 * patches^2 Nagata quadrilaterals on the sphere."""
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    write_tool(f"{folder}/punch.tool.json", cap(50.0, math.pi / 4, patches, 0.8))
    return write_scene(folder, {
        "name": "P1: hemispherical stretching",
        "blank": {"shape": {"quarter_disc": {"radius_mm": 60.0, "core": core, "rings": rings}},
                  "thickness_mm": 0.8, "layers": layers, "element": element},
        "symmetry": [{"normal": "x"}, {"normal": "y"}],
        "holds": [{"where": {"beyond_radius_mm": 59.9999}, "axes": ["x", "y", "z"]}],
        "tools": [{"name": "punch", "file": "punch.tool.json", "direction": [0, 0, -1], "friction": 0.1}],
        "stages": [{"name": "stretch", "drive": {"punch": {"travel_mm": 10.0}}, "first_increment": 0.02}],
    })


def p3(folder, divisions, kind="nagata", element=None, layers=2, depth=15.0):
    """`divisions` patches over 90 degrees of each radius; solid-shells unless another element is named."""
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    length, thickness, half_punch, r_punch, r_die, clearance, gap = 70.0, 0.8, 25.0, 5.0, 7.0, 1.1, 0.016

    def arc(cx, cz, r, start, end):
        angles = [math.radians(start + (end - start) * k / divisions) for k in range(divisions + 1)]
        return [(cx + r * math.cos(a), cz + r * math.sin(a), math.cos(a), math.sin(a)) for a in angles]

    wall, end = half_punch + clearance, length + 5.0
    die = [(end, 0, 0, 1), *arc(wall + r_die, -r_die, r_die, 90, 180), (wall, -r_die - depth - 10, -1, 0)]
    punch = [(0, thickness, 0, -1), *arc(half_punch - r_punch, thickness + r_punch, r_punch, -90, 0),
             (half_punch, thickness + depth + 12, 1, 0)]
    holder = [(wall + r_die, thickness + gap, 0, -1), (end, thickness + gap, 0, -1)]
    for name, chain in (("die", die), ("punch", punch), ("holder", holder)):
        write_tool(f"{folder}/{name}.tool.json", strip(chain, -0.5, 1.5), kind)
    tool = lambda name, up: {"name": name, "file": f"{name}.tool.json", "direction": [0, 0, up], "friction": 0.1,
                             "place": {"shift": [0, 0, 0]}}
    return write_scene(folder, {
        "name": f"P3: U-draw, {divisions} {kind} patches over 90 degrees",
        "blank": {"shape": {"rectangle": {"size_mm": [length, 1.0], "elements": [70, 1]}},
                  "thickness_mm": thickness, "layers": layers, "element": element or {"solid-shell": {}}},
        "holds": [{"where": {"all": True}, "axes": ["y"]}, {"where": {"plane": {"normal": "x"}}, "axes": ["x"]}],
        "loads": [{"where": {"plane": {"normal": "x", "at_mm": length}}, "force_n": [20 * thickness, 0, 0]}],
        "tools": [tool("die", 1), tool("holder", -1), tool("punch", -1)],
        "stages": [{"name": "draw", "drive": {"punch": {"travel_mm": depth}}, "first_increment": 0.01}],
    })
