"""What is taken away from a process before a stranger's FMU is loaded in it; docs/security.md tells it.

Run as a script, before anything else is imported: a process with threads can no longer leave for namespaces of its own.
Standard library alone.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
from importlib import import_module

TIMEOUT = 60.0  # s of wall time for a step of an FMU in a process of its own, unless its component says otherwise
LIMITS = {
    "AS": 4 << 30,  # bytes of address space: Python with its libraries takes 1 GiB of it
    "CPU": 3600,  # s of processor time for the whole run
    "FSIZE": 1 << 30,  # bytes of one file; the largest that an archive may hold (master.archive)
    "NOFILE": 256,  # open descriptors
    "CORE": 0,  # bytes of a memory dump after a crash: none is written
}
NEWNET, NEWUSER, NEWPID, NEWIPC = 0x40000000, 0x10000000, 0x20000000, 0x08000000  # sched.h
SPACES = "the network, and the reach of your other processes"
DISK = "writing to your files"
WRITES = 1 << 1 | sum(1 << k for k in range(4, 13))  # landlock.h: to write, remove and make files of any kind
REFER, TRUNCATE = 1 << 13, 1 << 14  # from its versions 2 and 3 on


def environment(home: str) -> dict[str, str]:
    """All that an isolated process is told: no PATH, nothing of the user's."""
    kept = {name: os.environ[name] for name in ("LD_LIBRARY_PATH", "SYSTEMROOT") if name in os.environ}
    return kept | {"HOME": home, "TMPDIR": home, "LANG": "C.UTF-8", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def enter(home: str, limits: dict[str, int]) -> list[str]:
    """Give up what can be given up; `home` is the one folder left to write to. Returns what could not be taken away."""
    lacks = [] if _apart() else [SPACES]
    for name, most in limits.items():
        if not _limited(name, most):
            lacks.append(f"more than the limit RLIMIT_{name}")
    if not _deaf(home):
        lacks.append(DISK)
    return lacks


def _c() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def with_parent() -> None:
    """End when the thread that started this process ends: PR_SET_PDEATHSIG."""
    if sys.platform == "linux":
        _c().prctl(1, signal.SIGKILL, 0, 0, 0)


def _apart() -> bool:
    """Go on as the first process of namespaces without network, whose end is the end of all that it started."""
    with_parent()
    if sys.platform != "linux" or not _tried():
        return False
    _leave()
    if child := os.fork():
        os.closerange(3, 64)  # whoever asks must see the end of the child as the end of the line
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if code < 0:
            if code != -signal.SIGKILL:
                signal.signal(-code, signal.SIG_DFL)
            os.kill(os.getpid(), -code)
        os._exit(code)
    with_parent()
    return True


def _tried() -> bool:
    """Whether the kernel lets us, seen in a process that is then gone: half a namespace cannot be left again."""
    child = os.fork()
    if not child:
        try:
            _leave()
            os._exit(0)
        except OSError:
            os._exit(1)
    return os.waitpid(child, 0)[1] == 0


def _leave() -> None:
    user, group = os.geteuid(), os.getegid()
    if _c().unshare(NEWUSER | NEWNET | NEWPID | NEWIPC):
        raise OSError(ctypes.get_errno(), "unshare")
    for file, text in (("setgroups", "deny"), ("uid_map", f"{user} {user} 1"), ("gid_map", f"{group} {group} 1")):
        with open(f"/proc/self/{file}", "w") as target:
            target.write(text)


def _limited(name: str, most: int) -> bool:
    try:
        import resource

        what = getattr(resource, f"RLIMIT_{name}")
        hard = resource.getrlimit(what)[1]
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (most, most))
    except (ImportError, AttributeError, OSError, ValueError):
        return False
    return True


def _deaf(home: str) -> bool:
    """No new rights, no capabilities, and nothing written but below `home`: prctl, capset, Landlock."""
    if sys.platform != "linux":
        return False
    c = _c()
    c.prctl(38, 1, 0, 0, 0)  # PR_SET_NO_NEW_PRIVS
    c.capset((ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)())
    c.syscall.restype = ctypes.c_long
    version = c.syscall(444, None, ctypes.c_size_t(0), 1)
    if version < 1:
        return False
    rights = WRITES | (REFER if version > 1 else 0) | (TRUNCATE if version > 2 else 0)
    rules = c.syscall(444, (ctypes.c_uint64 * 1)(rights), ctypes.c_size_t(8), 0)
    if rules < 0:
        return False
    for path, allowed in ((home, rights), (os.devnull, 1 << 1)):
        below = os.open(path, os.O_PATH)
        rule = allowed.to_bytes(8, sys.byteorder) + below.to_bytes(4, sys.byteorder)
        failed = c.syscall(445, ctypes.c_int(rules), 1, rule, 0)
        os.close(below)
        if failed:
            return False
    done = c.syscall(446, ctypes.c_int(rules), 0) == 0
    os.close(rules)
    return done


if __name__ == "__main__":
    given = json.loads(sys.argv[2])
    missing = enter(given["home"], given["limits"])
    sys.path[:] = given["path"]
    import_module(given["module"]).serve(int(sys.argv[1]), missing, given["only"])
