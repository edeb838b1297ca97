"""What the wheel holds: both programs, types, and examples that run."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

import kanagata


def test_both_programs_are_of_this_version():
    for name in ("kanagata", "kanagata-solve"):
        out = subprocess.run([kanagata.program(name), "--version"], check=True, capture_output=True, text=True).stdout
        assert out.startswith(f"{name} {kanagata.__version__}"), out
    with pytest.raises(ValueError):
        kanagata.program("sh")


def test_the_types_of_scenes_are_those_of_the_schema(root, tmp_path):
    made = tmp_path / "types.py"
    script = [sys.executable, str(root / "python/make_types.py"), str(root / "schemas/scene.schema.json"), str(made)]
    subprocess.run(script, check=True)
    own = Path(kanagata.__file__).with_name("scene_types.py")
    assert own.read_text() == made.read_text(), "run python/make_types.py schemas/scene.schema.json python/kanagata/scene_types.py"
    assert own.with_name("py.typed").exists() and own.with_name("_kanagata.pyi").exists()


def test_every_name_has_a_description():
    for name in kanagata.__all__:
        if name not in ("Progress", "__version__"):
            assert getattr(kanagata, name).__doc__, name


EXPECTED = {
    "cup": r"least thickness 0\.\d+ mm, thinning \d+\.\d%",
    "springback": r"corner \d+\.\d+ degrees with the tools, \d+\.\d+ without: \+",
    "audit_chart": r"facets +\d+ patches",
    "identify_friction": r"friction 0\.1[12]\d+, that of the curve 0\.12",
    "study_table": r"force_max_n",
}


@pytest.mark.parametrize("name", EXPECTED)
def test_an_example_runs_and_prints_its_result(name, root, tmp_path):
    needed = {"springback": "pyvista", "study_table": "pandas"}.get(name)
    if needed and importlib.util.find_spec(needed) is None:
        pytest.skip(f"needs {needed}")
    script = Path(__file__).parents[1] / "examples" / f"{name}.py"
    ended = subprocess.run(
        [sys.executable, str(script), str(root), str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert re.search(EXPECTED[name], ended.stdout), ended.stdout
