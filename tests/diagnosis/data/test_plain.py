"""Logs of numbers alone, read without pandas as pandas reads them; and what a replay loads, which answers while one watches."""

import json
import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis.data.log import write_csv
from selflock.diagnosis.data.plain import NumberTable
from selflock.diagnosis.data.table import table
from selflock.diagnosis.errors import DataError

from ..residuals.test_experiment import inverse


def test_a_text_of_numbers_is_what_pandas_makes_of_it(rng, tmp_path):
    end, separator = rng.choice(["\n", "\r\n"]), rng.choice([",", ";", "\t", "|"])
    space, gap = rng.choice(["", " "]), rng.choice(["", "nan", "NaN", "null"])
    cells = [
        [f"{x:{rng.choice(['.3f', '.17g', '.6e'])}}" for x in row]
        for row in rng.normal(size=(300, 4)) * 10.0 ** rng.integers(-9, 9)
    ]
    for row in cells[20::37] if not space else ():
        row[2] = gap
    lines = [
        (separator + space).join([str(n), *row]) + separator + str(rng.choice(["True", "false"])) for n, row in enumerate(cells)
    ]
    lines[200:200] = [""] * rng.integers(0, 2)
    header = [
        *["# of a bench"] * rng.integers(0, 2),
        *[""] * rng.integers(0, 2),
        separator.join(["t [s]", "a", "b", "c [A]", "d", "on"]),
    ]
    path = tmp_path / "log.csv"
    text = end.join([*header, *lines, *[""] * rng.integers(0, 3)])
    path.write_bytes(text.encode(rng.choice(["utf-8", "utf-8-sig"])))
    found, told = table(path, plain=True), table(path)
    assert isinstance(found, NumberTable) and isinstance(told, pd.DataFrame)
    assert found.attrs == told.attrs and found.columns == [*told.columns] and len(found) == len(told) == 300
    for name in told.columns:
        np.testing.assert_allclose(
            found[name], told[name].to_numpy(float), rtol=3e-16, err_msg=name
        )  # pandas is off by a last bit
        assert (found[name] == told[name].to_numpy()).mean() > 0.9
    pd.testing.assert_frame_equal(found.pandas(), told, check_dtype=False)


@pytest.mark.parametrize("line", ["1,2,3,4", "1,two,3", "1,2021-03-04 10:00:00,3", "1,2", "1,0x10,3"])
def test_what_is_no_plain_number_is_pandas_matter(tmp_path, line):
    path = tmp_path / "log.csv"
    path.write_text("time,a,b\n" + "0,1,2\n" * 500 + line + "\n")
    try:
        told = table(path)
    except DataError as error:
        with pytest.raises(DataError, match=re.escape(str(error))):
            table(path, plain=True)
    else:
        pd.testing.assert_frame_equal(table(path, plain=True), told)


def test_columns_are_written_as_a_table_of_pandas_is(rng, tmp_path):
    n = int(rng.integers(1, 40))
    columns = {
        "run": np.array([f'a "{k}", ü' for k in range(n)], object),
        "x": np.where(rng.random(n) < 0.2, np.nan, rng.normal(size=n)),
        "n": rng.integers(0, 9, n),
        "good": rng.random(n) < 0.5,
    }
    write_csv(columns, tmp_path / "ours.csv")
    write_csv(pd.DataFrame(columns), tmp_path / "theirs.csv")
    assert (tmp_path / "ours.csv").read_bytes() == (tmp_path / "theirs.csv").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("command", ["replay", "diagnose"])
def test_no_pandas_is_loaded_and_nothing_that_draws(tmp_path, rng, command):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3, n=300)
    told = "import atexit, gc, json, sys; atexit.register(lambda: print(json.dumps([[*sys.modules], gc.get_stats()])))\n"
    entry = "from selflock.cli import main; sys.argv[0] = 'selflock'; main()"
    words = [command, tmp_path / "rig.toml", tmp_path / "log.csv", "-o", tmp_path / "out"]
    done = subprocess.run([sys.executable, "-c", told + entry, *words], capture_output=True, text=True)
    modules, passes = json.loads(done.stdout.splitlines()[-1])
    heavy = {"pandas", "matplotlib", "scipy.signal", "scipy.stats", "scipy.interpolate", "plotly", "dask"}
    heavy |= {"selflock.diagnosis.output.report"} if command == "replay" else set()
    assert "numba" in modules and sorted(heavy & set(modules)) == []
    assert passes[2]["collections"] == 0  # of the collector through all that is loaded
