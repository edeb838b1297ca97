"""A study by the program in the package, and its table as a frame of pandas."""

import subprocess
import sys
from pathlib import Path

import pandas

import kanagata


def main(root: Path, out: Path) -> None:
    study = root / "examples/strip/table.study.json"
    command = [kanagata.program("kanagata"), "study", str(study), "-o", str(out / "study")]
    ended = subprocess.run(command, check=False)
    # 1: there are doubts, which the table names.
    if ended.returncode not in (0, 1):
        raise SystemExit(ended.returncode)
    table = pandas.read_csv(out / "study/study.csv")
    print(table.to_string())


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
