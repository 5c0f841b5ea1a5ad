"""Somebody else's JSBSim model as an airframe for the plant: aerodynamics, masses and tanks of its file, and nothing that opens a
socket, writes a file or flies by itself.

Dropped: inputs, outputs, flight control, autopilot, systems, engines, ground contact. Controls are the plant's servos, which move
the surfaces themselves; thrust is the plant's, along body x at the mean place of the model's thrusters.
"""

from __future__ import annotations

import hashlib
import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from flightsw.strict import ConfigError
from sim_plant.aircraft.jsbsim import model as m
from sim_plant.aircraft.jsbsim.motion import FT, LB, SLUG, library
from sim_plant.kernels.layout import G0

KEEP = ("metrics", "mass_balance", "buoyant_forces", "propulsion", "aerodynamics")
# surfaces in radians, thrice each: those its aerodynamics may go by
SURFACES = (
    "fcs/left-aileron-pos-rad", "fcs/elevator-pos-rad", "fcs/rudder-pos-rad",
    "-fcs/right-aileron-pos-rad", "fcs/elevator-pos-rad", "fcs/rudder-pos-rad",
)  # fmt: skip
LENGTH = {"IN": 0.0254, "FT": FT, "M": 1.0, "CM": 0.01, "MM": 0.001, "KM": 1000.0}
AREA = {"FT2": FT**2, "M2": 1.0, "IN2": 0.0254**2}
WEIGHT = {"LBS": LB, "KG": 1.0}
INERTIA = {"SLUG*FT2": SLUG * FT**2, "KG*M2": 1.0}


@dataclass(frozen=True)
class Stock:
    """A model's file, inputs and outputs stripped. Masses [kg] as it is empty (point masses of the file are in it); thrusters and
    centre of gravity in structural axes (aft, right, up) [m], tanks' capacities and what is
    in them as shipped [kg]."""

    name: str
    tree: ET.Element
    empty_kg: float
    cg_m: tuple[float, float, float]
    thrusters_m: tuple[tuple[float, float, float], ...]
    tanks_kg: tuple[float, ...]
    contents_kg: tuple[float, ...]
    points: int  # point masses of the file
    engines: tuple[str, ...]  # files of its engines
    dropped: tuple[str, ...]

    @property
    def thrust_m(self) -> tuple[float, float, float]:
        """Mean place of its thrusters [m]."""
        k = len(self.thrusters_m)
        x, y, z = (sum(t[i] for t in self.thrusters_m) / k for i in range(3))
        return x, y, z

    def xml(self, flat_height_m: float | None) -> str:
        """Its configuration as the plant flies it: over a flat earth of standard gravity at this height [m], or None: WGS-84."""
        root = ET.fromstring(ET.tostring(self.tree))
        if flat_height_m is not None:
            root.insert(0, ET.fromstring(m.planet(G0, flat_height_m)))
        balance = _child(root, "mass_balance", self.name)
        balance.append(ET.fromstring(m.point_masses(self.cg_m, ((0, 0, 0),))))
        for part in ("<ground_reactions/>", m.system(), m.reactions(self.thrust_m)):
            root.append(ET.fromstring(part))
        return ET.tostring(root, encoding="unicode")

    @property
    def digest(self) -> str:
        """SHA-256 of what is flown."""
        return hashlib.sha256(self.xml(None).encode()).hexdigest()


def place(source: str) -> Path:
    """File of a model by name ("737") or path. Raises ConfigError naming what exists."""
    if source.endswith(".xml"):
        path = Path(source)
        have = "a file that exists"
    else:
        root = Path(library().get_default_root_dir()) / "aircraft"
        path = root / source / f"{source}.xml"
        have = ", ".join(sorted(p.name for p in root.iterdir() if (p / f"{p.name}.xml").exists()))
    if not path.exists():
        raise ConfigError(f"JSBSim's aircraft {source!r} does not exist; allowed: {have}")
    return path


