#!/usr/bin/env python3
"""Identifies friction and hardening of a sheet from a measured curve of force over travel, with Optuna.

  pip install optuna
  identify.py SCENE CURVE.csv --tool punch --programs target/release --work out/identify \\
      --vary tools.die.friction=tools.punch.friction:0.02:0.3 --vary material.hardening.k:300:900 [--trials 60]

CURVE.csv has two columns, travel in mm and force in N, of the tool named. Each --vary has one or more paths of the scene (joined
by =, all get the same value), and its range. The objective is the RMS of the difference of the two curves over the RMS of the
measured one, at every measured travel up to the end of the run. A run that does not converge has the objective 1e3; a doubtful
one counts, and its doubts are printed. The last line has the best values as JSON.
"""

import argparse
import csv
import json
import math
import pathlib
import subprocess

import optuna

FAILED = 1e3


def curve_of(run, tool):
    """Travel and force of a tool in history.csv, from no travel on."""
    with open(run / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return [(0.0, 0.0)] + [(float(r[f"{tool}_travel_mm"]), float(r[f"{tool}_force_n"])) for r in rows]


def at(curve, travel):
    """Force at a travel, linear between the points of a curve."""
    for (x0, y0), (x1, y1) in zip(curve, curve[1:]):
        if x0 <= travel <= x1 and x1 > x0:
            return y0 + (y1 - y0) * (travel - x0) / (x1 - x0)
    return curve[-1][1]


def difference(found, measured):
    """RMS of the difference over the RMS of the measured curve."""
    pairs = [(at(found, x), y) for x, y in measured if x <= found[-1][0] + 1e-9]
    return math.sqrt(sum((a - b) ** 2 for a, b in pairs) / sum(b * b for _, b in pairs))


def solve(args, values, folder):
    """One run; its curve, or None if it did not converge."""
    command = [args.programs / "kanagata-solve", "run", args.scene, "-o", folder, "--quiet", "--overwrite", "--accept-doubts"]
    for paths, value in values.items():
        for path in paths.split("="):
            command += ["--set", f"{path}={value!r}"]
    done = subprocess.run([*map(str, command), "--metrics", str(folder) + ".json"], capture_output=True, text=True)
    if done.returncode == 3:
        return None
    if done.returncode:
        raise SystemExit(done.stderr)
    metrics = json.loads(pathlib.Path(f"{folder}.json").read_text())
    if metrics["doubts"]:
        print(f"{folder.name}: {metrics['doubts']}")
    return curve_of(folder, args.tool)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("curve", type=pathlib.Path)
    parser.add_argument("--tool", required=True)
    parser.add_argument("--vary", action="append", required=True, metavar="PATHS:LOW:HIGH")
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("target/release"))
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--trials", type=int, default=60)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    ranges = {}
    for one in args.vary:
        paths, low, high = one.rsplit(":", 2)
        ranges[paths] = (float(low), float(high))
    with open(args.curve, newline="") as file:
        measured = [(float(x), float(y)) for x, y in csv.reader(file)]

    def objective(trial):
        values = {paths: trial.suggest_float(paths, *ranges[paths]) for paths in ranges}
        found = solve(args, values, args.work / "run")
        return FAILED if found is None else difference(found, measured)

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1, multivariate=True))
    study.optimize(objective, n_trials=args.trials)
    print(json.dumps({"objective": study.best_value, "values": study.best_params}))


if __name__ == "__main__":
    main()
