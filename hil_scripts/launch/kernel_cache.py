"""Where numba keeps compiled kernels, and whether they are there.

numba rebuilds a cached function when *its own* file changes, not when a function it calls changes in another file. So
the cache folder is named by a digest of every source file that holds kernels: edit any of them and the next start
compiles afresh, in a visible step, instead of flying stale machine code.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import sys
import tempfile
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from flightsw import plugins

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("flightsw", "sim_plant")  # of this project, with kernels
KEEP = 4  # older digests are removed


def kernel_sources() -> list[Path]:
    """Every source file of the flying programs, and of packages that bring parts of theirs, that mentions the `jit` decorator,
    and every file of theirs those name in a `from ... import`: a constant is compiled in."""
    folders = {ROOT / pkg for pkg in PACKAGES}
    for name in plugins.packages():
        top = find_spec(name)
        folders |= {Path(p) for p in (None if top is None else top.submodule_search_locations) or ()}
    # every start comes here: by names, a file's path is made of those that are found
    place, text = {}, {}
    for folder in folders:
        for here, _, names in os.walk(folder):
            package = f"{folder.name}{here[len(str(folder)) :]}".replace(os.sep, ".")
            for name in names:
                if name.endswith(".py"):
                    module = f"{package}.{name[:-3]}"
                    place[module] = f"{here}{os.sep}{name}"
                    with open(place[module], "rb") as f:
                        text[module] = f.read()
    found = {m for m, t in text.items() if b"jit" in t and re.search(rb"\bjit\b", t)}
    new = set(found)
    while new:
        named = {n.decode() for m in new for n in re.findall(rb"^from ([\w.]+) import", text[m], re.MULTILINE)}
        new = (named & place.keys()) - found
        found |= new
    return sorted(Path(place[m]) for m in found)


def processor() -> str:
    """What numba compiles for here: NUMBA_CPU_NAME and NUMBA_CPU_FEATURES if set, and this machine's processor as the system
    names it. Kernels of another are not loaded but compiled anew by every process that needs them."""
    named = [os.environ.get(k, "") for k in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")]
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        text = ""
    host = [
        m.group() for k in ("model name", "flags", "Features") if (m := re.search(rf"^{k}\s*:.*$", text, re.MULTILINE))
    ]
    return " ".join([*named, *(host or [platform.processor()])])


def digest() -> str:
    """Hash of kernel sources (content and time, both of which numba checks), interpreter, numba version and processor."""
    h = hashlib.sha256(f"{sys.version_info[:3]} {version('numba')} {platform.machine()} {processor()}".encode())
    for p in kernel_sources():
        h.update(f"{p}{p.stat().st_mtime_ns}".encode())
        h.update(p.read_bytes())
    return h.hexdigest()[:16]


def _base() -> Path:
    """In a checkout its build folder; installed, the user's cache."""
    home = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    mine = ROOT / "build" if (ROOT / "pyproject.toml").exists() else Path(home).expanduser() / "wakefield"
    for base in (mine / "numba", Path(tempfile.gettempdir()) / f"wakefield-numba-{os.getuid()}"):
        try:
            base.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(base, os.W_OK):
            return base
    raise OSError("no writable folder for compiled kernels (tried build/numba and the temporary folder)")


def refuse_foreign(folder: Path) -> None:
    """Raise OSError for a folder of compiled kernels that another user owns or may write to: what lies in it gets executed."""
    s = folder.stat()
    if s.st_uid != os.getuid():
        raise OSError(
            f"{folder}: compiled kernels of another user (id {s.st_uid}) are not executed; remove it, or set NUMBA_CACHE_DIR"
        )
    if s.st_mode & 0o002:
        raise OSError(
            f"{folder}: everybody may write there (mode {s.st_mode & 0o777:o}): compiled kernels are not executed from it"
        )


def cache_dir() -> Path:
    """The folder for NUMBA_CACHE_DIR; an NUMBA_CACHE_DIR already in the environment wins. Created, old ones removed."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        Path(given).mkdir(parents=True, exist_ok=True)
        refuse_foreign(Path(given))
        return Path(given)
    base = _base()
    mine = base / digest()
    mine.mkdir(exist_ok=True)
    for folder in (base, mine):
        refuse_foreign(folder)
    os.utime(mine)
    others = sorted((d for d in base.iterdir() if d.is_dir()), key=lambda d: d.stat().st_mtime, reverse=True)
    for old in others[KEEP:]:
        shutil.rmtree(old, ignore_errors=True)
    return mine


def use() -> Path:
    """Point this process and its children at `cache_dir()`. Call before numba is imported."""
    d = cache_dir()
    os.environ["NUMBA_CACHE_DIR"] = str(d)
    return d


def is_warm() -> bool:
    """True when a warm-up has completed into the current cache folder (or compilation is switched off)."""
    return os.environ.get("NUMBA_DISABLE_JIT") == "1" or (cache_dir() / "warm").exists()


def mark_warm() -> None:
    """Record that every kernel has been compiled into the current cache folder."""
    (cache_dir() / "warm").touch()
