#!/usr/bin/env python3
"""Driver of kanagata-solve for Dakota's fork interface: one run of a scene with the values of a parameters file.

  analysis_drivers 'driver.py SCENE'          (Dakota adds the names of the parameters file and of the results file)

Labels of variables are paths of the scene; paths joined by + get the same value. Labels of responses are keys of the file that
`kanagata-solve run --metrics` writes. The parameters file may have Dakota's standard format or aprepro's. Only function values are
computed: the interface needs `no_gradients` and `no_hessians`.

A run that does not converge, or lacks a response, writes FAIL into the results file, and Dakota's failure_capture decides. The
reason is in driver.log. A doubtful run counts; metrics.json in the work directory has its doubts. An input that kanagata-solve
refuses ends the driver with its exit code and no results file, and Dakota stops. kanagata-solve is looked for on the PATH.
"""

import json
import pathlib
import re
import subprocess
import sys

APREPRO = re.compile(r"\{\s*(\S+)\s*=\s*(.*?)\s*\}")
STANDARD = re.compile(r"(.*\S)\s+(\S+)")


def entries(text):
    """Label and value of each line, in both formats."""
    for line in filter(str.strip, text.splitlines()):
        if found := APREPRO.search(line):
            yield found[1], found[2].strip('"')
        elif found := STANDARD.fullmatch(line.strip()):
            yield found[2], found[1]
        else:
            raise SystemExit(f"{line!r} is not a line of a parameters file")


def parameters(text):
    """Values by label, and labels of the responses asked for."""
    pairs = list(entries(text))
    count = next(int(value) for label, value in pairs if label.lower() in ("variables", "dakota_vars"))
    values = dict(pairs[1 : 1 + count])
    if len(values) != count or pairs[0][0].lower() not in ("variables", "dakota_vars"):
        raise SystemExit("the parameters file does not begin with its variables")
    responses = []
    for label, value in pairs[1 + count :]:
        if found := re.fullmatch(r"ASV_\d+:(.+)", label):
            if value != "1":
                raise SystemExit(f"{found[1]}: values only, no gradients (active set {value})")
            responses.append(found[1])
    return values, responses


def command(scene, values):
    """Command of a run."""
    out = ["kanagata-solve", "run", scene, "-o", "out", "--quiet", "--overwrite", "--accept-doubts", "--threads", "1"]
    for paths, value in values.items():
        for path in paths.split("+"):
            out += ["--set", f"{path}={value}"]
    return [*out, "--metrics", "metrics.json"]


def main():
    if len(sys.argv) != 4:
        raise SystemExit(__doc__)
    scene, source, target = sys.argv[1:]
    values, responses = parameters(pathlib.Path(source).read_text())
    with open("driver.log", "w") as log:
        done = subprocess.run(command(scene, values), stdout=log, stderr=log)
        if done.returncode not in (0, 3):
            print(pathlib.Path("driver.log").read_text(), file=sys.stderr)
            raise SystemExit(done.returncode)
        metrics = {} if done.returncode else json.loads(pathlib.Path("metrics.json").read_text())
        missing = [key for key in responses if key not in metrics]
        if done.returncode:
            log.write("not converged\n")
        elif missing:
            log.write(f"no metric {', '.join(missing)}\n")
    lines = ["FAIL"] if done.returncode or missing else [f"{metrics[key]!r} {key}" for key in responses]
    pathlib.Path(target).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