def read(source: str) -> Stock:
    """A model by name or path. Raises ConfigError for a file that is no aircraft, or has what this reader does not know."""
    path = place(source)
    name = path.stem
    root = parse(path)
    kept, dropped = [], []
    for part in list(root):
        if part.tag not in KEEP:
            dropped.append(part.tag)
            continue
        if part.get("file"):
            part = parse(_beside(path, str(part.get("file"))))
        kept.append(part)
    out = ET.Element("fdm_config", {"name": name, "version": root.get("version", "2.0"), "release": "BETA"})
    out.extend(kept)
    _use_own_rates(_child(out, "aerodynamics", name))
    balance = _child(out, "mass_balance", name)
    engines, thrusters, tanks, contents = [], [], [], []
    propulsion = out.find("propulsion")
    for part in [] if propulsion is None else list(propulsion):
        if part.tag == "engine":
            engines.append(str(part.get("file")))
            thrusters.append(_thruster(part, name))
            assert propulsion is not None
            propulsion.remove(part)
        elif part.tag == "tank":
            tanks.append(_number(_child(part, "capacity", name), WEIGHT, name))
            inside = part.find("contents")
            contents.append(0.0 if inside is None else _number(inside, WEIGHT, name))
    if not thrusters:
        raise ConfigError(f"JSBSim's {name}: no engine: nothing to identify thrust by")
    points = balance.findall("pointmass")
    empty = _number(_child(balance, "emptywt", name), WEIGHT, name)
    empty += sum(_number(_child(p, "weight", name), WEIGHT, name) for p in points)
    cg = next((_location(e, name) for e in balance.findall("location") if e.get("name") == "CG"), None)
    if cg is None:
        raise ConfigError(f"JSBSim's {name}: mass_balance has no location CG")
    return Stock(
        name,
        out,
        empty,
        cg,
        tuple(thrusters),
        tuple(tanks),
        tuple(contents),
        len(points),
        tuple(engines),
        tuple(sorted(set(dropped))),
    )


def parse(path: Path) -> ET.Element:
    """Raises ConfigError for what is no XML, or declares entities: a model needs none, and they can ask for files."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if "<!ENTITY" in text:
        raise ConfigError(f"{path}: declares entities; allowed: none")
    try:
        return ET.fromstring(text)
    except ET.ParseError as e:
        raise ConfigError(f"{path}: {e}") from None


def _beside(path: Path, name: str) -> Path:
    """A part of a model in a file of its own. Raises ConfigError for one that is not in the model's folder."""
    part = path.parent / (name if name.endswith(".xml") else f"{name}.xml")
    if path.parent.resolve() not in part.resolve().parents or not part.exists():
        raise ConfigError(f"{path}: file = {name!r}: allowed: one in the model's folder")
    return part


def _use_own_rates(aerodynamics: ET.Element) -> None:
    """Rates against turning air in the place of those against still air, within the aerodynamics only."""
    new = dict(zip(m.AERO_RATES, m.OWN_RATES, strict=True))
    for e in aerodynamics.iter():
        if e.text and (name := e.text.strip()) in new:
            e.text = new[name]
    own = ET.fromstring(f"<x>{m.own_rates()}</x>")
    for i, f in enumerate(own):
        aerodynamics.insert(i, f)


def _child(e: ET.Element, tag: str, name: str) -> ET.Element:
    found = e.find(tag)
    if found is None:
        raise ConfigError(f"JSBSim's {name}: {e.tag} has no {tag}")
    return found


def _number(e: ET.Element, units: dict[str, float], name: str, default: str = "") -> float:
    """A value of the file in SI. Raises ConfigError for another unit."""
    unit = e.get("unit", default or next(iter(units)))
    if unit not in units:
        raise ConfigError(f"JSBSim's {name}: {e.tag} in {unit!r}: allowed: {', '.join(units)}")
    return float(str(e.text)) * units[unit]


def _location(e: ET.Element, name: str) -> tuple[float, float, float]:
    """A place in structural axes [m]."""
    unit = e.get("unit", "IN")
    if unit not in LENGTH:
        raise ConfigError(f"JSBSim's {name}: location in {unit!r}: allowed: {', '.join(LENGTH)}")
    x, y, z = (float(str(_child(e, k, name).text)) * LENGTH[unit] for k in "xyz")
    return x, y, z


def _thruster(engine: ET.Element, name: str) -> tuple[float, float, float]:
    """Place of an engine's thruster [m]. Raises ConfigError for one that does not push along body x."""
    thruster = _child(engine, "thruster", name)
    orient = thruster.find("orient")
    if orient is None:
        orient = engine.find("orient")
    for e in [] if orient is None else list(orient):
        if not math.isclose(float(str(e.text)), 0.0, abs_tol=1e-9) and e.tag != "roll":
            raise ConfigError(f"JSBSim's {name}: thruster turned by {e.tag} = {e.text}: allowed: 0")
    where = thruster.find("location")
    return _location(where if where is not None else _child(engine, "location", name), name)
