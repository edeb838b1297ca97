#!/usr/bin/env python3
"""Sobol indices of results of a run, with SALib: the fraction of their variance that each value of the scene explains.

  pip install SALib
  sobol.py SCENE --programs target/release --work out/sobol --metric force_max_n.punch --metric springback_max_mm \\
      --vary tools.die.friction=tools.punch.friction:0.05:0.15 --vary material.hardening.k:450:610 [--runs 64] [--jobs 2]

Each --vary has one or more paths of the scene (joined by =, all get the same value), and its range, in which it is uniformly
distributed. Each --metric is a key of the file that `kanagata-solve run --metrics` writes. D values need N (D + 2) runs, N a power
of 2; --runs has their number. The table has the first-order index of each value, the total index, both with the half-width of the
95 % confidence interval, and for comparison the fraction that a linear regression attributes to the value, with its R2. Where R2
is near 1 the regression is the more precise of the two: the confidence intervals of 64 runs are wide.

WORK/runs.csv has values and metrics of all runs, WORK/sobol.json the indices. A run that does not converge, or has no such metric,
leaves a hole in the sample: all such runs are named, no index is computed, and the exit code is 3. Doubtful runs count, and their
number is printed.
"""

import argparse
import collections
import concurrent.futures
import csv
import json
import pathlib
import shutil
import subprocess
import sys

import numpy
from SALib.analyze import sobol as indices
from SALib.sample import sobol as sample


def solve(args, number, values):
    """One run: its metrics, or the reason why there are none."""
    folder = args.work / f"run-{number}"
    command = [args.programs / "kanagata-solve", "run", args.scene, "-o", folder, "--quiet", "--overwrite", "--accept-doubts"]
    for paths, value in values.items():
        for path in paths.split("="):
            command += ["--set", f"{path}={value!r}"]
    # Each run has one thread: several runs use the processors better.
    command += ["--threads", "1", "--metrics", f"{folder}.json"]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    shutil.rmtree(folder, ignore_errors=True)
    if done.returncode == 3:
        return "not converged"
    if done.returncode:
        raise SystemExit(f"run {number}, {values}: exit code {done.returncode}\n{done.stderr}")
    metrics = json.loads(pathlib.Path(f"{folder}.json").read_text())
    missing = [key for key in args.metric if key not in metrics]
    return f"no metric {', '.join(missing)}" if missing else metrics


def solve_all(args, names, table):
    """Metrics or reason of every run, in the order of the table."""
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        work = [pool.submit(solve, args, k, dict(zip(names, row))) for k, row in enumerate(table.tolist())]
        try:
            return [one.result() for one in work]
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def linear(problem, table, found):
    """R2 of a linear regression, and the fraction of the variance that it attributes to each value."""
    system = numpy.column_stack([numpy.ones(len(table)), table])
    slopes = numpy.linalg.lstsq(system, found, rcond=None)[0]
    residual = numpy.var(found - system @ slopes)
    # Variance of a uniform distribution.
    parts = [slope**2 * (high - low) ** 2 / 12 for slope, (low, high) in zip(slopes[1:], problem["bounds"])]
    return 1 - residual / numpy.var(found), [part / (sum(parts) + residual) for part in parts]


def analysis(problem, table, found):
    """Indices of one metric by value of the scene."""
    if numpy.ptp(found) <= 1e-12 * numpy.abs(found).max():
        raise SystemExit(f"no index: the metric is {found[0]:g} in all runs")
    result = indices.analyze(problem, found, calc_second_order=False, num_resamples=1000, conf_level=0.95, seed=1)
    r2, fractions = linear(problem, table, found)
    values = {
        name: {
            "first": float(result["S1"][k]), "first_confidence": float(result["S1_conf"][k]),
            "total": float(result["ST"][k]), "total_confidence": float(result["ST_conf"][k]),
            "linear": float(fractions[k]),
        }
        for k, name in enumerate(problem["names"])
    }
    return {"mean": float(found.mean()), "standard_deviation": float(found.std(ddof=1)), "linear_r2": float(r2), "values": values}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--vary", action="append", required=True, metavar="PATHS:LOW:HIGH")
    parser.add_argument("--metric", action="append", required=True, metavar="KEY")
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("target/release"))
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--runs", type=int, default=64)
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    ranges = {}
    for one in args.vary:
        paths, low, high = one.rsplit(":", 2)
        ranges[paths] = [float(low), float(high)]
    problem = {"num_vars": len(ranges), "names": [*ranges], "bounds": [*ranges.values()]}
    count, rest = divmod(args.runs, len(ranges) + 2)
    if rest or count < 2 or count & (count - 1):
        choices = [2**k * (len(ranges) + 2) for k in range(3, 8)]
        parser.error(f"--runs {args.runs}: {len(ranges)} values need one of {', '.join(map(str, choices))} runs")
    args.work.mkdir(parents=True, exist_ok=True)
    table = sample.sample(problem, count, calc_second_order=False, seed=1)
    found = solve_all(args, [*ranges], table)

    with open(args.work / "runs.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["run", *ranges, *args.metric, "failure"])
        for k, (row, one) in enumerate(zip(table.tolist(), found)):
            lost = isinstance(one, str)
            rows.writerow([k, *row, *("" if lost else one[key] for key in args.metric), one if lost else ""])
    failed = {k: one for k, one in enumerate(found) if isinstance(one, str)}
    for k, reason in failed.items():
        values = ", ".join(f"{name} = {value:.4g}" for name, value in zip(ranges, table[k]))
        print(f"run {k}: {reason}, at {values}", file=sys.stderr)
    if failed:
        print(f"no indices: {len(failed)} of {len(found)} runs failed; choose ranges in which all runs converge", file=sys.stderr)
        raise SystemExit(3)
    doubts = collections.Counter(code for one in found for code in one["doubts"].split())
    for code, times in doubts.items():
        print(f"doubt {code}: {times} of {len(found)} runs")

    results = {}
    for key in args.metric:
        one = results[key] = analysis(problem, table, numpy.array([metrics[key] for metrics in found]))
        print(f"{key}: mean {one['mean']:.4g}, standard deviation {one['standard_deviation']:.3g}; linear R2 {one['linear_r2']:.4f}")
        for name, value in one["values"].items():
            first = f"first {value['first']:6.3f} +- {value['first_confidence']:.3f}"
            total = f"total {value['total']:6.3f} +- {value['total_confidence']:.3f}"
            print(f"  {first}   {total}   linear {value['linear']:6.3f}   {name}")
    record = {"scene": args.scene, "runs": len(found), "doubts": dict(doubts), "ranges": ranges, "metrics": results}
    (args.work / "sobol.json").write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
