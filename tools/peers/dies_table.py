#!/usr/bin/env python3
"""Reads and converts the dies of `tools/peers/dies.py FOLDER` and prints a table: relative error of the area against
the kernel's adaptive integral, time of `inspect`, time and patches of `convert` without and with a tolerance, and the
largest error where the tolerance is not reached. Times are of the processor on one thread [s].

  tools/peers/dies_table.py FOLDER [--tol 0.05mm] [--limit 300] [NAME...]"""
import argparse
import json
import pathlib
import re
import resource
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
FORMS = (".stp", "_143.igs", "_144.igs", "_186.igs", "_car.stp", "_car_144.igs", "_inch.stp")


def program():
    for profile in ("release", "debug"):
        path = ROOT / "target" / profile / "kanagata"
        if path.exists():
            return str(path)
    raise SystemExit("no program in target; run: cargo build --release")


def timed(command, limit):
    """Processor time [s], exit code (None after `limit` seconds) and output of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit)
        code, text = done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        code, text = None, ""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, code, text


def converted(command, limit):
    time, code, text = timed(command, limit)
    if code is None:
        return "limit"
    found = re.search(r"(\d+) patches", text)
    if code not in (0, 1) or not found:
        return f"{time:.1f}: exit {code}"
    error = re.search(r"deviates by ([0-9.]+) mm", text)
    doubt = f" ({error[1]} mm)" if code == 1 and error else ""
    return f"{time:.2f} / {found[1]}{doubt}"


def rows(folder, names, tol, limit):
    truth = json.loads((folder / "dies.json").read_text())["shapes"]
    run = program()
    for name, die in truth.items():
        if names and name not in names:
            continue
        for form in FORMS:
            path = folder / f"{name}{form}"
            if not path.exists():
                continue
            read, _, text = timed([run, "inspect", str(path), "--json", "--threads", "1"], limit)
            area = json.loads(text[: text.rindex("}") + 1])["area_mm2"] if "{" in text else float("nan")
            with tempfile.TemporaryDirectory() as made:
                convert = [run, "convert", str(path), "-o", f"{made}/x.tool.json", "--threads", "1"]
                default = converted(convert, limit)
                toleranced = converted([*convert, "--tol", tol], limit)
            error = area / die["area_mm2"] - 1
            yield f"| {path.name} | {die['faces']} | {error:.0e} | {read:.2f} | {default} | {toleranced} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--tol", default="0.05mm")
    parser.add_argument("--limit", type=float, default=300.0)
    args = parser.parse_args()
    print(f"| file | faces | area error | read [s] | default [s] / patches | --tol {args.tol} [s] / patches |")
    print("|---|---|---|---|---|---|")
    for row in rows(args.folder, args.names, args.tol, args.limit):
        print(row, flush=True)


if __name__ == "__main__":
    main()
