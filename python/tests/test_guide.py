"""The page of the guide on Python does what it says."""

import re

import kanagata


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


def test_the_page_runs_as_it_is_written(root, tmp_path, monkeypatch, capsys):
    page = (root / "docs/guide/python.md").read_text()
    (code,) = blocks(page, "python")
    assert 'scene.run("out/strip"' in code
    monkeypatch.chdir(root)
    names = {}
    exec(compile(code.replace("out/strip", str(tmp_path / "strip")), "python.md", "exec"), names)
    assert names["punch"].shape_error_mm <= 0.01 and names["punch"].doubts == []
    assert abs(names["error"].max_mm) <= 0.01 and len(names["points"]) == len(names["patches"])
    assert names["run"].verdict == "completed" and names["run"].doubts == []
    printed = capsys.readouterr().out
    assert f"{names['run'].metrics['thickness_min_mm']}" in printed
    # Every name of the module and of a run that the page calls exists.
    calls = set(re.findall(r"`kanagata\.(\w+)", page))
    of_run = set(re.findall(r"`run\.(\w+)", page)) - {"json"}
    assert len(calls) >= 6 and len(of_run) >= 6
    assert [name for name in calls if not hasattr(kanagata, name)] == []
    assert [name for name in of_run if not hasattr(names["run"], name)] == []
