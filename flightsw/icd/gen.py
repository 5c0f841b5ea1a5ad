"""Generate mav.py (pymavlink's mavgen) and docs/icd.md from house.xml.

python -m flightsw.icd.gen            write both
python -m flightsw.icd.gen --check    exit 1 and name the file if either is out of date
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

HERE = Path(__file__).resolve().parent
XML = HERE / "house.xml"
MAV = HERE / "mav.py"
DOC = HERE.parents[1] / "docs" / "icd.md"
MAX_PAYLOAD = 255  # [byte] MAVLink 2; mavgen does not check it
SIZES = {"char": 1, "int8_t": 1, "int16_t": 2, "int32_t": 4, "int64_t": 8, "float": 4, "double": 8}


class IcdError(ValueError):
    """house.xml breaks a rule of the ICD. The text names message and field."""


def type_size(wire_type: str) -> int:
    """Bytes of a MAVLink field type such as "float[4]"."""
    base, _, rest = wire_type.replace("_mavlink_version", "").partition("[")
    base = base.removeprefix("u") if base.startswith("uint") else base
    return SIZES[base] * (int(rest.rstrip("]")) if rest else 1)


def check_xml(text: str) -> ET.Element:
    """Parse the ICD and check what mavgen does not: payload limit, every field described, unique ids.

    Raises IcdError naming the offending message and field.
    """
    root = ET.fromstring(text)
    seen: dict[str, str] = {}
    for m in root.iter("message"):
        name, mid = m.attrib["name"], m.attrib["id"]
        if mid in seen:
            raise IcdError(f"message {name}: id {mid} is already used by {seen[mid]}")
        seen[mid] = name
        fields = m.findall("field")
        size = sum(type_size(f.attrib["type"]) for f in fields)
        if size > MAX_PAYLOAD:
            raise IcdError(f"message {name}: payload {size} bytes; allowed at most {MAX_PAYLOAD}")
        for f in fields:
            if not (f.text or "").strip():
                raise IcdError(f"message {name}, field {f.attrib['name']}: no description")
        if not (m.findtext("description") or "").strip():
            raise IcdError(f"message {name}: no description")
    return root


def make_module() -> str:
    """Text of mav.py. Deterministic: mavgen writes no dates, and only the bare XML name goes in."""
    from pymavlink.generator import mavgen

    with tempfile.TemporaryDirectory() as tmp:
        # mavgen writes its arguments into the file: work on a copy under a bare name
        (Path(tmp) / XML.name).write_bytes(XML.read_bytes())
        cwd = Path.cwd()
        os.chdir(tmp)
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                opts = mavgen.Opts("mav.py", wire_protocol="2.0", language="Python3", validate=False)
                mavgen.mavgen(opts, [XML.name])
            return (Path(tmp) / "mav.py").read_text()
        finally:
            os.chdir(cwd)


def make_doc(root: ET.Element) -> str:
    """Text of docs/icd.md from the parsed ICD."""
    out = [
        "# Message ICD",
        "",
        "Generated from `flightsw/icd/house.xml` by `python -m flightsw.icd.gen`; edit the XML, not this page.",
        "MAVLink 2, dialect `wakefield`, packets not signed (local links). NED = local north-east-down; FRD =",
        "body forward-right-down; quaternions scalar first, FRD to NED. Fields are listed in declaration order; `+`",
        "marks an extension field (ignored by CRC_EXTRA).",
        "",
        "## Messages",
        "",
    ]
    for m in sorted(root.iter("message"), key=lambda m: int(m.attrib["id"])):
        fields = m.findall("field")
        size = sum(type_size(f.attrib["type"]) for f in fields)
        out += [f"### {m.attrib['name']} ({m.attrib['id']})", "", f"{m.findtext('description')} {size} bytes.", ""]
        out += ["| field | type | unit | meaning | invalid |", "|---|---|---|---|---|"]
        ext = False
        for e in m:
            ext = ext or e.tag == "extensions"
            if e.tag == "field":
                a = e.attrib
                text = (e.text or "").strip() + (f" `{a['enum']}`" if "enum" in a else "")
                row = (("+" if ext else "") + a["name"], a["type"], a.get("units", ""), text, a.get("invalid", ""))
                out.append("| " + " | ".join(row) + " |")
        out.append("")
    out += ["## Enumerations", ""]
    for e in root.iter("enum"):
        out += [
            f"### {e.attrib['name']}",
            "",
            e.findtext("description") or "",
            "",
            "| value | name | meaning |",
            "|---|---|---|",
        ]
        for n in e.findall("entry"):
            params = "; ".join(f"param{p.attrib['index']}: {p.text}" for p in n.findall("param"))
            text = (n.findtext("description") or "") + (f" ({params})" if params else "")
            out.append(f"| {n.attrib['value']} | {n.attrib['name']} | {text} |")
        out.append("")
    return "\n".join(out)


def main(argv: list[str] | None = None) -> int:
    """Write or check the generated files. Returns the exit code."""
    ap = argparse.ArgumentParser(prog="flightsw.icd.gen", description=__doc__)
    ap.add_argument("--check", action="store_true", help="change nothing; exit 1 if a generated file is out of date")
    args = ap.parse_args(argv)
    try:
        root = check_xml(XML.read_text())
    except (IcdError, ET.ParseError) as e:
        print(f"{XML}: {e}", file=sys.stderr)
        return 1
    stale = 0
    for path, text in ((MAV, make_module()), (DOC, make_doc(root))):
        if args.check:
            if not path.exists() or path.read_text() != text:
                print(f"{path} is out of date: run python -m flightsw.icd.gen", file=sys.stderr)
                stale = 1
        else:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
    return stale


if __name__ == "__main__":
    sys.exit(main())
