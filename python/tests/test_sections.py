"""Sections of a U-channel against the nodes in its VTU files, by means of NumPy alone."""

import numpy as np
import pytest

import kanagata

pyvista = pytest.importorskip("pyvista")


def middle_line(mesh, initial):
    """Middle of the sheet over x of the flat blank, where y is 0: one element wide, so any of both sides serves."""
    side = np.abs(initial[:, 1]) < 1e-9
    x, z = initial[side, 0], initial[side, 2]
    points = np.asarray(mesh.points)[side]
    low, high = (np.flatnonzero(np.abs(z - end) < 1e-9) for end in (z.min(), z.max()))
    low, high = low[np.argsort(x[low])], high[np.argsort(x[high])]
    assert np.allclose(x[low], x[high])
    return x[low], 0.5 * (points[low] + points[high])[:, [0, 2]]


def chord(arc, line, piece):
    """Unit vector from 20 to 80 % of a piece."""
    ends = [piece[0] + t * (piece[1] - piece[0]) for t in (0.2, 0.8)]
    a, b = (np.array([np.interp(s, arc, line[:, k]) for k in (0, 1)]) for s in ends)
    return (b - a) / np.linalg.norm(b - a)


def corner(arc, line, one, other):
    """Angle in the corner between two pieces [degrees]."""
    return 180.0 - np.degrees(np.arccos(chord(arc, line, one) @ chord(arc, line, other)))


def test_angles_and_curl_are_those_of_the_nodes(strip, tmp_path):
    changes = {"output.vtu_every": 1, "output.sections": [{"normal": "y", "at_mm": 0.5}]}
    run = kanagata.Scene(strip, set=changes).run(tmp_path / "run")
    (section,) = run.record["sections"]
    (wall,) = section["walls"]
    # The blank begins at x = 0: the length along it is x.
    held_step = max(k for k, (time, _) in enumerate(run.steps) if time <= 2.0)
    initial = np.asarray(run.mesh(0).points) - np.asarray(run.mesh(0).point_data["displacement_mm"])
    for step, key in ((held_step, ""), (-1, "released_")):
        arc, line = middle_line(run.mesh(step), initial)
        assert np.allclose(line, np.array(section["released_mm" if key else "held_mm"])[:, [0, 2]], atol=2e-4)
        bottom, flange = (0.0, wall["arc_mm"][0]), (wall["arc_mm"][1], arc[-1])
        assert wall[key + "wall_deg"] == pytest.approx(corner(arc, line, bottom, wall["arc_mm"]), abs=2e-3)
        assert wall[key + "flange_deg"] == pytest.approx(corner(arc, line, wall["arc_mm"], flange), abs=2e-3)
    assert wall["released_wall_deg"] > wall["wall_deg"] + 0.5
    # Circle through the wall: an algebraic fit of NumPy.
    low, high = (wall["arc_mm"][0] + t * np.ptp(wall["arc_mm"]) for t in (0.2, 0.8))
    inner = line[(arc > low) & (arc < high)]
    ends = np.array([[np.interp(s, arc, line[:, k]) for k in (0, 1)] for s in (low, high)])
    points = np.vstack([ends, inner])
    points = points - points.mean(axis=0)
    rows = np.column_stack([2 * points, np.ones(len(points))])
    cx, cy, d = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    assert wall["curl_radius_mm"] == pytest.approx(np.sqrt(d + cx**2 + cy**2), rel=1e-2)


def test_a_plane_beside_the_blank_is_refused(strip, tmp_path):
    scene = kanagata.Scene(strip, set={"output.sections": [{"normal": "y", "at_mm": 5.0}]})
    assert any("does not cut the blank" in f["what"] for f in scene.check().errors)
    with pytest.raises(kanagata.InputError, match="does not cut"):
        scene.run(tmp_path / "run")
