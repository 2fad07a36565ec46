"""The looks of a thing with joints, from its URDF, with every joint at zero: a door closed, a drawer shut."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from avlmaps.core.errors import SceneError


def read_urdf(path: Path) -> list[tuple[Path, Float[np.ndarray, "4 4"]]]:
    """Return the model files of a URDF, each with its pose in the root link's axes (scale included).

    Raises:
        SceneError: it is missing, no XML, or its joints go round in a ring.
    """
    try:
        robot = ElementTree.parse(path).getroot()
        joints = {_named(joint, "child"): joint for joint in robot.iter("joint") if joint.find("child") is not None}
        looks = []
        for link in robot.iter("link"):
            pose = _link_pose(str(link.get("name")), joints)
            for visual in link.iter("visual"):
                shape = visual.find("geometry/mesh")
                if shape is None:
                    continue
                scale = np.diag([*_numbers(shape.get("scale"), (1.0, 1.0, 1.0)), 1.0])
                model = (path.parent / str(shape.get("filename")).removeprefix("package://")).resolve()
                looks.append((model, pose @ _origin(visual) @ scale))
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from error
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise SceneError(f"{path} is not a URDF that can be read ({error})") from error
    return looks


def _link_pose(link: str, joints: dict[str, ElementTree.Element]) -> Float[np.ndarray, "4 4"]:
    joint = joints.get(link)
    return np.eye(4) if joint is None else _link_pose(_named(joint, "parent"), joints) @ _origin(joint)


def _named(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    if found is None:
        raise ValueError(f"joint {joint.get('name')} has no {end}")
    return str(found.get("link"))


def _origin(element: ElementTree.Element) -> Float[np.ndarray, "4 4"]:
    origin = element.find("origin")
    pose = np.eye(4)
    if origin is not None:
        pose[:3, :3] = Rotation.from_euler("xyz", _numbers(origin.get("rpy"), (0.0, 0.0, 0.0))).as_matrix()
        pose[:3, 3] = _numbers(origin.get("xyz"), (0.0, 0.0, 0.0))
    return pose


def _numbers(text: str | None, otherwise: tuple[float, float, float]) -> list[float]:
    values = list(otherwise) if text is None else [float(word) for word in text.split()]
    if len(values) != 3:
        raise ValueError(f"{text!r} is not three numbers")
    return values
