"""Scenes and runs, inside the process and as a process."""

import _thread
import json
import signal
import threading

import numpy as np
import pytest

import kanagata


@pytest.fixture(scope="module")
def run(strip, tmp_path_factory):
    told = []
    scene = kanagata.Scene(strip, set={"output.vtu_every": 10})
    run = scene.run(tmp_path_factory.mktemp("strip") / "run", on_increment=told.append)
    run.told = told
    return run


def test_a_scene_is_read_checked_and_changed(strip):
    scene = kanagata.Scene(strip, set={"tools.die.friction": 0.05, "name": "changed"})
    assert scene.name == "changed" and scene.tools == ["die", "holder", "punch"]
    assert scene.values["tools"][0]["friction"] == 0.05
    check = scene.check()
    assert check.errors == [] and check.cost["memory_mb"] > 0
    with pytest.raises(kanagata.InputError, match="friction"):
        kanagata.Scene(strip, set={"tools.die.friction": -1})
    with pytest.raises(OSError):
        kanagata.Scene(strip.with_name("none.scene.json"))


def test_a_scene_written_from_values_is_the_same(strip, tmp_path, root):
    values = kanagata.Scene(strip).values
    for tool in values["tools"]:
        tool["file"] = str(root / "examples/strip" / tool["file"])
    again = kanagata.Scene.write(values, tmp_path / "again.scene.json")
    assert again.values == values


def test_a_scene_in_memory_runs_as_its_file_does(strip, tmp_path, run):
    scene = kanagata.Scene(strip)
    memory = kanagata.Scene.of(scene.values, strip.parent, set={"output.vtu_every": 10})
    assert memory.path is None and memory.tools == scene.tools
    assert memory.check().cost == scene.check().cost
    again = memory.run(tmp_path / "memory")
    assert np.array_equal(again.arrays()["punch_force_n"], run.arrays()["punch_force_n"])
    with pytest.raises(kanagata.InputError, match="<memory>.*friction"):
        kanagata.Scene.of(scene.values, strip.parent, set={"tools.die.friction": -1})
    with pytest.raises(kanagata.InputError, match="in memory"):
        memory.run(tmp_path / "process", process=True)
    with pytest.raises(kanagata.InputError, match="in memory"):
        memory.run_to_accuracy(tmp_path / "sequence", 0.1)


def test_a_sequence_has_estimated_errors_and_ends_in_its_time(root, tmp_path):
    set = {"stages.0.drive.punch.travel_mm": 5}
    scene = kanagata.Scene(root / "fixtures/u-draw/u-draw.scene.json", set=set)
    told = []
    run = scene.run_to_accuracy(tmp_path / "sequence", {"force": 0.3, "draw_in_mm": 5}, budget_s=20, on_progress=told.append)
    assert run.accuracy["end"] in ("reached", "time", "options")
    errors = {q["name"]: q.get("error") for q in run.accuracy["quantities"]}
    assert "force.punch" in errors and "draw_in" in errors
    assert len(run.accuracy["runs"]) >= 2 and max(p["run"] for p in told) == len(run.accuracy["runs"])
    assert told[0]["purpose"] == "mesh" and "increment" not in told[0] and any(p.get("done") == 1 for p in told)
    with pytest.raises(kanagata.InputError, match="accuracy.force"):
        scene.run_to_accuracy(tmp_path / "other", 0.9)
    with pytest.raises(RuntimeError, match="enough"):
        scene.run_to_accuracy(tmp_path / "stopped", 0.1, on_progress=lambda p: (_ for _ in ()).throw(RuntimeError("enough")))


def test_tools_are_made_from_the_cad_of_a_scene_once(root, tmp_path):
    scene = json.loads((root / "fixtures/dome/dome.scene.json").read_text())
    for tool, name in zip(scene["tools"], ("round_die_144.igs", "hemi_punch_144.igs")):
        tool["cad"] = {"file": str(root / "fixtures/forming" / name), "tol_mm": 0.05}
    (tmp_path / "dome.scene.json").write_text(json.dumps(scene))
    made = kanagata.make_tools(tmp_path / "dome.scene.json")
    assert [m.name for m in made] == ["die", "punch"] and all(m.is_new for m in made)
    assert all(m.tool.shape_error_mm <= 0.05 for m in made)
    assert not any(m.is_new for m in kanagata.make_tools(tmp_path / "dome.scene.json"))
    assert kanagata.Scene(tmp_path / "dome.scene.json").tools == ["die", "punch"]
    finer = {"tools.die.cad.tol_mm": 0.02}
    die, punch = kanagata.make_tools(tmp_path / "dome.scene.json", finer)
    assert die.is_new and die.file.startswith("die-") and die.tool.shape_error_mm <= 0.02
    assert not punch.is_new and punch.file == scene["tools"][1]["file"]
    assert kanagata.Scene(tmp_path / "dome.scene.json", {**finer, "tools.die.file": die.file}).tools == ["die", "punch"]
    assert not any(m.is_new for m in kanagata.make_tools(tmp_path / "dome.scene.json"))


