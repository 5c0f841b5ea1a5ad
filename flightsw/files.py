"""Files named by configurations, and files that are written whole or not at all."""

from __future__ import annotations

from pathlib import Path


def beside(config: str | Path, name: str) -> str:
    """What `name`, read from the file `config`, means: a path (it has a suffix) lies beside that file, else in the working
    directory, and comes back absolute; anything else is a name for whoever keeps a library of them, and comes back as it is.
    """
    if Path(name).suffix and not Path(name).is_absolute():
        for path in (Path(config).parent / name, Path(name)):
            if path.is_file():
                return str(path.resolve())
    return name


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that `path` is never half written: as a neighbour first, then renamed.

    Raises OSError naming the file and the reason; what `path` held before is then still there.
    """
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as e:
        try:
            part.unlink(missing_ok=True)
        except OSError:
            pass  # the folder is gone, or read-only: the first reason is the one to tell
        raise OSError(f"{path}: cannot be written: {e.strerror or e}") from None
