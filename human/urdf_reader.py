"""Reads a URDF as a human model: chains of revolutes become joints of one to three axes.

Massless links between revolutes vanish into their joint; links on fixed joints become named frames,
their mass added to the segment that carries them.
"""

from collections.abc import Iterable

import numpy as np

from human.errors import UrdfError
from human.model import Array, Frame, HumanModel, Subject
from human.names import AXES, JOINT_ALIASES, SEGMENTS
from human.rotations import skew
from human.urdf_xml import Document, Joint, Link, parse_urdf


def from_urdf(xml: str | bytes, *, subject: Subject | None = None) -> HumanModel:
    """Makes a model of a URDF document, such as those of the IIT human models.

    Args:
        xml: the document's content, not its path.
        subject: the person it stands for, if known.

    Returns:
        The model. Segments stand in the house's order where all their names are the house's.

    Raises:
        UrdfError: not a URDF, or not one of a human model: the message names the element and what
            to change.
    """
    document = parse_urdf(xml)
    tree = _Tree(document)
    tree.grow()
    order = tree.order()
    names = [tree.segments[index].name for index in order]
    place = {old: new for new, old in enumerate(order)}
    joints = [tree.joints[index] for index in order[1:]]
    axes = [
        (new, joint)
        for new, chain in enumerate(joints)
        for joint in chain
        if joint.axis is not None
    ]
    return HumanModel(
        name=document.name,
        segment_names=tuple(names),
        parents=(-1, *(place[tree.parents[index]] for index in order[1:])),
        joint_names=tuple(_joint_name(chain) for chain in joints),
        offsets=np.array([tree.offsets[index] for index in order[1:]]).reshape(-1, 3),
        dof_names=tuple(_canonical(joint.name) for _, joint in axes),
        dof_joints=np.array([new for new, _ in axes], dtype=np.intp),
        dof_axes=np.array([joint.axis for _, joint in axes], dtype=np.intp),
        lower=np.array([joint.lower for _, joint in axes]),
        upper=np.array([joint.upper for _, joint in axes]),
        masses=np.array([tree.body(index)[0] for index in order]),
        centers_of_mass=np.array([tree.body(index)[1] for index in order]),
        inertias=np.array([tree.body(index)[2] for index in order]),
        frames={
            name: Frame(tree.segments[index].name, position)
            for name, (index, position) in tree.frames.items()
        },
        shapes={
            tree.segments[index].name: shape
            for index in order
            if (shape := tree.segments[index].shape) is not None
        },
        subject=subject,
        provenance={"model": f"URDF {document.name!r}"},
    )


class _Tree:
    """Segments found by walking the document from its root link."""

    def __init__(self, document: Document) -> None:
        self._links = document.links
        self._below: dict[str, list[Joint]] = {name: [] for name in document.links}
        children: set[str] = set()
        for joint in document.joints:
            if joint.child in children:
                raise UrdfError(f"link {joint.child!r}", "expected one joint above it, got more")
            children.add(joint.child)
            self._below[joint.parent].append(joint)
        roots = [name for name in document.links if name not in children]
        if len(roots) != 1:
            raise UrdfError("links", f"expected one root, got {len(roots)}: {', '.join(roots[:5])}")
        self.segments: list[Link] = [document.links[roots[0]]]
        self.parents: list[int] = [-1]
        self.offsets: list[Array] = [np.zeros(3)]
        self.joints: list[tuple[Joint, ...]] = [()]
        self.frames: dict[str, tuple[int, Array]] = {}
        self._added: dict[int, list[tuple[Link, Array]]] = {}

    def grow(self) -> None:
        """Walks down from the root; a stack, so that a long chain is no danger."""
        visited = 1
        todo: list[tuple[int, str, Array]] = [(0, self.segments[0].name, np.zeros(3))]
        while todo:
            index, link, shift = todo.pop()
            for joint in self._below[link]:
                child = self._links[joint.child]
                visited += 1
                if joint.axis is None and joint.child not in SEGMENTS:
                    position = shift + joint.offset
                    self.frames[joint.child] = (index, position)
                    self._added.setdefault(index, []).append((child, position))
                    todo.append((index, joint.child, position))
                    continue
                chain = self._chain(joint)
                visited += len(chain) - 1
                self.segments.append(self._links[chain[-1].child])
                self.parents.append(index)
                self.offsets.append(shift + joint.offset)
                self.joints.append(chain)
                todo.append((len(self.segments) - 1, chain[-1].child, np.zeros(3)))
        if visited != len(self._links):
            raise UrdfError("joints", "expected a tree, got a loop or links that nothing holds")

    def _chain(self, joint: Joint) -> tuple[Joint, ...]:
        """Follows massless links down to the segment that the revolutes carry."""
        chain = [joint]
        while chain[-1].axis is not None and self._links[chain[-1].child].mass == 0.0:
            below = self._below[chain[-1].child]
            if len(below) != 1 or below[0].axis is None or np.any(below[0].offset):
                break
            chain.append(below[0])
        axes = [link.axis for link in chain]
        if len(set(axes)) != len(axes):
            raise UrdfError(
                f"joint {chain[-1].name!r}",
                "expected each axis once in a chain through massless links",
            )
        return tuple(chain)

    def body(self, index: int) -> tuple[float, Array, Array]:
        """Returns mass, centre and inertia of a segment with all that is fixed to it.

        Derived here: parallel axes; mass and first and second moments about the segment's origin
        add up.
        """
        link = self.segments[index]
        if index not in self._added:
            return link.mass, link.center_of_mass, link.inertia
        parts = [(link, np.zeros(3)), *self._added[index]]
        mass = sum(part.mass for part, _ in parts)
        if mass == 0.0:
            return 0.0, np.zeros(3), np.zeros((3, 3))
        first = sum(
            (part.mass * (shift + part.center_of_mass) for part, shift in parts), start=np.zeros(3)
        )
        center = first / mass
        inertia = np.zeros((3, 3))
        for part, shift in parts:
            lever = skew(shift + part.center_of_mass - center)
            inertia += part.inertia - part.mass * lever @ lever
        return mass, center, inertia

    def order(self) -> list[int]:
        """Returns the segments parents first: the house's order, or else that of the document."""
        names = [segment.name for segment in self.segments]
        if set(names) <= set(SEGMENTS):
            wanted = sorted(range(len(names)), key=lambda index: SEGMENTS.index(names[index]))
            rank = {index: place for place, index in enumerate(wanted)}
            if all(rank[self.parents[index]] < rank[index] for index in wanted[1:]):
                return wanted
        below: dict[int, list[int]] = {}
        for index, parent in enumerate(self.parents):
            below.setdefault(parent, []).append(index)
        found: list[int] = []
        todo = [0]
        while todo:
            index = todo.pop()
            found.append(index)
            todo.extend(reversed(below.get(index, [])))
        return found


def _canonical(name: str) -> str:
    """Returns the house's spelling of a degree of freedom."""
    joint, _, axis = name.rpartition("_")
    return f"{JOINT_ALIASES.get(joint, joint)}_{axis}" if axis in AXES else name


def _joint_name(chain: Iterable[Joint]) -> str:
    """Returns the name that the chain's revolutes share, or its last one's."""
    names = [_canonical(joint.name) for joint in chain]
    stems = {name.rpartition("_")[0] for name in names if name.rpartition("_")[2] in AXES}
    return stems.pop() if len(stems) == 1 else names[-1]
