"""Generate docs/icd.md from house.xml.

python -m flightsw.icd.gen            write it
python -m flightsw.icd.gen --check    exit 1 and name the file if it is out of date
"""

from __future__ import annotations

import argparse
import sys
import xml.etree.ElementTree as ET

from flightsw.icd.dialect import XML, Dialect, read

DOC = XML.parents[2] / "docs" / "icd.md"


def make_doc(root: ET.Element, d: Dialect) -> str:
    """Text of docs/icd.md from the parsed ICD and the dialect read from it."""
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
        size = d.messages[int(m.attrib["id"])].packer.size
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
    text = make_doc(ET.fromstring(XML.read_text()), read([XML]))
    if not args.check:
        DOC.write_text(text)
    elif not DOC.exists() or DOC.read_text() != text:
        print(f"{DOC} is out of date: run python -m flightsw.icd.gen", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
