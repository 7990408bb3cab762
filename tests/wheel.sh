#!/usr/bin/env bash
# The wheel as a user has it: installed into a fresh environment, used from a folder with files named like the rooms.
# All commands run with that folder on Python's path, where such files would be found first.
set -euo pipefail
unset PYTHONPATH  # with the sources on it pip takes them for what it is to install
root=$(cd "$(dirname "$0")/.." && pwd)
python=$(cd "$root" && realpath -s "${PYTHON:-python3}")
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
quiet="--quiet --disable-pip-version-check"

mkdir "$made/source" "$made/here"
rooms="selflock fmus master vehicle view study diagnosis sweep examples"
(cd "$root" && cp -r pyproject.toml README.md LICENSE NOTICE $rooms "$made/source")  # no build/ from before
"$python" -m pip $quiet wheel --no-deps --wheel-dir "$made" "$made/source"
"$python" -m venv "$made/venv"
"$made/venv/bin/pip" $quiet install "$(echo "$made"/*.whl)[all]"

cd "$made/here"
mkdir sweep
for decoy in master.py fmus.py diagnosis.py study.py vehicle.py sweep/__init__.py; do
    echo 'raise SystemExit("the decoy '$decoy' was imported")' >"$decoy"
done
cat >rig.toml <<'END'
[rig]
kind = "steady"
run = "run"
hold_out = "every second run"
known = ["reducer.gear_ratio", "reducer.wedge_angle", "load.*"]
[columns]
"reducer.input_speed" = { column = "speed", unit = "rad/s" }
"motor.torque" = { column = "torque", unit = "N.m" }
[parameters]
"reducer.gear_ratio" = 50.0
"reducer.friction_kinetic" = 0.02
"load.constant_torque" = 1.0
[uncertain]
"reducer.friction_kinetic" = [0.0, 0.5]
END
cat >log.py <<'END'
"""Steady runs of a gear whose friction grows with speed."""
import numpy as np
from selflock.fmus.reducer import wedge

rng, t = np.random.default_rng(1), wedge.wedge_tangent(50.0, 0.0)
rows = ["run,time,speed,torque"]
for run, speed in enumerate(np.concatenate([-np.linspace(1.0, 40.0, 16), np.linspace(1.0, 40.0, 16)])):
    torque = wedge.sliding_torque(1.0, np.sign(speed), 0.02, 0.0, t, 50.0) + 4e-4 * speed
    rows += [f"{run},{0.01 * k},{speed},{torque + 2e-4 * rng.standard_normal()}" for k in range(50)]
open("log.csv", "w").write("\n".join(rows) + "\n")
END

selflock=("$made/venv/bin/python" -m selflock.cli)
"$made/venv/bin/selflock" --version
"${selflock[@]}" example bench
"${selflock[@]}" build -o fmus_here
test "$(ls fmus_here | wc -l)" = 7
"${selflock[@]}" run bench.toml -o bench.csv
test "$(wc -l <bench.csv)" = 1002
"$made/venv/bin/python" log.py
"${selflock[@]}" diagnose rig.toml log.csv -o found
grep -q 'reducer.viscous_damping' found/diagnosis.json && test -s found/report.html
"$made/venv/bin/python" -c 'import selflock; selflock.load; selflock.study; selflock.sweep; selflock.errors.DataError'
echo "the wheel holds"
