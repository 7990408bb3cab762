"""A short slice of what `python -m benchmarks.fuzz` does for hours: files of strangers get an answer or one message."""

import logging
import os
import secrets

import inputs
import pytest
import quick
import sequences
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

EACH = {"system": 12, "rig": 12, "log": 8, "sweep": 8, "FMU": 20, "SSP": 10, "results": 25}


def slice_of(ask, count, request):
    """So many draws, of a seed that a failure prints."""
    number = int(os.environ.get("SELFLOCK_SEED") or secrets.randbits(32))
    request.node.add_report_section("call", "random numbers", f"SELFLOCK_SEED={number} draws the same again")

    @seed(number)
    @settings(max_examples=count, deadline=None, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
    @given(st.data())
    def draws(data):
        ask(data)

    draws()


@pytest.mark.slow
@pytest.mark.parametrize("kind", inputs.KINDS)
def test_strangers_files_get_an_answer_or_one_message(kind, tmp_path, request):
    logging.getLogger("selflock").setLevel(logging.CRITICAL)
    try:
        slice_of(lambda data: inputs.ask(kind, data, tmp_path), EACH[kind], request)
    finally:
        logging.getLogger("selflock").setLevel(logging.NOTSET)


@pytest.mark.parametrize("kind", quick.KINDS)
def test_small_inputs_by_the_thousand(kind, tmp_path):
    logging.disable(logging.CRITICAL)
    try:
        seed = os.environ.get("SELFLOCK_SEED") or secrets.randbits(32)
        for number in range(60):
            try:
                quick.ask(kind, f"{seed} {number}", tmp_path)
            except BaseException as error:
                error.add_note(f"SELFLOCK_SEED={seed} draws the same again")
                raise
    finally:
        logging.disable(logging.NOTSET)


@pytest.mark.slow
@pytest.mark.skipif(not sequences.possible(), reason="a host other than Python cannot be made here")
@pytest.mark.parametrize("name", sequences.FMUS)
def test_any_calls_of_any_host_are_answered(name, request):
    slice_of(lambda data: sequences.ask(name, data), 2, request)
