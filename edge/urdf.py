"""Joints of a URDF file (wiki.ros.org/urdf/XML) between two of its links."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree

from edge.arm import MOVING, Joint, Vector
from edge.errors import InputError


def joints_between(path: str | os.PathLike[str], base: str, tip: str) -> list[Joint]:
    """The joints that lead from link `base` to link `tip`, in that order.

    Raises:
        InputError: the file cannot be read, or no chain leads from `base` to `tip`.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: not a URDF file: {error}") from None
    if root.tag != "robot":
        raise InputError(f"{path}: not a URDF file: its root is <{root.tag}>, not <robot>")
    links = [link.get("name") for link in root.findall("link")]
    for name in (base, tip):
        if name not in links:
            raise InputError(f"{path}: no link {name!r}; it has {', '.join(map(str, links))}")
    parents: dict[str, ElementTree.Element] = {}
    for element in root.findall("joint"):
        parents[_attribute(path, element, "child", "link")] = element
    joints: list[Joint] = []
    link = tip
    while link != base:
        if link not in parents:
            raise InputError(f"{path}: no chain of joints leads from {base!r} to {tip!r}")
        element = parents.pop(link)  # popped, so that a loop of links ends
        joints.append(_urdf_joint(path, element))
        link = _attribute(path, element, "parent", "link")
    return joints[::-1]


def _attribute(
    path: str | os.PathLike[str], element: ElementTree.Element, tag: str, name: str
) -> str:
    child = element.find(tag)
    value = None if child is None else child.get(name)
    if value is None:
        raise InputError(f"{path}: joint {element.get('name')!r} has no <{tag} {name}=...>")
    return value


def _numbers(path: str | os.PathLike[str], text: str, what: str) -> Vector:
    try:
        x, y, z = map(float, text.split())
    except ValueError:
        raise InputError(f"{path}: {what} must be three numbers, not {text!r}") from None
    return x, y, z


def _urdf_joint(path: str | os.PathLike[str], element: ElementTree.Element) -> Joint:
    name = str(element.get("name"))
    kind = str(element.get("type"))
    if kind not in (*MOVING, "fixed"):
        raise InputError(f"{path}: joint {name!r} of type {kind!r} cannot be part of the chain")
    origin, axis, limit = element.find("origin"), element.find("axis"), element.find("limit")
    xyz = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
    rpy = "0 0 0" if origin is None else origin.get("rpy", "0 0 0")
    limits: tuple[float, float] | None = None
    if limit is not None and kind in ("revolute", "prismatic"):
        text = f"{limit.get('lower', '0')} {limit.get('upper', '0')} 0"
        lower, upper, _ = _numbers(path, text, f"limit of joint {name!r}")
        limits = (lower, upper)
    return Joint(
        name=name,
        axis=_numbers(
            path, "1 0 0" if axis is None else axis.get("xyz", "1 0 0"), f"axis of joint {name!r}"
        ),
        kind=kind,
        origin_xyz=_numbers(path, xyz, f"origin of joint {name!r}"),
        origin_rpy=_numbers(path, rpy, f"origin of joint {name!r}"),
        limits=limits,
    )
