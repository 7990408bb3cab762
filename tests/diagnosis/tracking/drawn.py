"""Folders of diagnoses as JSON, drawn and not simulated."""

import json
from datetime import datetime, timedelta


def write(folder, rng, units=8, months=10, worn=None, name="unit {}", told_by="rig"):
    """A diagnosis for each unit and month; some units grow by a share from the fifth month on."""
    for unit in range(units):
        for month in range(months):
            value = 2e-4 * (1.0 + (worn or {}).get(unit, 0.0) * max(0, month - 4) / (months - 5) + 0.01 * rng.standard_normal())
            number = {"name": "reducer.viscous_damping", "value": value, "low": 0.98 * value, "high": 1.02 * value}
            about = {
                "rig": "bench", "unit": name.replace("{}", str(unit)), "version": "1", "told_by": told_by,
                "recorded": (datetime(2026, 1, 1) + timedelta(days=30 * month)).isoformat(),
                "logs": [{"log": "a.csv", "sha256": f"{unit} {month}", "test": False}],
            }  # fmt: skip
            told = {"verdict": "none", "causes": [], "uncertain": [number | {"unit": "N.m.s/rad"}], "about": about}
            place = folder / f"{unit}" / f"{month}"
            place.mkdir(parents=True)
            (place / "diagnosis.json").write_text(json.dumps(told))
    return folder
