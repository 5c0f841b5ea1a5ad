"""The dialect, read from its XML at start: layout of every message, every enumeration.

house.xml is the one place where the wire is defined. Another package adds messages of its own block of ids, and entries of
enumerations, by an XML file of the same form: entry-point group wakefield.dialects, an object that is the file's path.
Layout rules: MAVLink serialization (largest type first, extensions last; CRC_EXTRA over names and types). A test builds
the generator's own module from the same files and compares.
"""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from fastcrc import crc16

from flightsw import plugins

XML = Path(__file__).resolve().parent / "house.xml"
MAX_PAYLOAD = 255  # [byte] MAVLink 2
CODES = {
    "char": "c", "int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I",
    "int64_t": "q", "uint64_t": "Q", "float": "f", "double": "d",
}  # fmt: skip
VERSION_TYPE = "uint8_t_mavlink_version"


class IcdError(ValueError):
    """A dialect file breaks a rule of the ICD. The text names file, message and field."""


@dataclass(frozen=True, slots=True)
class Field:
    """One field: its wire type, length of an array (0: none), unit, the code of `struct` and the bytes of one element."""

    name: str
    type: str
    length: int
    extension: bool
    unit: str = ""

    @property
    def code(self) -> str:
        """Type code of `struct`."""
        return CODES[self.type]

    @property
    def size(self) -> int:
        """Bytes of one element."""
        return struct.calcsize("<" + self.code)

    @property
    def format(self) -> str:
        """The field in a `struct` format: text is one value, an array as many as it is long."""
        if self.type == "char":
            return f"{max(self.length, 1)}s"
        return f"{self.length or ''}{self.code}"


@dataclass(frozen=True, slots=True)
class Message:
    """Layout of one message: fields as declared and in the order of the wire, its struct, its CRC_EXTRA."""

    id: int
    name: str
    fields: tuple[Field, ...]
    wire: tuple[Field, ...]
    packer: struct.Struct
    crc_extra: int


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry of an enumeration."""

    name: str
    description: str
    params: dict[int, str] = field(default_factory=dict)  # of a command: number -> meaning


@dataclass(frozen=True)
class Dialect:
    """Messages by id, enumerations by name and value, and the value of every entry by its name."""

    messages: dict[int, Message]
    enums: dict[str, dict[int, Entry]]
    values: dict[str, int]

    def words(self, enum: str) -> dict[int, str]:
        """Value -> name of an entry without the enumeration's own, in lower case: 3 -> "managed"."""
        return {v: e.name.removeprefix(f"{enum}_").lower() for v, e in self.enums[enum].items()}


def crc_extra(name: str, wire: Iterable[Field]) -> int:
    """The seed of a message's CRC: name, then type, name and array length of every field that is no extension, wire order."""
    text = f"{name} ".encode()
    for f in wire:
        if not f.extension:
            text += f"{f.type} {f.name} ".encode() + (bytes([f.length]) if f.length else b"")
    crc = crc16.mcrf4xx(text)
    return (crc & 0xFF) ^ (crc >> 8)


def _field(e: ET.Element, extension: bool, at: str) -> Field:
    base, _, rest = e.attrib["type"].replace(VERSION_TYPE, "uint8_t").partition("[")
    name = e.attrib["name"]
    if base not in CODES:
        raise IcdError(
            f"{at}, field {name}: type {e.attrib['type']!r}: allowed: {', '.join(CODES)}, or an array of them"
        )
    if not (e.text or "").strip():
        raise IcdError(f"{at}, field {name}: no description")
    return Field(name, base, int(rest.rstrip("]")) if rest else 0, extension, e.attrib.get("units", ""))


def _message(m: ET.Element, where: str) -> Message:
    name, at = m.attrib["name"], f"{where}: message {m.attrib['name']}"
    fields, extension = [], False
    for e in m:
        extension = extension or e.tag == "extensions"
        if e.tag == "field":
            fields.append(_field(e, extension, at))
    if not (m.findtext("description") or "").strip():
        raise IcdError(f"{at}: no description")
    wire = sorted((f for f in fields if not f.extension), key=lambda f: -f.size) + [f for f in fields if f.extension]
    packer = struct.Struct("<" + "".join(f.format for f in wire))
    if packer.size > MAX_PAYLOAD:
        raise IcdError(f"{at}: payload {packer.size} bytes; allowed at most {MAX_PAYLOAD}")
    return Message(int(m.attrib["id"]), name, tuple(fields), tuple(wire), packer, crc_extra(name, wire))


def read(files: Iterable[Path]) -> Dialect:
    """The dialect of several files. Raises OSError; IcdError naming file and message, too for an id, name or value used twice."""
    messages: dict[int, Message] = {}
    enums: dict[str, dict[int, Entry]] = {}
    values: dict[str, int] = {}
    names: set[str] = set()
    for path in files:
        try:
            root = ET.fromstring(path.read_text(encoding="utf-8"))
        except ET.ParseError as error:
            raise IcdError(f"{path.name}: not valid XML: {error}") from None
        for m in root.iter("message"):
            new = _message(m, path.name)
            if new.id in messages or new.name in names:
                other = messages[new.id].name if new.id in messages else new.name
                raise IcdError(f"{path.name}: message {new.name}: id {new.id} or name is already used by {other}")
            messages[new.id] = new
            names.add(new.name)
        for e in root.iter("enum"):
            _enum(e, enums.setdefault(e.attrib["name"], {}), values, path.name)
    return Dialect(messages, enums, values)


def _enum(e: ET.Element, out: dict[int, Entry], values: dict[str, int], where: str) -> None:
    for n in e.findall("entry"):
        name, value = n.attrib["name"], int(n.attrib["value"], 0)
        if value in out or name in values:
            raise IcdError(f"{where}: enumeration {e.attrib['name']}: {name} = {value}: name or value is already used")
        params = {int(p.attrib["index"]): (p.text or "").strip() for p in n.findall("param")}
        out[value] = Entry(name, (n.findtext("description") or "").strip(), params)
        values[name] = value


def files() -> list[Path]:
    """The house's file, and those of installed packages in the order of their names."""
    return [XML, *plugins.parts(plugins.DIALECTS, Path).values()]


HOUSE: Dialect = read(files())
ENUMS, VALUES = HOUSE.enums, HOUSE.values