def test_the_history_is_that_of_the_file_and_of_the_observer(run):
    pandas = pytest.importorskip("pandas")
    file = pandas.read_csv(run.folder / "history.csv")
    assert list(file.columns) == list(run.history.columns)
    for column in ["punch_force_n", "holder_mean_pressure_mpa", "punch_max_pressure_mpa"]:
        assert np.array_equal(file[column], run.arrays()[column])
    assert (file["punch_max_pressure_mpa"] >= file["punch_mean_pressure_mpa"]).all()
    told = [p for p in run.told if p["increment"] > 0]
    assert [p["force_n"]["punch"] for p in told] == list(file["punch_force_n"])
    assert told[-1]["done"] == pytest.approx(1.0) and told[-1]["stage"] == "springback"


def test_record_metrics_and_steps_are_those_of_the_folder(run):
    assert run.record == json.loads((run.folder / "run.json").read_text())
    assert run.metrics["verdict"] == run.verdict
    assert run.metrics["force_max_n.punch"] == pytest.approx(run.arrays()["punch_force_n"].max())
    times = [time for time, _ in run.steps]
    assert times == sorted(times) and times[-1] == pytest.approx(3.0)
    assert all(file.is_file() for _, file in run.steps)
    assert kanagata.Run(run.folder).record == run.record


def test_a_step_is_a_mesh(run):
    pytest.importorskip("pyvista")
    mesh = run.mesh()
    assert mesh.n_cells == 56 and np.isfinite(mesh.points).all()


def test_threads_and_a_process_of_its_own_give_the_same_bits(run, strip, tmp_path):
    expected = (run.folder / "history.csv").read_bytes()
    scene = kanagata.Scene(strip, set={"output.vtu_every": 10})
    assert (scene.run(tmp_path / "one", threads=1).folder / "history.csv").read_bytes() == expected
    told = []
    own = scene.run(tmp_path / "own", process=True, on_increment=told.append)
    assert (own.folder / "history.csv").read_bytes() == expected
    assert [p["force_n"] for p in told] == [p["force_n"] for p in run.told if p["increment"] > 0]


@pytest.mark.parametrize("process", [False, True])
def test_an_exception_of_the_observer_stops_the_run_which_continues(run, strip, tmp_path, process):
    scene = kanagata.Scene(strip, set={"output.vtu_every": 10})

    def stop(progress):
        if progress["increment"] == 5:
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        scene.run(tmp_path / "run", on_increment=stop, process=process)
    assert kanagata.Run(tmp_path / "run").verdict == "stopped"
    with pytest.raises(kanagata.InputError, match="restart"):
        scene.run(tmp_path / "run")
    again = scene.run(tmp_path / "run", restart=True)
    assert (again.folder / "history.csv").read_bytes() == (run.folder / "history.csv").read_bytes()


def test_an_interrupt_stops_the_run_with_a_checkpoint(strip, tmp_path):
    # Fine enough to last longer than the interrupt takes.
    scene = kanagata.Scene(strip, set={"blank.shape.rectangle.elements": [2000, 2]})
    # Interpreters of background jobs ignore the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(1.0, _thread.interrupt_main)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            scene.run(tmp_path / "run")
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
    assert kanagata.Run(tmp_path / "run").verdict == "stopped"


def test_a_run_without_convergence_raises_and_keeps_its_files(strip, tmp_path):
    scene = kanagata.Scene(strip, set={"solver.increments": 3})
    for process in (False, True):
        folder = tmp_path / f"run-{process}"
        with pytest.raises(kanagata.ConvergenceError, match="increments"):
            scene.run(folder, process=process)
        assert len(kanagata.Run(folder).arrays()["increment"]) == 3
