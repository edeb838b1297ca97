"""CAD, tools, audits, materials against closed forms and the files of the programs."""

import json
import subprocess

import numpy as np
import pytest

import kanagata


@pytest.fixture(scope="module")
def punch(root):
    return kanagata.read_cad(root / "fixtures/forming/hemi_punch_144.igs")


def test_cad_has_faces_areas_bounds_and_unit(punch):
    assert punch.faces == len(punch.areas_mm2) > 0
    assert punch.unit == "MM" and punch.lost_faces == []
    low, high = punch.bounds_mm
    assert (low < high).all() and punch.bounds_mm.shape == (2, 3)


def test_a_tool_keeps_its_tolerance_and_its_file(punch, tmp_path):
    tool = punch.convert(name="punch", tol_mm=0.01, sheet_side="-z")
    assert tool.shape_error_mm <= 0.01 and tool.doubts == []
    tool.write(tmp_path / "punch.tool.json")
    again = kanagata.read_tool(tmp_path / "punch.tool.json")
    assert (again.name, again.kind, again.patches) == ("punch", "nagata", tool.patches)
    found = kanagata.audit(again, punch, tol_mm=0.01)
    assert found.worst_mm == pytest.approx(tool.shape_error_mm, rel=1e-9) and found.doubts == []
    assert json.loads(found.json())["patches"] == tool.patches
    points, errors, patches = found.samples()
    assert points.shape == (len(errors), 3) and len(patches) == len(errors)
    assert np.abs(errors).max() <= found.worst_mm * (1 + 1e-12)
    assert kanagata.audit(again, punch, tol_mm=1e-9).doubts != []


def test_the_program_in_the_wheel_makes_the_same_tool(punch, root, tmp_path):
    punch.convert(name="punch", tol_mm=0.02, sheet_side="-z").write(tmp_path / "own.tool.json")
    command = [kanagata.program("kanagata"), "convert", str(root / "fixtures/forming/hemi_punch_144.igs")]
    command += ["-o", str(tmp_path / "program.tool.json"), "--name", "punch", "--tol", "0.02mm", "--sheet-side=-z"]
    subprocess.run(command, check=True, capture_output=True)
    own, program = (json.loads((tmp_path / f"{n}.tool.json").read_text()) for n in ("own", "program"))
    for key in ("vertices", "normals", "patches", "curves"):
        assert own.get(key) == program.get(key), key
    assert own["provenance"]["cad_sha256"] == program["provenance"]["cad_sha256"]


def test_closest_points_of_a_hemisphere_are_those_of_the_sphere(punch):
    tool = punch.convert(tol_mm=1e-3, sheet_side="-z")
    low, high = punch.bounds_mm
    radius = 0.5 * (high[0] - low[0])
    # The pole is the lowest point of the punch.
    centre = np.array([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2] + radius])
    rng = np.random.default_rng(7)
    directions = rng.normal(size=(200, 3))
    directions[:, 2] = -np.abs(directions[:, 2]) - 1.0
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    asked = centre + (radius + 3.0) * directions
    found = kanagata.closest(tool, asked)
    assert np.abs(found.gaps - 3.0).max() < 2e-3
    # Normals that are off by an angle move the foot of a point at 3 mm by as much.
    moved = 3.0 * np.radians(kanagata.audit(tool, punch).normal_max_deg)
    assert np.abs(found.points - (centre + radius * directions)).max() < 1e-3 + moved
    assert np.abs(np.linalg.norm(found.normals, axis=1) - 1.0).max() < 1e-12
    assert not found.past_border.any() and (found.patches < tool.patches).all()
    points, triangles = tool.triangles(4)
    assert points.shape[1] == 3 and triangles.max() < len(points)


def test_bezier_facets_and_offsets_are_made(punch):
    bezier = punch.convert(kind="bezier", tol_mm=1e-3)
    assert bezier.kind == "bezier" and bezier.shape_error_mm <= 1e-3
    assert punch.convert(kind="facets").kind == "facets"
    moved = punch.convert(tol_mm=0.01, sheet_side="-z", offset_mm=0.5)
    assert kanagata.audit(moved, punch).worst_mm <= 0.0101


@pytest.mark.parametrize(
    "settings",
    [
        {"kind": "spline"},
        {"tol_mm": 0.0},
        {"tol_mm": float("nan")},
        {"sheet_side": "up"},
        {"sheet_reference": "upper"},
        {"offset_mm": 1.0, "thickness_mm": 1.0},
        {"faces": "{"},
        {"arc_divisions": 0},
    ],
)
def test_settings_out_of_range_are_refused_with_what_is_allowed(punch, settings):
    with pytest.raises(kanagata.InputError) as error:
        punch.convert(**settings)
    assert len(str(error.value)) > 10


def test_missing_and_foreign_files_are_errors(tmp_path, root):
    with pytest.raises(OSError):
        kanagata.read_cad(tmp_path / "none.igs")
    with pytest.raises(kanagata.InputError):
        kanagata.read_tool(root / "Cargo.toml")
    with pytest.raises(kanagata.InputError):
        kanagata.read_cad(root / "Cargo.toml")
    with pytest.raises(kanagata.InputError):
        kanagata.closest(kanagata.read_tool(root / "examples/strip/punch.tool.json"), [[0.0, 0.0]])


def test_materials_have_their_curves():
    assert "mild-steel-neto2012" in kanagata.materials()
    steel = kanagata.material("mild-steel-neto2012")
    strains = np.linspace(0.0, 0.5, 20)
    assert steel.stress_mpa(strains) == pytest.approx(529.5 * (0.00439 + strains) ** 0.268, rel=1e-9)
    locus = steel.yield_locus()
    assert locus.shape == (361, 2) and locus[0] == pytest.approx([1.0, 0.0], abs=1e-9)
    assert steel.limit_curve(1.0).shape[1] == 2
    assert kanagata.material("dc04-nominal").limit_curve(1.0).shape[1] == 2
    with pytest.raises(kanagata.InputError, match="mild-steel-neto2012"):
        kanagata.material("unobtainium")
    with pytest.raises(kanagata.InputError):
        steel.stress_mpa([-0.1])


def test_a_tool_becomes_a_mesh(root):
    pyvista = pytest.importorskip("pyvista")
    mesh = kanagata.mesh_of(kanagata.read_tool(root / "examples/strip/punch.tool.json"))
    assert isinstance(mesh, pyvista.PolyData) and mesh.n_cells > 0 and mesh.area > 0
