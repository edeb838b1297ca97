#!/usr/bin/env python3
"""Identifies friction and hardening of a sheet from a measured curve of force over travel, with Optuna.

  pip install optuna cmaes
  identify.py SCENE CURVE.csv --tool punch --programs target/release --work out/identify \\
      --vary tools.die.friction=tools.punch.friction:0.02:0.3 --vary material.hardening.k:300:900 [--trials 60]

CURVE.csv has two columns, travel in mm and force in N, of the tool named; a first line of titles is skipped. Each --vary has
one or more paths of the scene (joined by =, all get the same value), and its range. The objective is the RMS of the
difference of the two curves over the RMS of the measured one, at every measured travel up to the largest of the run. Of a run
only the increments count in which the travel grows, so stages after the draw do no harm. A run that does not converge has the
objective 1e3; a doubtful one counts, and its doubts are printed. The sampler is CMA-ES, or TPE for a single value.
WORK/trials.csv lists all trials. The last line has the best values as JSON.
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
    """Travel and force of a tool in history.csv, from no travel on, where the travel exceeds all before."""
    with open(run / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    if f"{tool}_travel_mm" not in rows[0]:
        raise SystemExit(f"{run / 'history.csv'} has no tool {tool}")
    curve = [(0.0, 0.0)]
    for row in rows:
        travel, force = float(row[f"{tool}_travel_mm"]), float(row[f"{tool}_force_n"])
        if travel > curve[-1][0]:
            curve.append((travel, force))
    return curve


def measurement(path):
    """Travel and force by line; a first line that has no numbers is skipped."""
    with open(path, newline="") as file:
        rows = [row for row in csv.reader(file) if row]
    for k, row in enumerate(rows):
        try:
            rows[k] = (float(row[0]), float(row[1]))
        except (ValueError, IndexError):
            if k:
                raise SystemExit(f"{path}: {','.join(row)} is not a travel and a force") from None
            rows[k] = None
    return [row for row in rows if row]


def at(curve, travel):
    """Force at a travel, linear between the points of a curve."""
    for (x0, y0), (x1, y1) in zip(curve, curve[1:]):
        if x0 <= travel <= x1:
            return y0 + (y1 - y0) * (travel - x0) / (x1 - x0)
    return curve[-1][1]


def covered(found, measured):
    """Points of the measured curve up to the end of the one found."""
    return [(x, y) for x, y in measured if 0.0 <= x <= found[-1][0] * (1 + 1e-9)]


def difference(found, measured):
    """RMS of the difference over the RMS of the measured curve."""
    points = covered(found, measured)
    return math.sqrt(sum((at(found, x) - y) ** 2 for x, y in points) / sum(y * y for _, y in points))


def solve(args, values, folder):
    """One run; its curve, or None if it did not converge."""
    command = [args.programs / "kanagata-solve", "run", args.scene, "-o", folder, "--quiet", "--overwrite", "--accept-doubts"]
    for paths, value in values.items():
        for path in paths.split("="):
            command += ["--set", f"{path}={value!r}"]
    done = subprocess.run([*map(str, command), "--metrics", f"{folder}.json"], capture_output=True, text=True)
    if done.returncode == 3:
        return None
    if done.returncode:
        raise SystemExit(done.stderr)
    metrics = json.loads(pathlib.Path(f"{folder}.json").read_text())
    if metrics["doubts"]:
        print(f"{values}: {metrics['doubts']}")
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
    measured = measurement(args.curve)

    def objective(trial):
        values = {paths: trial.suggest_float(paths, *ranges[paths]) for paths in ranges}
        found = solve(args, values, args.work / "run")
        if found is None:
            return FAILED
        points = covered(found, measured)
        if not any(y for _, y in points):
            raise SystemExit(f"{args.curve} has no force up to {found[-1][0]:g} mm, the travel of {args.tool} in the run")
        trial.set_user_attr("points", len(points))
        return difference(found, measured)

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    # CMA-ES needs two values or more.
    samplers = optuna.samplers
    study = optuna.create_study(sampler=samplers.CmaEsSampler(seed=1) if len(ranges) > 1 else samplers.TPESampler(seed=1))
    study.optimize(objective, n_trials=args.trials)
    with open(args.work / "trials.csv", "w", newline="") as file:
        table = csv.writer(file)
        table.writerow([*ranges, "objective"])
        table.writerows([*(trial.params[paths] for paths in ranges), trial.value] for trial in study.trials)
    failed = sum(trial.value == FAILED for trial in study.trials)
    if failed == len(study.trials):
        raise SystemExit(f"none of {failed} runs converged")
    if failed:
        print(f"{failed} of {len(study.trials)} runs did not converge")
    points = study.best_trial.user_attrs["points"]
    if points < len(measured):
        print(f"{points} of {len(measured)} measured points count: the run has no travel at the others")
    print(json.dumps({"objective": study.best_value, "values": study.best_params}))


if __name__ == "__main__":
    main()
