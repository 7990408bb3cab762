"""Functions that workers import: small runs of every temper."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from selflock.master import Part, PartFailed, Variable


def draw(context, item):
    """A number that depends on the item's seed alone; every seventh fails."""
    time.sleep(item.get("sleep", 0.0))
    if item["seed"] % 7 == 6:
        raise ValueError(f"seed {item['seed']} cannot be")
    return {"drawn": np.random.default_rng(item["seed"]).normal() + context["offset"]}


def note(context, item):
    """Leaves a mark each time it is run."""
    with open(Path(context) / f"{item}.mark", "a") as file:
        file.write("x")
    time.sleep(0.15)
    return {"item": item}


def crash(context, item):
    """Kills its worker always ("always"), the first time ("once"), or not."""
    mark = Path(context) / "crashed"
    if item["crash"] == "always" or (item["crash"] == "once" and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"process": os.getpid()}


class Opened:
    """A context that tells how often it was opened, and where."""

    def __init__(self, log):
        self.log = str(log)

    def open(self, folder):
        self.folder = folder
        (folder / "unpacked").write_text("x")
        with open(self.log, "a") as file:
            file.write(f"{os.getpid()} {folder}\n")

    def close(self):
        (self.folder / "unpacked").unlink()
        with open(self.log, "a") as file:
            file.write(f"{os.getpid()} closed\n")


def look(context, item):
    return {"there": (context.folder / "unpacked").exists()}


class Brittle(Part):
    """A part of a system that breaks at t = 0.005 s where `load` is above 1, and dies with its process above 2."""

    described = (
        Variable("load", "", 0.0, minimum=0.0, causality="parameter"),
        Variable("y", "N.m", 0.0, depends_on=(), causality="output"),
    )

    def step(self, time, size):
        load = self.values["load"]
        if load > 2.0:
            os.kill(os.getpid(), signal.SIGKILL)
        if load > 1.0 and time > 0.0045:
            raise PartFailed(self.name, time, size, "Error", {}, [f"Error: {load} is too much"])
        self.values["y"] = load
