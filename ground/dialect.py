"""The complete dialect for other people's tools: the stock `common` set and the house's messages in one file.

The generator of the stock library makes it, from the XML the library brings and ours. What `common` has already (a standard
message, an entry of a standard enumeration) is left to it.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

from flightsw.icd.dialect import files

LANGUAGES = {".py": "Python3", ".lua": "WLua", ".xml": ""}  # by the name of the file
NAME = "wakefield"


class DialectError(ValueError):
    """The dialect cannot be made. The text says why."""


def stock_folder() -> Path:
    """Where the stock library keeps its dialects, XML and modules."""
    import pymavlink.dialects.v20 as stock

    return Path(stock.__path__[0])


def _stock(folder: Path) -> tuple[set[int], dict[str, set[str]]]:
    """Ids of the messages of `common` and what it includes; names of the entries of its enumerations."""
    ids: set[int] = set()
    enums: dict[str, set[str]] = {}
    for name in ("common", "standard", "minimal"):
        root = ET.parse(folder / f"{name}.xml").getroot()
        ids |= {int(m.attrib["id"]) for m in root.iter("message")}
        for e in root.iter("enum"):
            enums.setdefault(e.attrib["name"], set()).update(n.attrib["name"] for n in e.findall("entry"))
    return ids, enums


def merged(folder: Path) -> str:
    """Text of an XML file that includes common.xml and adds what only the house and installed packages have."""
    ids, known = _stock(folder)
    root = ET.Element("mavlink")
    ET.SubElement(root, "include").text = "common.xml"
    ET.SubElement(root, "dialect").text = "0"
    enums, messages = ET.SubElement(root, "enums"), ET.SubElement(root, "messages")
    by_name: dict[str, ET.Element] = {}
    for path in files():
        tree = ET.parse(path).getroot()
        for e in tree.iter("enum"):
            name = e.attrib["name"]
            for n in [n for n in e.findall("entry") if n.attrib["name"] in known.get(name, set())]:
                e.remove(n)
            if name in by_name:
                by_name[name].extend(e.findall("entry"))
            elif e.findall("entry"):
                by_name[name] = e
                enums.append(e)
        messages.extend(m for m in tree.iter("message") if int(m.attrib["id"]) not in ids)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def generate(xml: str, language: str, include: Path | None = None) -> str:
    """What the generator makes of the text of a dialect file; include: folder of the files it includes.

    Raises DialectError with the generator's words if it refuses.
    """
    from pymavlink.generator import mavgen

    said = io.StringIO()
    with tempfile.TemporaryDirectory() as tmp:
        # the generator writes its arguments into the file: bare names in a folder of its own
        for f in include.glob("*.xml") if include is not None else ():
            shutil.copy(f, tmp)
        (Path(tmp) / f"{NAME}.xml").write_text(xml, encoding="utf-8")
        cwd = Path.cwd()
        os.chdir(tmp)
        try:
            with contextlib.redirect_stdout(said):
                opts = mavgen.Opts(NAME, wire_protocol="2.0", language=language, validate=False)
                ok = mavgen.mavgen(opts, [f"{NAME}.xml"])
        finally:
            os.chdir(cwd)
        made = sorted(p for p in Path(tmp).iterdir() if p.stem == NAME and p.suffix in (".py", ".lua"))
        if not ok or not made:
            raise DialectError(f"the generator refused: {said.getvalue().strip()[-500:]}")
        return made[0].read_text(encoding="utf-8")


def complete(suffix: str) -> str:
    """The complete dialect as the text of a .py module, a .lua dissector or an .xml file. Raises DialectError."""
    if suffix not in LANGUAGES:
        raise DialectError(f"{suffix!r}: allowed: a file that ends in {', '.join(LANGUAGES)}")
    folder = stock_folder()
    xml = merged(folder)
    return generate(xml, LANGUAGES[suffix], folder) if LANGUAGES[suffix] else xml
