"""Joints of a URDF file (wiki.ros.org/urdf/XML) between two of its links."""

import os
import xml.etree.ElementTree as ElementTree
from typing import Any

from edge.errors import InputError
from edge.files import parsing, read_bytes


def arm_between(
    path: str | os.PathLike[str],
    base: str,
    tip: str,
) -> dict[str, Any]:
    """The joints from link `base` to link `tip`, as a table for
    `edge.touch.arm.Chain.from_dict`.

    Raises:
        InputError: the file cannot be read, or no chain leads from `base` to another
            link `tip`.
    """
    if base == tip:
        raise InputError(
            f"{path}: link {tip!r} is both base and tip; name the arm's two ends"
        )
    root = _root(path)
    links = [link.get("name") for link in root.findall("link")]
    for name in (base, tip):
        if name not in links:
            raise InputError(
                f"{path}: no link {name!r}; it has {', '.join(map(str, links))}"
            )
    parents = _parents(path, root)
    joints: list[dict[str, Any]] = []
    link = tip
    while link != base:
        if link not in parents:
            raise InputError(
                f"{path}: no chain of joints leads from {base!r} to {tip!r}"
            )
        element = parents.pop(link)  # taken out, so that a loop of links ends
        joints.append(_joint(path, element))
        link = _link(path, element, "parent")
    return {"base": base, "tip": tip, "joint": joints[::-1]}


def _root(path: str | os.PathLike[str]) -> ElementTree.Element:
    """The element `robot` of a URDF file."""
    with parsing(os.fspath(path), "a URDF file"):
        root = ElementTree.fromstring(read_bytes(path))
    if root.tag != "robot":
        raise InputError(
            f"{path}: not a URDF file: its root is <{root.tag}> instead of <robot>"
        )
    return root


def _parents(
    path: str | os.PathLike[str], root: ElementTree.Element
) -> dict[str, ElementTree.Element]:
    """{link: the joint that leads to it}."""
    parents: dict[str, ElementTree.Element] = {}
    for element in root.findall("joint"):
        child = _link(path, element, "child")
        if child in parents:
            names = [parents[child].get("name"), element.get("name")]
            raise InputError(
                f"{path}: joints {names[0]!r} and {names[1]!r} both lead "
                f"to link {child!r}; remove one of them"
            )
        parents[child] = element
    return parents


def _link(path: str | os.PathLike[str], element: ElementTree.Element, tag: str) -> str:
    child = element.find(tag)
    link = None if child is None else child.get("link")
    if link is None:
        raise InputError(
            f"{path}: joint {element.get('name')!r} has no <{tag} link=...>"
        )
    return link


def _joint(
    path: str | os.PathLike[str], element: ElementTree.Element
) -> dict[str, Any]:
    name = str(element.get("name"))
    kind = str(element.get("type", ""))
    mimic = element.find("mimic")
    if mimic is not None and kind != "fixed":
        raise InputError(
            f"{path}: joint {name!r} follows joint {mimic.get('joint')!r} (<mimic>) "
            "and has no angle of its own; choose another base or tip, or make it fixed"
        )
    joint: dict[str, Any] = {"name": name, "type": kind, "axis": [1.0, 0.0, 0.0]}
    with parsing(f"{path}: joint {name!r}", "numbers"):
        for tag, attribute, key in (
            ("axis", "xyz", "axis"),
            ("origin", "xyz", "origin_xyz"),
            ("origin", "rpy", "origin_rpy"),
        ):
            child = element.find(tag)
            if child is None or (key == "axis" and kind == "fixed"):
                continue  # which may have the axis 0 0 0
            if attribute in child.attrib:
                joint[key] = list(map(float, child.attrib[attribute].split()))
        limit = element.find("limit")
        if limit is not None and kind in ("revolute", "prismatic"):
            ends = [limit.get("lower", "0"), limit.get("upper", "0")]
            joint["limits"] = list(map(float, ends))
    return joint
