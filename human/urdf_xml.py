"""The links and joints of a URDF document, read with suspicion: no entities, clear errors."""

import math
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from human.errors import UrdfError
from human.model import Array
from human.shapes import Box, Cylinder, Shape, Sphere

#: A human model takes some 50 kB; ten times what any could need is refused unread.
LARGEST_BYTES = 4_000_000
_ROTATION_TOLERANCE = 1e-9
_PRINCIPAL_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class Link:
    """A link: mass (kg), centre of mass (m), inertia about it (kg m^2, link axes), first visual."""

    name: str
    mass: float
    center_of_mass: Array
    inertia: Array
    shape: Shape | None


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint: its place in the parent link (m) and its axis, None when it is fixed."""

    name: str
    parent: str
    child: str
    offset: Array
    axis: int | None
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class Document:
    """A URDF: its name, links by name and joints in the order of the document."""

    name: str
    links: dict[str, Link]
    joints: tuple[Joint, ...]


def parse_urdf(xml: str | bytes) -> Document:
    """Reads a URDF document.

    Raises:
        UrdfError: too large, not XML, with a document type, or holding what a human model cannot
            have.
    """
    data = xml.encode() if isinstance(xml, str) else xml
    if len(data) > LARGEST_BYTES:
        raise UrdfError("document", f"expected at most {LARGEST_BYTES} bytes, got {len(data)}")
    robot = _parse(data)
    if robot.tag != "robot":
        raise UrdfError(f"<{robot.tag}>", "expected <robot> as the outermost element")
    links: dict[str, Link] = {}
    for element in robot.findall("link"):
        link = _link(element)
        if link.name in links:
            raise UrdfError(f"link {link.name!r}", "is there twice")
        links[link.name] = link
    joints = tuple(_joint(element, links) for element in robot.findall("joint"))
    names = [joint.name for joint in joints]
    for name in names:
        if names.count(name) > 1:
            raise UrdfError(f"joint {name!r}", "is there twice")
    return Document(robot.get("name", "human"), links, joints)


def _parse(data: bytes) -> ElementTree.Element:
    guard = expat.ParserCreate()

    def refuse(*_: object) -> None:
        raise UrdfError("document type", "expected none; entities are not read")

    guard.StartDoctypeDeclHandler = refuse
    try:
        guard.Parse(data, True)
        return ElementTree.fromstring(data)
    except (expat.ExpatError, ElementTree.ParseError) as error:
        raise UrdfError("document", f"is not well-formed XML ({error})") from None
    except (LookupError, ValueError, RecursionError) as error:
        raise UrdfError("document", f"cannot be decoded ({error})") from None


def _link(element: ElementTree.Element) -> Link:
    name = element.get("name")
    if not name:
        raise UrdfError("<link>", "expected a name")
    place = f"link {name!r}"
    mass, center, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    inertial = element.find("inertial")
    if inertial is not None:
        mass = _number(inertial.find("mass"), "value", f"{place} mass")
        center, rotation = _origin(inertial.find("origin"), f"{place} inertial")
        entries = {
            key: _number(inertial.find("inertia"), key, f"{place} inertia")
            for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        }
        xx, xy, xz, yy, yz, zz = (entries[k] for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        inertia = rotation @ tensor @ rotation.T
    if mass < 0.0:
        raise UrdfError(f"{place} mass", f"expected zero or more kg, got {mass:g}")
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] < -1e-9 * max(1.0, moments[2]):
        raise UrdfError(
            f"{place} inertia", f"expected no negative moment, got {moments[0]:g} kg m^2"
        )
    return Link(name, mass, center, inertia, _shape(element.find("visual"), place))


def _joint(element: ElementTree.Element, links: dict[str, Link]) -> Joint:
    name, kind = element.get("name"), element.get("type")
    if not name:
        raise UrdfError("<joint>", "expected a name")
    place = f"joint {name!r}"
    if kind not in ("revolute", "continuous", "fixed"):
        raise UrdfError(place, f"expected type revolute, continuous or fixed, got {kind!r}")
    ends = []
    for role in ("parent", "child"):
        found = element.find(role)
        link = None if found is None else found.get("link")
        if link not in links:
            raise UrdfError(f"{place} {role}", f"expected a link of this document, got {link!r}")
        ends.append(link)
    offset, rotation = _origin(element.find("origin"), place)
    if np.max(np.abs(rotation - np.eye(3))) > _ROTATION_TOLERANCE:
        raise UrdfError(
            f"{place} origin",
            "expected rpy 0 0 0: every segment stands along the world at the T-pose",
        )
    if kind == "fixed":
        return Joint(name, ends[0], ends[1], offset, None, 0.0, 0.0)
    axis = _axis(element.find("axis"), place)
    lower, upper = -math.pi, math.pi
    limit = element.find("limit")
    if kind == "revolute":
        lower, upper = (_number(limit, key, f"{place} limit") for key in ("lower", "upper"))
        if not lower <= upper:
            raise UrdfError(f"{place} limit", f"expected lower <= upper, got {lower:g} > {upper:g}")
    return Joint(name, ends[0], ends[1], offset, axis, lower, upper)


def _axis(element: ElementTree.Element | None, place: str) -> int:
    values = [1.0, 0.0, 0.0] if element is None else _triple(element.get("xyz"), f"{place} axis")
    for index in range(3):
        if np.allclose(values, np.eye(3)[index], rtol=0.0, atol=_ROTATION_TOLERANCE):
            return index
    raise UrdfError(f"{place} axis", f"expected 1 0 0, 0 1 0 or 0 0 1, got {values}")


def _shape(visual: ElementTree.Element | None, place: str) -> Shape | None:
    """Returns the solid of a visual; None for meshes and for cylinders along no segment axis."""
    geometry = None if visual is None else visual.find("geometry")
    if visual is None or geometry is None or not len(geometry):
        return None
    origin, rotation = _origin(visual.find("origin"), f"{place} visual")
    center = (float(origin[0]), float(origin[1]), float(origin[2]))
    solid, where = geometry[0], f"{place} visual"
    if solid.tag == "sphere":
        return Sphere(_number(solid, "radius", where), center)
    # Rounded half turns (1.57) are taken for half turns.
    along = np.abs(rotation)
    if np.max(np.abs(along - np.round(along))) > _PRINCIPAL_TOLERANCE:
        return None
    if solid.tag == "box":
        x, y, z = np.round(along) @ _triple(solid.get("size"), where)
        return Box((float(x), float(y), float(z)), center)
    if solid.tag == "cylinder":
        axis = int(np.argmax(along[:, 2]))
        return Cylinder(
            _number(solid, "radius", where), _number(solid, "length", where), axis, center
        )
    return None


def _origin(element: ElementTree.Element | None, place: str) -> tuple[Array, Array]:
    """Returns an origin's position and rotation; URDF's roll, pitch, yaw are about fixed axes."""
    if element is None:
        return np.zeros(3), np.eye(3)
    position = np.array(_triple(element.get("xyz", "0 0 0"), f"{place} origin"))
    roll, pitch, yaw = _triple(element.get("rpy", "0 0 0"), f"{place} origin")
    (sr, sp, sy), (cr, cp, cy) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    rotation = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    return position, rotation


def _number(element: ElementTree.Element | None, key: str, place: str) -> float:
    text = None if element is None else element.get(key)
    return _real(text, f"{place} {key}")


def _triple(text: str | None, place: str) -> list[float]:
    parts = (text or "").split()
    if len(parts) != 3:
        raise UrdfError(place, f"expected three numbers, got {text!r}")
    return [_real(part, place) for part in parts]


def _real(text: str | None, place: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        raise UrdfError(place, f"expected a number, got {text!r}") from None
    if not math.isfinite(value):
        raise UrdfError(place, f"expected a finite number, got {text!r}")
    return value
