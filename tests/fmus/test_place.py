"""Files that are there whole or not at all."""

import resource

import pytest

from selflock.fmus.place import whole


def test_a_file_is_there_whole_or_as_it_was(tmp_path):
    path = tmp_path / "x.html"
    path.write_text("before")
    with pytest.raises(KeyboardInterrupt), whole(path) as new:
        new.write_text("half")
        raise KeyboardInterrupt
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(OSError) as told, whole(path) as new:
            new.write_text("a" * 10_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert told.value.filename == str(path) and "too large" in told.value.strerror
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]
    with whole(path) as new:
        new.write_text("after")
    assert path.read_text() == "after" and list(tmp_path.iterdir()) == [path]
