"""Writes a human model as URDF, with the solids of its segments as visuals.

A spherical joint becomes three revolutes through two massless links, as in the IIT human models;
numbers are written so that reading them back gives the same bits.

Source: the URDF XML specification (ROS); Latella et al. 2019, section 2.3 (chains of revolutes).
"""

import re
from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np

from human.errors import ModelError
from human.model import HumanModel
from human.names import AXES
from human.shapes import Box, Cylinder, Shape, Sphere

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
#: The format wants an effort and a velocity limit; these bound nothing a person does.
_EFFORT_LIMIT_NM = 1000.0
_VELOCITY_LIMIT_RAD_S = 100.0
#: Half turns (roll, pitch, yaw) that lay a cylinder, which URDF stands on z, along x or y.
_CYLINDER_RPY = ((0.0, np.pi / 2, 0.0), (-np.pi / 2, 0.0, 0.0), (0.0, 0.0, 0.0))
_COLOR_RGBA = "0.55 0.62 0.70 1"


def to_urdf(model: HumanModel) -> str:
    """Returns the model as a URDF document.

    Frames become massless links on fixed joints named ``j`` + frame name.

    Raises:
        ModelError: a name is not a plain word and could not be used in other tools.
    """
    for name in (model.name, *model.segment_names, *model.dof_names, *model.frames):
        if not _NAME.fullmatch(name):
            raise ModelError(f"name {name!r}: expected letters, digits and underscores")
    robot = ElementTree.Element("robot", name=model.name)
    material = ElementTree.SubElement(robot, "material", name="body")
    ElementTree.SubElement(material, "color", rgba=_COLOR_RGBA)
    for index, segment in enumerate(model.segment_names):
        if index:
            _write_joint(robot, model, index)
        _write_segment(robot, model, index, segment)
    for name, frame in model.frames.items():
        _joint(robot, f"j{name}", "fixed", frame.segment, name, frame.position)
        ElementTree.SubElement(robot, "link", name=name)
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _write_joint(robot: ElementTree.Element, model: HumanModel, index: int) -> None:
    """Writes the revolutes that carry a segment, with massless links between them."""
    joint, segment = index - 1, model.segment_names[index]
    dofs = model.joint_dofs(joint)
    parent = model.segment_names[model.parents[index]]
    if not len(dofs):
        _joint(robot, model.joint_names[joint], "fixed", parent, segment, model.offsets[joint])
        return
    for place, dof in enumerate(dofs):
        last = place == len(dofs) - 1
        child = segment if last else f"{segment}_f{place + 1}"
        offset = model.offsets[joint] if place == 0 else np.zeros(3)
        element = _joint(robot, model.dof_names[dof], "revolute", parent, child, offset)
        axis = ["1" if k == model.dof_axes[dof] else "0" for k in range(len(AXES))]
        ElementTree.SubElement(element, "axis", xyz=" ".join(axis))
        ElementTree.SubElement(
            element,
            "limit",
            lower=repr(float(model.lower[dof])),
            upper=repr(float(model.upper[dof])),
            effort=repr(_EFFORT_LIMIT_NM),
            velocity=repr(_VELOCITY_LIMIT_RAD_S),
        )
        if not last:
            ElementTree.SubElement(robot, "link", name=child)
        parent = child


def _joint(
    robot: ElementTree.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    offset: Iterable[float],
) -> ElementTree.Element:
    element = ElementTree.SubElement(robot, "joint", name=name, type=kind)
    ElementTree.SubElement(element, "origin", xyz=_triple(offset), rpy="0 0 0")
    ElementTree.SubElement(element, "parent", link=parent)
    ElementTree.SubElement(element, "child", link=child)
    return element


def _write_segment(robot: ElementTree.Element, model: HumanModel, index: int, name: str) -> None:
    link = ElementTree.SubElement(robot, "link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=repr(float(model.masses[index])))
    ElementTree.SubElement(
        inertial, "origin", xyz=_triple(model.centers_of_mass[index]), rpy="0 0 0"
    )
    inertia = model.inertias[index]
    entries = {
        f"i{'xyz'[r]}{'xyz'[c]}": repr(float(inertia[r, c])) for r in range(3) for c in range(r, 3)
    }
    ElementTree.SubElement(inertial, "inertia", entries)
    if name in model.shapes:
        _write_visual(link, model.shapes[name])


def _write_visual(link: ElementTree.Element, shape: Shape) -> None:
    visual = ElementTree.SubElement(link, "visual")
    rpy = _CYLINDER_RPY[shape.axis] if isinstance(shape, Cylinder) else (0.0, 0.0, 0.0)
    ElementTree.SubElement(visual, "origin", xyz=_triple(shape.center), rpy=_triple(rpy))
    geometry = ElementTree.SubElement(visual, "geometry")
    match shape:
        case Box():
            ElementTree.SubElement(geometry, "box", size=_triple(shape.size))
        case Cylinder():
            ElementTree.SubElement(
                geometry,
                "cylinder",
                radius=repr(float(shape.radius)),
                length=repr(float(shape.length)),
            )
        case Sphere():
            ElementTree.SubElement(geometry, "sphere", radius=repr(float(shape.radius)))
    ElementTree.SubElement(visual, "material", name="body")


def _triple(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
